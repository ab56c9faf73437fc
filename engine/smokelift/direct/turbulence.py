"""Turbulence: eddies without divergence that the air has at random, beside what moves it already.

Curl noise (Bridson et al. 2007), of random Fourier modes (Kraichnan 1970) in place of a lattice of noise: the curl of a
wave is a wave that swings across its own direction. A sum of waves is known at any place, on any grid.

An estimated velocity lacks small eddies (`with_small_eddies`). Smoke that is carried by a smooth velocity is drawn out
into sheets. True smoke has as much motion in each octave of sizes below a tenth of its width
(docs/experiments/continuation.md); estimates lack the fine ones by a factor of ten. What is missing is added once,
where the smoke is, and moves on by itself.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from typing import NamedTuple

import numpy as np
from scipy import ndimage

from smokelift.checks.array_types import Doubles
from smokelift.direct.state import SmokeState
from smokelift.transport import Array, Velocity, at_centres, on_faces, project

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
        Across an eddy, in meters, above 0.
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


class _Octave(NamedTuple):
    """Motion that an average over some voxels leaves out and a narrower one does not, and eddies of its size."""

    average: int
    eddy: float


SIZES = (_Octave(3, 2.2), _Octave(7, 4.0), _Octave(13, 8.0), _Octave(27, 16.0))
"""Voxels, from the finest to the one that estimates show."""

IN_SMOKE = np.float32(0.05)
"""Fraction of the largest density above which a voxel is in the smoke."""

EDGE = 5
"""Voxels over which the eddies end beside the smoke."""


def with_small_eddies(state: SmokeState) -> SmokeState:
    """A state with the eddies that it lacks; as it is in a box that is too narrow to show any, or without smoke."""
    smoke, velocity = state.density > IN_SMOKE * state.density.max(), state.velocity
    if min(smoke.shape) < SIZES[-1].average or not smoke.any():
        return state
    found, wider = np.zeros(len(SIZES)), at_centres(velocity.faces)
    for number, octave in enumerate(SIZES):
        averaged = [ndimage.uniform_filter(component, octave.average) for component in wider]
        parts = [np.mean(np.square((u - mean)[smoke])) for u, mean in zip(wider, averaged, strict=True)]
        found[number], wider = float(np.sum(parts)), (averaged[0], averaged[1], averaged[2])
    near = ndimage.uniform_filter(smoke.astype(np.float32), EDGE)
    weights = on_faces(np.repeat(near[..., None], 3, axis=-1))
    faces = list(velocity.faces)
    for seed, (octave, square) in enumerate(zip(SIZES[:-1], found[:-1], strict=True)):
        speed = float(max(0.0, found[-1] - square)) ** 0.5
        eddies = Turbulence(speed, octave.eddy * velocity.voxel_size, seed).velocity(velocity, 0.0)
        faces = [u + weight * eddy for u, weight, eddy in zip(faces, weights, eddies, strict=True)]
    return replace(state, velocity=project(velocity.with_faces(faces)))
