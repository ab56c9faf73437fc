"""Where the fit of a frame starts, from the depth prior's density and the one carried along from the frame before.

The carried density knows amounts that the renderer has corrected for shadows already, and structures along the rays.
`BlendCarried`, the default, judges it before any correction by E, the squared difference between the input's picture
and what a density renders to:

    amounts  as far as carried beats the prior's:          AMOUNTS  (1 - E(carried) / (E(prior) + noise))
    depth    as far as its motion has been understood:     largest  (1 - E(carried) / (E(before) + noise))

and never below zero. `before` is the density of the frame before, left where it was: persistence, by which the skill of
weather forecasts is measured. A wrong velocity is no better than none, and then nothing is taken over. The share of the
depth falls as well where carried's depth anisotropy is less like smoke's than the prior's, because wrong velocities
draw smoke out or crumple it.

Amounts are mixed in logarithms and by a third at most: what no picture corrects, in thick smoke or in shadow, would
grow from frame to frame without bound.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from smokelift.density.anisotropy import depth_anisotropy
from smokelift.density.depth_prior import DepthEstimate
from smokelift.density.observation import View, ViewSet
from smokelift.density.screen import view_frame
from smokelift.render import Image, Volume

AMOUNTS = 0.35
"""Largest share of carried's amounts (docs/experiments/temporal-prior.md)."""

LARGEST_CHANGE = 3.0
"""Factor by which a ray's amount may change, either way."""

FAINT = 0.02
"""Optical depth, beside the largest, below which carried says nothing about amounts."""

UNLIKE_SMOKE = 0.3
"""Departure of the depth anisotropy from 1 that true smoke does not reach (docs/experiments/temporal-prior.md)."""

WORST = 1.5
"""Departure of carried's depth anisotropy from 1, in the prior's, from which nothing is taken over. Up to 1 all is; a
threshold instead would make smoke flicker."""


@dataclass(frozen=True, eq=False)
class Start:
    """Where the fit of a frame starts.

    Attributes
    ----------
    density : (nx, ny, nz) float32
    figures
        What decided it, by name.
    """

    density: Volume
    figures: Mapping[str, float]


class TemporalPrior(Protocol):
    """What is taken over from the frame before."""

    def start(self, views: ViewSet, depth: DepthEstimate, carried: Volume, before: Volume) -> Start:
        """Where the fit starts.

        Parameters
        ----------
        views
            The pictures of the frame.
        depth
            What the depth prior says of them.
        carried, before : (nx, ny, nz)
            The density of the frame before, carried along by the predicted velocity, and as it was.
        """


@dataclass(frozen=True)
class NothingCarried:
    """Every frame starts from its own pictures."""

    def start(self, views: ViewSet, depth: DepthEstimate, carried: Volume, before: Volume) -> Start:
        """The depth prior's density; see `TemporalPrior`."""
        return Start(depth.density, {})


@dataclass(frozen=True)
class BlendCarried:
    """As much of the carried density as proves right; see the module.

    Attributes
    ----------
    largest
        Largest share of the carried density, 0 to 1.
    """

    largest: float

    def start(self, views: ViewSet, depth: DepthEstimate, carried: Volume, before: Volume) -> Start:
        """The prior's density, mixed with the carried one; see `TemporalPrior`.

        Its figures are ``share`` of the density that was carried along and ``amounts``, the share of its amounts, with
        what decided them: ``loss_prior``, ``loss_carried`` and ``loss_before`` (sums of squares over the input's
        picture, linear radiance), ``anisotropy_prior`` and ``anisotropy_carried``.
        """
        prior, view = depth.density, views.views[0]
        if not (prior.any() and carried.any()):
            return Start(prior, {"share": 0.0, "amounts": 0.0})
        somewhere = (prior > 0) | (carried > 0) | (before > 0)
        renderer = views.optics.renderer(view.camera, view.plate.image, somewhere)

        def judged(density: Volume) -> tuple[float, Image]:
            """Squared difference from the picture, and optical depths (rows, columns)."""
            difference = renderer.image(density) - view.image
            along_rays = -np.log(np.maximum(renderer.transmittance, np.finfo(np.float32).tiny))
            return float(np.sum(np.square(difference, dtype=np.float64))), along_rays

        (loss_prior, depth_prior), (loss_carried, depth_carried) = judged(prior), judged(carried)
        loss_before, _ = judged(before)
        noise = float(np.sum(np.square(view.noise, dtype=np.float64)))
        along = int(np.argmax(np.abs(view_frame(view.camera)[1])))
        anisotropy_prior, anisotropy_carried = (depth_anisotropy(each, along) for each in (prior, carried))
        amounts = AMOUNTS * _better(loss_carried, loss_prior + noise)
        unlike = _departure(anisotropy_carried) / _departure(anisotropy_prior)
        like_smoke = float(np.clip((WORST - unlike) / (WORST - 1), 0, 1))
        share = self.largest * _better(loss_carried, loss_before + noise) * like_smoke
        corrected = _with_amounts(prior, view, depth_prior, depth_carried, amounts)
        return Start(
            np.float32(1 - share) * corrected + np.float32(share) * carried,
            {
                "share": share,
                "amounts": amounts,
                "loss_prior": loss_prior,
                "loss_carried": loss_carried,
                "loss_before": loss_before,
                "anisotropy_prior": anisotropy_prior,
                "anisotropy_carried": anisotropy_carried,
            },
        )


def _better(loss: float, other: float) -> float:
    """By what part of another loss this one is lower; 0 where it is not."""
    return max(0.0, 1 - loss / other) if other > 0 else 0.0


def _departure(anisotropy: float) -> float:
    """From 1, beyond what is usual; what changes along the rays only (a picture full of even fog) has no end."""
    return float(np.clip(abs(anisotropy - 1), UNLIKE_SMOKE, 100.0))


def _with_amounts(
    density: Volume, view: View, have: NDArray[np.float32], want: NDArray[np.float32], share: float
) -> Volume:
    """A density, its rays changed from the optical depths (rows, columns) that they have towards others."""
    faint = FAINT * want.max()
    change = np.log(np.clip((want + faint) / (have + faint), 1 / LARGEST_CHANGE, LARGEST_CHANGE))
    # where carried has nothing it knows of nothing: smoke may have come in
    step = share * change * want / (want + faint)
    # one pixel's blur keeps neighbouring rays from fighting over the voxels that they share
    step = ndimage.gaussian_filter(step.astype(np.float32), 0.7)
    smoky = density > 0
    changed = density.copy()
    changed[smoky] *= np.exp(view.projection.read(step, smoky))
    return changed
