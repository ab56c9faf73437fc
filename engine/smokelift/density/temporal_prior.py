"""Where the fit of a frame starts, from the depth prior's density and the one carried along from the frame before.

The carried (advected) density has structures along the rays, and optical depths that the renderer has corrected for
shadows already. `BlendCarried`, for the smooth answer, blends in a constant share of it. Of an error that no picture
corrects, in thick smoke, in shadow or of the velocity, a frame takes over no more than that share, so none grows from
frame to frame (docs/experiments/temporal-prior.md).

`GuidedSimulation`, for smoke with made-up detail, is a simulation that the clip guides: the detail of the frame before
moves on with the flow, and the smooth answer of the new picture says how much smoke is where. A velocity of its own,
which nothing guides along the rays, makes more lobes there and worse jets (docs/experiments/wander.md).
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from smokelift.density.depth_prior import DepthEstimate
from smokelift.density.levels import TINY
from smokelift.density.observation import ViewSet
from smokelift.render import Volume

LARGEST_GAIN = 3.0
"""Bound of the factor that makes carried smoke denser. Where that is too little the prior's smoke is added: there smoke
has entered, or has moved otherwise than was predicted."""


MIN_NEW_DENSITY = np.float32(0.3)
"""Mean densities of the smooth answer below which nothing is taken to have entered. Faint smoke that leaves at the
support's edge would be filled up again in every frame and show as a shell (docs/experiments/every-view.md)."""


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

    def start(self, views: ViewSet, depth: DepthEstimate, carried: Smoke) -> Start:
        """Where the fit starts.

        Parameters
        ----------
        views
            The pictures of the frame.
        depth
            What the depth prior says of them.
        carried
            The smoke of the frame before, carried along by the predicted velocity.
        """


@dataclass(frozen=True)
class NothingCarried:
    """Every frame starts from its own pictures."""

    def start(self, views: ViewSet, depth: DepthEstimate, carried: Smoke) -> Start:
        """The depth prior's density; see `TemporalPrior`."""
        return Start(depth.density, {})


@dataclass(frozen=True)
class BlendCarried:
    """A prior that takes over a constant share, 0 to 1, of the carried density; see the module."""

    share: float

    def start(self, views: ViewSet, depth: DepthEstimate, carried: Smoke) -> Start:
        """The prior's density, mixed with the carried one; see `TemporalPrior`."""
        prior, moved = depth.density, carried.density
        share = self.share if prior.any() and moved.any() else 0.0
        return Start(np.float32(1 - share) * prior + np.float32(share) * moved, {"share": share})


@dataclass(frozen=True)
class GuidedSimulation:
    """The detail of the carried density, with the low pass of the depth prior's smooth answer.

    With B the blur over lobes (`Detail.low_pass`), the smooth answer rho_s, that of the frame before carried rho_s',
    the prior's density rho_p, the carried one rho_c and a faint density f:

        start = kept rho_c b / B(rho_c) + (1 - kept b / B(rho_s)) rho_p,
        b = min(B(rho_s), LARGEST_GAIN B(rho_c)) min(1, (LARGEST_GAIN rho_s' rho_s + f^2) / (rho_s^2 + f^2))

    Detail is born where nothing is carried, at inlets above all, and moves on from there. A hole at an inlet is
    narrower than the blur, and a gap may be detail: the smooth answer, which has no gaps, tells them apart
    (docs/experiments/every-view.md). `kept` is the share of the detail that a frame takes over: the rest is renewed
    (docs/experiments/every-view.md). `share` is that of `BlendCarried`, which stands in where the depth prior makes
    nothing up.
    """

    share: float
    kept: float = 0.97

    def start(self, views: ViewSet, depth: DepthEstimate, carried: Smoke) -> Start:
        """The carried density with the smooth answer's low pass; see `TemporalPrior`.

        Its figure ``share`` is that of the smoke which is taken over.
        """
        if depth.detail is None or not views.hull.any():
            return BlendCarried(self.share).start(views, depth, carried)
        where, detail = views.where, depth.detail
        wanted, have = (detail.low_pass(values) for values in (detail.smooth, carried.density))
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
