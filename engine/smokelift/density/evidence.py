"""What pictures say before anything is fitted: where smoke can be, how much of it, and how deep it is in each picture.

One picture's guess is that of its depth profile, about an axis that comes from elsewhere. Of several, each is shown by
the others where its smoke stands; the guess then is what all their profiles have in common, in every layer as much as
the pictures show. It need not look like any of them: scaling ray by ray, the multiplicative fit keeps nothing of it but
how one ray's smoke hangs together with another's. For that round smoke was better in new views than smoke that fills
the hull's corners (docs/accuracy.md).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from smokelift.density.axis import SmokeAxis
from smokelift.density.hull import Projection, centres_of, common_hull
from smokelift.density.profile import DepthProfile
from smokelift.density.screen import view_frame
from smokelift.footage.plate import Plate
from smokelift.render.renderer import Image, Volume
from smokelift.scene import Camera, Domain

LEAST_SHAPE = 0.05
"""Of several profiles each has everywhere in the hull so much of its height: others may show smoke there. 0.1 cost
0.3 dB in new views over four scenes; with less the pictures are met less well."""


@dataclass(frozen=True, eq=False)
class ViewEvidence:
    """A picture and what it says by itself.

    Attributes
    ----------
    camera
        That stands still.
    image : (rows, columns, 3)
        Linear radiance.
    plate
        Background with its noise.
    mask : (rows, columns) bool
        Where it shows smoke.
    amount : (rows, columns)
        Optical depth of unshadowed smoke.
    projection
        Where voxels lie in it.
    counts : (rows, columns) bool
        Pixels that its smoke's voxels can change.
    """

    camera: Camera
    image: Image
    plate: Plate
    mask: NDArray[np.bool_]
    amount: NDArray[np.float32]
    projection: Projection
    counts: NDArray[np.bool_]


class Evidence:
    """What pictures say together.

    Parameters
    ----------
    views
        At least one.
    domain
        The box.
    axis
        Where the smoke stands in depth, for one view.
    texture
        See `DepthProfile`.

    Attributes
    ----------
    views
    hull : (nx, ny, nz) bool
        Voxels that may hold smoke.
    profiles
        The smoke's depth, a view each.
    """

    def __init__(self, views: Sequence[ViewEvidence], domain: Domain, axis: SmokeAxis, texture: float) -> None:
        self.views = tuple(views)
        self._domain = domain
        self.hull = common_hull([view.mask for view in views], [view.projection for view in views])
        axes = [axis] if len(views) == 1 else [self._axis(view) for view in views]
        self.profiles = tuple(
            DepthProfile(view.amount, view.camera, domain, middle, texture)
            for view, middle in zip(views, axes, strict=True)
        )

    @cached_property
    def guess(self) -> Volume:
        """Optical depth per metre (nx, ny, nz) that is plausible: see the module."""
        hull = self.hull
        found = np.zeros(self._domain.resolution, np.float32)
        guesses = [
            view.projection.read(view.amount, hull) * profile.at(view.projection, hull)
            for view, profile in zip(self.views, self.profiles, strict=True)
        ]
        found[hull] = guesses[0] if len(guesses) == 1 else self._common(guesses)
        return found

    def _common(self, guesses: Sequence[NDArray[np.float64]]) -> NDArray[np.float64]:
        """What several profiles have in common, layer by layer as much as the most complete guess."""
        hull = self.hull
        seen = [view.projection.visible[hull] for view in self.views]
        count = np.sum(seen, axis=0)
        # a round blob's two profiles make it up, and more of them must not make it smaller
        power = np.minimum(1, 2 / count)
        # what only one shows it would fill with all that the others contradict
        least = np.where(count > 1, LEAST_SHAPE, 0)
        values = np.ones(count.shape)
        for view, profile, visible in zip(self.views, self.profiles, seen, strict=True):
            shape = np.maximum(profile.shape(view.projection, hull), least)
            values *= np.where(visible, shape**power, 1)
        layer = np.nonzero(hull)[2]
        wanted = np.max([np.bincount(layer, np.where(*pair, 0)) for pair in zip(seen, guesses, strict=True)], axis=0)
        there = np.bincount(layer, values)
        return np.asarray(values * (wanted / np.maximum(there, 1e-30))[layer])

    def _axis(self, view: ViewEvidence) -> SmokeAxis:
        """How far behind the domain's centre all pictures together put the middle of the smoke, by height."""
        _, depth, height = view_frame(view.camera)
        offset = centres_of(self.hull, self._domain) - np.array(self._domain.centre)
        if not offset.size:
            return SmokeAxis.upright()
        level = np.rint(offset @ height / self._domain.voxel_size).astype(int)
        lowest = level.min()
        level -= lowest
        shown = [other.projection.visible[self.hull] for other in self.views]
        count = np.sum(shown, axis=0)
        most = np.zeros(level.max() + 1, count.dtype)
        np.maximum.at(most, level, count)
        weight = (count == most[level]).astype(np.float64)  # those that fewer views show are known worse
        for other, visible in zip(self.views, shown, strict=True):
            weight *= np.where(visible, other.projection.read(other.amount, self.hull), 1)
        total = np.bincount(level, weight)
        known = total > 0
        if not known.any():
            return SmokeAxis.upright()
        mean = np.bincount(level, weight * (offset @ depth))[known] / total[known]
        heights = (np.nonzero(known)[0] + lowest) * self._domain.voxel_size
        return SmokeAxis(heights, mean, np.zeros(heights.shape))
