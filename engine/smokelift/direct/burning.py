"""The fire of a clip, and how it goes on after it.

Fire is carried by the velocity of the smoke, burns out and is fed. From one frame f to the next f'

    f' = k advect(f, u') + s,

with one fraction k that is left of it in a step and a feed s >= 0 that stands still, since what burns does. Both come
from the clip's frames: where they have less fire on the mean than was carried there nothing feeds it, and k is what
they have of it; s is what the rest has more than k of that. So a fire whose smoke moves as in the clip keeps its mean,
and one that is blown away from its fuel burns out. Figures: docs/experiments/fire.md.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from smokelift.checks import Mask
from smokelift.direct.state import SmokeState
from smokelift.transport import Array, advect


@dataclass(frozen=True, eq=False)
class Combustion:
    """How fire goes on."""

    remaining: float
    """Fraction of the emission that is left of it after a step, 0 to 1."""
    feed: Array
    """(nx, ny, nz): emission that a step adds."""

    def after(self, advected: Array, solid: Mask | None) -> Array:
        """The emission (nx, ny, nz) after a step, from the advected one; zero in obstacles."""
        emission = np.float32(self.remaining) * advected + self.feed
        return emission if solid is None else np.where(solid, np.float32(0), emission)


def fit_fire(states: Sequence[SmokeState], dt: float) -> Combustion | None:
    """Fit the fire of consecutive states of a clip, `dt` seconds apart; None where they show none."""
    burning = [(state.flame, state.velocity) for state in states if state.flame is not None]
    if len(burning) < len(states):
        return None
    advected = np.zeros(states[0].density.shape, np.float32)
    found = advected.copy()
    for (flame, _), (following, velocity) in pairwise(burning):
        advected += advect(flame, velocity, dt, conserve=True)
        found += following
    unfed = found < advected
    remaining = 1.0
    if unfed.any():
        remaining = float(found[unfed].sum(dtype=np.float64) / advected[unfed].sum(dtype=np.float64))
    feed = np.maximum(found - np.float32(remaining) * advected, 0)
    # The feed is clipped at zero. Scaled to the sum before the clipping it does not make the fire grow.
    net = found.sum(dtype=np.float64) - remaining * advected.sum(dtype=np.float64)
    scale = net / max(feed.sum(dtype=np.float64), 1e-30)
    return Combustion(remaining, feed * np.float32(scale / (len(states) - 1)))
