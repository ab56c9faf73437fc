"""Where the fit of a frame starts, from the depth prior's density and the one carried along from the frame before.

The carried (advected) density has structures along the rays, and optical depths that the renderer has corrected for
shadows already. `BlendCarried`, for the smooth answer, judges densities before any correction by D, the squared
difference between the input's picture and what a density renders to. It blends the carried density in by two shares:

    of the rays' optical depths, by skill against the prior:      largest (1 - D(carried) / (D(prior) + noise))
    of the density itself, by skill against persistence:          largest (1 - D(carried) / (D(before) + noise))

and never below zero. `before` is the density of the frame before, left where it was: persistence, by which the skill of
weather forecasts is measured. A wrong velocity is no better than none, and then nothing is blended in. `largest` limits
both shares (docs/experiments/temporal-prior.md), so that errors which no picture corrects, in thick smoke or in shadow,
do not grow from frame to frame.

`GuidedSimulation`, for smoke with made-up detail, is a simulation that the clip guides: the detail of the frame before
moves on with the flow, and the smooth answer of the new picture says how much smoke is where.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from smokelift.density.depth_prior import DepthEstimate
from smokelift.density.observation import ObservedView, ViewSet
from smokelift.render import Image, Volume

TINY = np.finfo(np.float32).tiny
"""Smallest normal number, for divisions and logarithms."""

MIN_DEPTH_SHARE = 1e-3
"""Share of the largest optical depth below which a logarithm means nothing."""

LARGEST_GAIN = 3.0
"""Bound of the factor that makes carried smoke denser. Where that is too little the prior's smoke is added: there smoke
has entered, or has moved otherwise than was predicted."""


MIN_NEW_DENSITY = np.float32(0.3)
"""Mean densities of the smooth answer below which nothing is taken to have entered. Faint smoke that leaves at the
support's edge would be filled up again in every frame and show as a shell (docs/experiments/level-layers.md)."""


@dataclass(frozen=True, eq=False)
class Smoke:
    """The smoke of a moment.

    `smooth` (nx, ny, nz) is the density without what the depth prior makes up; None if that is all of it.
    """

    density: Volume
    smooth: Volume | None = None


@dataclass(frozen=True, eq=False)
class Start:
    """Where the fit of a frame starts: a density (nx, ny, nz), and the figures that decided it."""

    density: Volume
    figures: Mapping[str, float]


class TemporalPrior(Protocol):
    """What is taken over from the frame before."""

    def start(self, views: ViewSet, depth: DepthEstimate, carried: Smoke, before: Smoke) -> Start:
        """Where the fit starts.

        Parameters
        ----------
        views
            The pictures of the frame.
        depth
            What the depth prior says of them.
        carried, before
            The smoke of the frame before, carried along by the predicted velocity, and as it was.
        """


@dataclass(frozen=True)
class NothingCarried:
    """Every frame starts from its own pictures."""

    def start(self, views: ViewSet, depth: DepthEstimate, carried: Smoke, before: Smoke) -> Start:
        """The depth prior's density; see `TemporalPrior`."""
        return Start(depth.density, {})


@dataclass(frozen=True)
class BlendCarried:
    """A prior that takes over as much of the carried density as proves right; see the module.

    `largest` is the largest share of it, 0 to 1.
    """

    largest: float

    def start(self, views: ViewSet, depth: DepthEstimate, carried: Smoke, before: Smoke) -> Start:
        """The prior's density, mixed with the carried one; see `TemporalPrior`.

        Its figures are ``share``, that of the density, and ``amounts``, that of the rays' optical depths, with what
        decided them: ``loss_prior``, ``loss_carried`` and ``loss_before`` (sums of squares over the input's picture,
        linear radiance).
        """
        prior, moved, view = depth.density, carried.density, views.views[0]
        if not (prior.any() and moved.any()):
            return Start(prior, {"share": 0.0, "amounts": 0.0})
        somewhere = (prior > 0) | (moved > 0) | (before.density > 0)
        renderer = views.optics.renderer(view.camera, view.background, somewhere)

        def judged(density: Volume) -> tuple[float, Image]:
            """Squared difference from the picture, and optical depths (rows, columns)."""
            difference = renderer.image(density) - view.image
            along_rays = -np.log(np.maximum(renderer.transmittance, TINY))
            return float(np.sum(np.square(difference, dtype=np.float64))), along_rays

        (loss_prior, optical_depth), (loss_carried, carried_optical_depth) = judged(prior), judged(moved)
        loss_before, _ = judged(before.density)
        noise = float(np.sum(np.square(view.noise_left, dtype=np.float64)))
        amounts = self.largest * _skill(loss_carried, loss_prior + noise)
        share = self.largest * _skill(loss_carried, loss_before + noise)
        corrected = _with_optical_depth(prior, view, optical_depth, carried_optical_depth, amounts)
        return Start(
            np.float32(1 - share) * corrected + np.float32(share) * moved,
            {
                "share": share,
                "amounts": amounts,
                "loss_prior": loss_prior,
                "loss_carried": loss_carried,
                "loss_before": loss_before,
            },
        )


