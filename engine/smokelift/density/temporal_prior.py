"""Where the fit of a frame starts, from the depth prior's density and the one carried along from the frame before.

The carried (advected) density knows optical depths that the renderer has corrected for shadows already, and structures
along the rays. `BlendCarried`, the default, judges it before any correction by D, the squared difference between the
input's picture and what a density renders to. It blends in two shares:

    of the rays' optical depths, by skill against the prior:      largest (1 - D(carried) / (D(prior) + noise))
    of the density itself, by skill against persistence:          largest (1 - D(carried) / (D(before) + noise))

and never below zero. `before` is the density of the frame before, left where it was: persistence, by which the skill of
weather forecasts is measured. A wrong velocity is no better than none, and then nothing is blended in. `largest` limits
both (docs/experiments/temporal-prior.md), so that errors which no picture corrects, in thick smoke or in shadow, do not
grow from frame to frame.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from smokelift.density.depth_prior import DepthEstimate
from smokelift.density.observation import View, ViewSet
from smokelift.render import Image, Volume

FAINT = 1e-3
"""Optical depth, as a fraction of the largest, below which its logarithm means nothing."""


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

        Its figures are ``share`` of the density and ``amounts``, the share of the rays' optical depths, with
        what decided them: ``loss_prior``, ``loss_carried`` and ``loss_before`` (sums of squares over the input's
        picture, linear radiance).
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

        (loss_prior, optical_depth), (loss_carried, carried_optical_depth) = judged(prior), judged(carried)
        loss_before, _ = judged(before)
        noise = float(np.sum(np.square(view.noise, dtype=np.float64)))
        amounts = self.largest * _skill(loss_carried, loss_prior + noise)
        share = self.largest * _skill(loss_carried, loss_before + noise)
        corrected = _with_optical_depth(prior, view, optical_depth, carried_optical_depth, amounts)
        return Start(
            np.float32(1 - share) * corrected + np.float32(share) * carried,
            {
                "share": share,
                "amounts": amounts,
                "loss_prior": loss_prior,
                "loss_carried": loss_carried,
                "loss_before": loss_before,
            },
        )


def _skill(loss: float, reference: float) -> float:
    """Share of a reference's loss that is gone; 0 where none is."""
    return max(0.0, 1 - loss / reference) if reference > 0 else 0.0


def _with_optical_depth(
    density: Volume, view: View, have: NDArray[np.float32], want: NDArray[np.float32], share: float
) -> Volume:
    """A density, its rays changed from the optical depths (rows, columns) that they have towards others.

    They are mixed in logarithms. Where none is wanted nothing is known, because smoke may have come in.
    """
    faint = FAINT * want.max()
    step = share * np.log((want + faint) / (have + faint)) * want / (want + faint)
    # one pixel's blur keeps neighbouring rays from fighting over the voxels that they share
    step = ndimage.gaussian_filter(step.astype(np.float32), 0.7)
    smoky = density > 0
    changed = density.copy()
    changed[smoky] *= np.exp(view.projection.read(step, smoky))
    return changed
