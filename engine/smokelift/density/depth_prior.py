"""What is assumed of the smoke's depth, which one picture leaves undetermined.

`RoundDepth` takes the smoke to be as deep as it is wide. Its density is smooth; the default, `DetailedDepth`, gives it
detail (`synthesis`). It spreads the smoke of one picture about an axis that comes from the whole clip: first as
much as explains the picture without shadows, then as much as explains it in the shadows that this casts. With several
pictures the density is the product of their depth profiles, scaled in each horizontal layer to the optical depth of the
view that shows most there. This density need not look like any picture: the multiplicative fit scales it ray by ray and
keeps only how the smoke of one ray relates to that of another.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from smokelift.density.hull import Places, project_voxels
from smokelift.density.lattice_noise import Scatter, Wander
from smokelift.density.objective import any_of_two, with_neighbors
from smokelift.density.observation import ObservedClip, ObservedView, ViewSet, shadowed_optical_depth
from smokelift.density.profile import PROFILE_CUT, DepthProfile
from smokelift.density.upright_plane import SmokeAxis, view_frame
from smokelift.render import Volume
from smokelift.scene import SHADOWED
from smokelift.scene.domain import box_around

MIN_SHAPE = 0.05
"""Smallest fraction of its peak that a profile has inside the hull of several views, as another view may see smoke
there (docs/experiments/density-profile.md)."""


class Detail(Protocol):
    """Detail that no camera shows, made up.

    `smooth_density` (nx, ny, nz) is the density without it, which shows about what the pictures do.
    """

    @property
    def smooth_density(self) -> Volume: ...

    def added(self, density: Volume, *, fresh: bool) -> Volume:
        """Add detail to a density (nx, ny, nz), zero outside the hull, as far as the cameras' pictures allow.

        ``fresh`` says that nothing of the density is carried on from the frame before.
        """

    def low_pass(self, density: Volume) -> NDArray[np.float32]:
        """What the smooth density decides of a density: its blur over lobes, (n,) at the voxels that may hold smoke."""


@dataclass(frozen=True, eq=False)
class DepthEstimate:
    """What a prior says of one moment."""

    density: Volume
    """(nx, ny, nz) float32: a plausible density that shows about what the pictures do; where a fit starts."""
    inside_fraction: tuple[NDArray[np.float32], ...]
    """tuple of (rows, columns): for each view, the fraction of every ray's smoke that lies inside the domain."""
    views: ViewSet
    """The pictures to fit, against the voxels where the prior expects smoke."""
    detail: Detail | None = None
    """None if the prior makes nothing up."""


class DepthPrior(Protocol):
    """What is assumed of the smoke's depth."""

    def of_clip(self, clip: ObservedClip) -> DepthPrior:
        """The prior for a clip, after any of its frames were seen; itself if it needs none."""

    def estimate(self, views: ViewSet) -> DepthEstimate:
        """What it says of one moment."""


@dataclass(frozen=True, eq=False)
class RoundDepth:
    """Smoke that is as deep as it is wide; see the module.

    The smoke of one view stands on `axis`, by default on the clip's, else in the middle of the domain, and may `wander`
    about it. Several views show where it stands.
    """

    axis: SmokeAxis | None = None
    wander: Wander | None = None

    def of_clip(self, clip: ObservedClip) -> RoundDepth:
        """Take the axis that the clip's smoke was found to have, unless one is given."""
        return self if self.axis is not None or clip.place is None else replace(self, axis=clip.place.axis)

    def estimate(self, views: ViewSet) -> DepthEstimate:
        """Spread the pictures' smoke by the profiles; one picture before darkness is explained in its own shadows."""
        scatter = None
        if len(views.views) == 1:
            (view,) = views.views
            if self.wander is not None:
                scatter = self.wander.scatter(view.camera, views.optics.domain, views.frame)
            shadowed = views.optics.scattering in SHADOWED and views.hull.any()
            if shadowed and view.against_darkness(views.optics.unshadowed_source()):
                views = replace(views, views=(self._in_its_shadows(view, views, scatter),))
        profiles = self._profiles(views, scatter)
        expected = replace(views, hull=_expected(views, profiles))
        return DepthEstimate(_density(expected, profiles), tuple(p.fraction_inside() for p in profiles), expected)

    def _in_its_shadows(self, view: ObservedView, views: ViewSet, scatter: Scatter | None) -> ObservedView:
        """The only view, with the optical depth that explains it in the shadows of the smoke that it shows."""
        optics = replace(views.optics, domain=views.optics.domain.coarser(2))  # shadows need no single voxels
        coarse = replace(view, projection=project_voxels(view.camera, optics.domain))
        seen = ViewSet((coarse,), any_of_two(views.hull), optics, views.frame)
        density = _density(seen, self._profiles(seen, scatter))
        renderer = optics.renderer(view.camera, view.background, density > 0)
        image = renderer.image(density)
        return replace(view, optical_depth=shadowed_optical_depth(view, image, renderer.transmittance, optics))

    def _profiles(self, views: ViewSet, scatter: Scatter | None) -> list[DepthProfile]:
        """How each view's smoke is spread in depth."""
        one = self.axis or SmokeAxis.upright()
        axes = [one] if len(views.views) == 1 else [_common_axis(view, views) for view in views.views]
        return [
            DepthProfile(view.optical_depth, view.camera, views.optics.domain, axis, scatter)
            for view, axis in zip(views.views, axes, strict=True)
        ]