@dataclass(frozen=True)
class GuidedSimulation:
    """The detail of the carried density, in the amounts of the depth prior's smooth answer.

    With B the blur over lobes (`Detail.amounts`), the smooth answer rho_s, that of the frame before carried rho_s', the
    prior's density rho_p, the carried one rho_c and a faint density f:

        start = kept rho_c b / B(rho_c) + (1 - kept b / B(rho_s)) rho_p,
        b = min(B(rho_s), LARGEST_GAIN B(rho_c)) min(1, (LARGEST_GAIN rho_s' rho_s + f^2) / (rho_s^2 + f^2))

    Detail is born where nothing is carried, at inlets above all, and moves on from there. A hole at an inlet is
    narrower than the blur, and a gap may be detail: the smooth answer, which has no gaps, tells them apart
    (docs/experiments/level-layers.md). `kept` is the share of the detail that a frame takes over: the rest is renewed
    (docs/experiments/every-view.md). `largest` is that of `BlendCarried`, which stands in where the depth prior makes
    nothing up.
    """

    largest: float
    kept: float = 0.97

    def start(self, views: ViewSet, depth: DepthEstimate, carried: Smoke, before: Smoke) -> Start:
        """The carried density in the smooth answer's amounts; see `TemporalPrior`.

        Its figure ``share`` is that of the smoke which is taken over.
        """
        if depth.detail is None or not views.hull.any():
            return BlendCarried(self.largest).start(views, depth, carried, before)
        where, detail = views.where, depth.detail
        wanted, have = (detail.amounts(values) for values in (detail.smooth, carried.density))
        reached = np.float32(self.kept) * np.minimum(wanted, np.float32(LARGEST_GAIN) * have)
        if carried.smooth is not None:
            came, smooth = (where.take(values) for values in (carried.smooth, detail.smooth))
            faint = (MIN_NEW_DENSITY * smooth.mean()) ** 2 + TINY
            reached *= np.minimum(1, (np.float32(LARGEST_GAIN) * came * smooth + faint) / (smooth**2 + faint))
        taken_over = where.take(carried.density) * reached / np.maximum(have, TINY)
        started = taken_over + (1 - reached / np.maximum(wanted, TINY)) * where.take(depth.density)
        total = float(started.sum(dtype=np.float64))
        share = float(taken_over.sum(dtype=np.float64)) / total if total > 0 else 0.0
        density = np.zeros(views.hull.shape, np.float32)
        where.put(started, density)
        return Start(density, {"share": share})


def _skill(loss: float, reference: float) -> float:
    """Share of a reference's loss that is gone; 0 where none is."""
    return max(0.0, 1 - loss / reference) if reference > 0 else 0.0


def _with_optical_depth(
    density: Volume, view: ObservedView, have: NDArray[np.float32], want: NDArray[np.float32], share: float
) -> Volume:
    """A density, its rays' optical depths (rows, columns) changed by a share towards others.

    The depths are mixed in logarithms. Where none is wanted nothing is known, because smoke may have come in.
    """
    faint = MIN_DEPTH_SHARE * want.max()
    step = share * np.log((want + faint) / (have + faint)) * want / (want + faint)
    # one pixel's blur keeps neighbouring rays from fighting over the voxels that they share
    step = ndimage.gaussian_filter(step.astype(np.float32), 0.7)
    smoky = density > 0
    changed = density.copy()
    changed[smoky] *= np.exp(view.projection.read(step, smoky))
    return changed
