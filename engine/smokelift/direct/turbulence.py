"""Turbulence: eddies without divergence that the air has at random, beside what moves it already.

Curl noise (Bridson et al. 2007), of random Fourier modes (Kraichnan 1970) in place of a lattice of noise: the curl of a
wave is a wave that swings across its own direction. A sum of waves is known at any place, on any grid.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np

from smokelift.checks.array_types import Doubles
from smokelift.transport import Array, Velocity

MODES = 64
"""Waves in the sum: enough that it shows no pattern."""

OCTAVES = 1.0
"""Over which the sizes of the waves are spread, about that asked for. The flow makes smaller eddies by itself."""


class _Modes(NamedTuple):
    """Waves ``across cos(number . x + phase + rate t)``: vectors (MODES, 3) in 1/m and 1, and (MODES,) in 1/s."""

    number: Doubles
    across: Doubles
    phase: Doubles
    rate: Doubles


@dataclass(frozen=True)
class Turbulence:
    """Eddies everywhere, which change in the time that air takes to cross them.

    Attributes
    ----------
    speed
        Of the air in the eddies, in m/s, root mean square.
    size
        Across an eddy, in metres, above 0.
    seed
        Another one makes other eddies, from 0.
    """

    speed: float
    size: float
    seed: int = 0

    def velocity(self, like: Velocity, time: float, first: tuple[int, ...] = (0, 0, 0)) -> list[Array]:
        """The velocity in m/s on the faces of a grid that begins at a voxel, at a time in seconds."""
        modes = self._modes
        turned = self.speed * np.sqrt(2 / MODES) * np.exp(1j * (modes.phase + modes.rate * time))
        faces = []
        for axis, component in enumerate(like.faces):
            places = (first[d] + np.arange(n) + (0.0 if d == axis else 0.5) for d, n in enumerate(component.shape))
            x, y, z = (
                np.exp(1j * np.outer(along, like.voxel_size * place))
                for along, place in zip(modes.number.T, places, strict=True)
            )
            layers = (modes.across[:, axis] * turned)[:, None, None] * x[:, :, None] * y[:, None, :]
            waves = np.tensordot(layers.astype(np.complex64), z.astype(np.complex64), axes=(0, 0))
            faces.append(np.ascontiguousarray(waves.real))
        return faces

    @cached_property
    def _modes(self) -> _Modes:
        random = np.random.default_rng(self.seed)
        along, other = (random.standard_normal((MODES, 3)) for _ in range(2))
        along /= np.linalg.norm(along, axis=1, keepdims=True)
        across = np.cross(along, other)
        across /= np.linalg.norm(across, axis=1, keepdims=True)
        halves = 2 ** (OCTAVES * (random.random(MODES) - 0.5))  # a wave holds two eddies
        return _Modes(
            along * (np.pi / self.size * halves)[:, None],
            across,
            2 * np.pi * random.random(MODES),
            self.speed / self.size * random.standard_normal(MODES),
        )