def _expected(views: ViewSet, profiles: Sequence[DepthProfile]) -> NDArray[np.bool_]:
    """Voxels (nx, ny, nz) of the hull where any profile expects smoke, and their neighbors.

    A profile decides along each ray by itself, so that a thin veil beside thick smoke stays.
    """
    hull = views.hull
    found = np.zeros(np.count_nonzero(hull), np.bool_)
    for view, profile in zip(views.views, profiles, strict=True):
        places = view.projection.places(hull)
        found |= places.visible & (profile.shape(places, hull) > PROFILE_CUT)
    expected = np.zeros(hull.shape, np.bool_)
    expected[hull] = found
    box = box_around(hull, 1)
    expected[box] = with_neighbors(expected[box]) & hull[box]
    return expected


def _density(views: ViewSet, profiles: Sequence[DepthProfile]) -> Volume:
    """A density (nx, ny, nz) that has the profiles' shape and the pictures' amounts."""
    hull = views.hull
    seen_at = [view.projection.places(hull) for view in views.views]
    single = [
        places.read(view.optical_depth) * profile.at(places, hull)
        for view, places, profile in zip(views.views, seen_at, profiles, strict=True)
    ]
    spread = single[0] if len(single) == 1 else _common(views, profiles, seen_at, single)
    spread /= np.float32(views.optics.medium.extinction)
    return views.volume(spread)


def _common(
    views: ViewSet,
    profiles: Sequence[DepthProfile],
    seen_at: Sequence[Places],
    single: Sequence[NDArray[np.float32]],
) -> NDArray[np.float64]:
    """What several profiles have in common (n,), layer by layer as much as the view that shows most."""
    hull = views.hull
    seen = [places.visible for places in seen_at]
    count = np.sum(seen, axis=0)
    # a round blob's two profiles make it up, and more of them must not make it smaller
    power = np.minimum(1, 2 / count)
    # without the condition, voxels that only one shows would fill with all that the others contradict
    least = np.where(count > 1, MIN_SHAPE, 0)
    values = np.ones(count.shape)
    for places, profile in zip(seen_at, profiles, strict=True):
        shape = np.maximum(profile.shape(places, hull), least)
        values *= np.where(places.visible, shape**power, 1)
    layer = np.nonzero(hull)[2]
    wanted = np.max([np.bincount(layer, np.where(*pair, 0)) for pair in zip(seen, single, strict=True)], axis=0)
    there = np.bincount(layer, values)
    return np.asarray(values * (wanted / np.maximum(there, 1e-30))[layer])


def _common_axis(view: ObservedView, views: ViewSet) -> SmokeAxis:
    """How far behind the domain's center all pictures together put the middle of the smoke, by height in one view."""
    domain, hull = views.optics.domain, views.hull
    _, depth, height = view_frame(view.camera)
    places = domain.offsets(domain.centre)
    offset = np.stack([np.broadcast_to(place, hull.shape)[hull] for place in places], -1)
    if not offset.size:
        return SmokeAxis.upright()
    level = np.rint(offset @ height / domain.voxel_size).astype(int)
    lowest = level.min()
    level -= lowest
    shown = [other.projection.visible[hull] for other in views.views]
    count = np.sum(shown, axis=0)
    most = np.zeros(level.max() + 1, count.dtype)
    np.maximum.at(most, level, count)
    weight = (count == most[level]).astype(np.float64)  # those that fewer views show are known worse
    for other, visible in zip(views.views, shown, strict=True):
        weight *= np.where(visible, other.projection.places(hull).read(other.optical_depth), 1)
    total = np.bincount(level, weight)
    known = total > 0
    if not known.any():
        return SmokeAxis.upright()
    mean = np.bincount(level, weight * (offset @ depth))[known] / total[known]
    heights = (np.nonzero(known)[0] + lowest) * domain.voxel_size
    return SmokeAxis.by_height(heights, mean)
