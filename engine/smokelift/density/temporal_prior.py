"""Where the fit of a frame starts, from the depth prior's density and the one carried along from the frame before.

The carried (advected) density has structures along the rays, and optical depths that the renderer has corrected for
shadows already. Made-up detail of the frame before moves on with the flow, and the smooth density of the new picture
says how much smoke is where. A velocity of its own, which nothing guides along the rays, makes more lobes there and
worse jets (docs/experiments/wander.md).

Of smoke without such detail a constant fraction is blended in. Of an error that no picture corrects, in thick smoke, in
shadow or of the velocity, a frame takes over no more than that fraction, so none grows from frame to frame
(docs/experiments/temporal-prior.md).
"""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from smokelift.density.depth_prior import DepthEstimate
from smokelift.density.objective import TINY
from smokelift.render import Volume

MAX_ADVECTED_GAIN = 1.5
"""Bound of the factor that makes a carried smooth density denser. Where that is too little the prior's smoke is added:
there smoke has entered, or has moved otherwise than was predicted (docs/experiments/every-view.md)."""

RETENTION = 0.97
"""Fraction of the detail that a frame takes over: the rest is renewed (docs/experiments/every-view.md)."""


@dataclass(frozen=True, eq=False)
class Start:
    """Where the fit of a frame starts: a density (nx, ny, nz), and the figures that decided it."""

    density: Volume
    figures: Mapping[str, float]


class TemporalPrior(Protocol):
    """What is taken over from the frame before."""

    def start(self, depth: DepthEstimate, carried: Volume, smooth: Volume) -> Start:
        """Where the fit starts.

        Parameters
        ----------
        depth
            What the depth prior says of the frame's pictures.
        carried : (nx, ny, nz)
            The density of the frame before, carried along by the predicted velocity.
        smooth : (nx, ny, nz)
            Its smooth density, carried alike; the same as ``carried`` if nothing was made up.
        """


@dataclass(frozen=True)
class NothingCarried:
    """Every frame starts from its own pictures."""

    def start(self, depth: DepthEstimate, carried: Volume, smooth: Volume) -> Start:
        """The depth prior's density; see `TemporalPrior`."""
        return Start(depth.density, {})


@dataclass(frozen=True)
class AdvectedDetail:
    """The detail of the carried density, with the low pass of the depth prior's smooth density.

    With B the blur over lobes (`Detail.low_pass`), the smooth density rho_s, the prior's density rho_p, the carried one
    rho_c and its smooth density sigma_c:

        start = r rho_c B(k rho_s) / B(rho_c) + (1 - r k) rho_p,   k = min(1, MAX_ADVECTED_GAIN sigma_c / rho_s)

    Detail is born where nothing is carried, at inlets above all, and moves on from there; r is `RETENTION`. k is taken
    voxel by voxel: entering smoke is thinner than a lobe, and blurred would look carried. Where the depth prior makes
    nothing up, the start is (1 - blend) rho_p + blend rho_c.
    """

    blend: float

    def start(self, depth: DepthEstimate, carried: Volume, smooth: Volume) -> Start:
        """The carried density with the smooth density's low pass; see `TemporalPrior`.

        Its figure ``share`` is the carried fraction of the mass.
        """
        prior, detail, views = depth.density, depth.detail, depth.views
        where = views.where
        if detail is None or not where.count:
            blend = self.blend if prior.any() and carried.any() else 0.0
            return Start(np.float32(1 - blend) * prior + np.float32(blend) * carried, {"share": blend})
        base, advected_base = where.take(detail.smooth_density), where.take(smooth)
        advected_base *= np.float32(MAX_ADVECTED_GAIN)
        np.minimum(advected_base, base, out=advected_base)
        target_low_pass = np.float32(RETENTION) * detail.low_pass(views.volume(advected_base))
        taken_over = where.take(carried) * target_low_pass / np.maximum(detail.low_pass(carried), TINY)
        renewed = 1 - np.float32(RETENTION) * advected_base / np.maximum(base, TINY)
        started = taken_over + renewed * where.take(prior)
        total = float(started.sum(dtype=np.float64))
        fraction = float(taken_over.sum(dtype=np.float64)) / total if total > 0 else 0.0
        return Start(views.volume(started), {"share": fraction})
