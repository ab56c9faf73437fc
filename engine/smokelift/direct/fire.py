"""The fire of a clip, and how it goes on after it.

Fire is carried by the velocity of the smoke, burns out and is fed. From one moment f to the next f'

    f' = k advect(f, u') + s,

with one share k that is left of it in a step and a feed s >= 0 that stands still, since what burns does. Both come from
the clip's moments: where they have less fire on the mean than was carried there nothing feeds it, and k is what they
have of it; s is what the rest has more than k of that. So a fire whose smoke moves as in the clip keeps its mean, and
one that is blown away from its fuel burns out. Figures: docs/experiments/fire.md.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from smokelift.direct.constraint import Mask
from smokelift.direct.moment import Moment
from smokelift.transport import Array, advect


@dataclass(frozen=True, eq=False)
class Fire:
    """How fire goes on.

    Attributes
    ----------
    left
        Share of the emission that is left of it after a step, 0 to 1.
    feed : (nx, ny, nz)
        Emission that a step adds.
    """

    left: float
    feed: Array

    def after(self, carried: Array, solid: Mask | None) -> Array:
        """The emission (nx, ny, nz) after a step, from what was carried along; none in the solid."""
        emission = np.float32(self.left) * carried + self.feed
        return emission if solid is None else np.where(solid, np.float32(0), emission)


def learnt_fire(moments: Sequence[Moment], dt: float) -> Fire | None:
    """The fire of consecutive moments of a clip, `dt` seconds apart; None without any."""
    burning = [(moment.flame, moment.velocity) for moment in moments if moment.flame is not None]
    if len(burning) < len(moments):
        return None
    before = np.zeros(moments[0].density.shape, np.float32)
    after = before.copy()
    for (flame, _), (following, velocity) in pairwise(burning):
        before += advect(flame, velocity, dt, conserve=True)
        after += following
    unfed = after < before
    left = float(after[unfed].sum(dtype=np.float64) / before[unfed].sum(dtype=np.float64)) if unfed.any() else 1.0
    feed = np.maximum(after - np.float32(left) * before, 0)
    # what is left out as less than nothing would make the fire grow
    lasting = (after.sum(dtype=np.float64) - left * before.sum(dtype=np.float64)) / max(
        feed.sum(dtype=np.float64), 1e-30
    )
    return Fire(left, feed * np.float32(lasting / (len(moments) - 1)))
