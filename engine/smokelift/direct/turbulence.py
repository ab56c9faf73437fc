"""Turbulence: eddies without divergence that the air has at random, and those that smoke keeps by itself.

Curl noise (Bridson et al. 2007), of random Fourier modes (Kraichnan 1970) in place of a lattice of noise: the curl of a
wave is a wave that swings across its own direction. A sum of waves is known at any place, on any grid.

True smoke has as much motion in each octave of sizes below a tenth of its width, about a seventh of its speed
(docs/experiments/continuation.md). An estimated velocity lacks it, and smoke that a smooth velocity carries is drawn
out into sheets and threads. `with_small_eddies` makes up what is missing, and what interpolation takes away in every
step: random motion, new in each (stochastic backscatter: Mason and Thomson 1992). To make the eddies that are there
faster would keep their directions, in which the smooth velocity has drawn them out.
"""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy import ndimage

from smokelift.checks import Doubles
from smokelift.direct.state import SmokeState
from smokelift.transport import Array, Velocity, at_centres, on_faces

MODES = 64
"""Waves in the sum: enough that it shows no pattern."""

OCTAVES = 1.0
"""Octaves over which the sizes of the waves are spread, about that asked for. The flow makes smaller eddies by
itself."""


@dataclass(frozen=True)
class Turbulence:
    """Eddies everywhere, which change in the time that air takes to cross them."""

    speed: float
    """Of the air in the eddies, in m/s, root mean square."""
    size: float
    """Across an eddy, in meters, above 0."""
    seed: int = 0
    """Another one makes other eddies, from 0."""

    def velocity(self, like: Velocity, time: float, first: tuple[int, ...] = (0, 0, 0)) -> list[Array]:
        """The velocity in m/s on the faces of a grid that begins at a voxel, at a time in seconds."""
        numbers, across, phase, rate = self._modes
        turned = self.speed * np.sqrt(2 / MODES) * np.exp(1j * (phase + rate * time))
        faces = []
        for axis, component in enumerate(like.faces):
            places = (first[d] + np.arange(n) + (0.0 if d == axis else 0.5) for d, n in enumerate(component.shape))
            x, y, z = (
                np.exp(1j * np.outer(along, like.voxel_size * place))
                for along, place in zip(numbers.T, places, strict=True)
            )
            layers = (across[:, axis] * turned)[:, None, None] * x[:, :, None] * y[:, None, :]
            waves = np.tensordot(layers.astype(np.complex64), z.astype(np.complex64), axes=(0, 0))
            faces.append(np.ascontiguousarray(waves.real))
        return faces

    @cached_property
    def _modes(self) -> tuple[Doubles, Doubles, Doubles, Doubles]:
        """Waves across cos(number . x + phase + rate t): numbers (MODES, 3) in 1/m, across (MODES, 3), phase, rate."""
        random = np.random.default_rng(self.seed)
        along, other = (random.standard_normal((MODES, 3)) for _ in range(2))
        along /= np.linalg.norm(along, axis=1, keepdims=True)
        across = np.cross(along, other)
        across /= np.linalg.norm(across, axis=1, keepdims=True)
        halves = 2 ** (OCTAVES * (random.random(MODES) - 0.5))  # a wave holds two eddies
        numbers, phase = along * (np.pi / self.size * halves)[:, None], 2 * np.pi * random.random(MODES)
        return numbers, across, phase, self.speed / self.size * random.standard_normal(MODES)


SIZES = ((3, 2.2), (7, 4.0), (13, 8.0), (27, 16.0))
"""Octaves of motion, from the finest on; what is larger the estimate shows. Voxels of an average that leaves an octave
out, while the narrower one before does not, and of eddies of its size."""

INTENSITY = 0.23
"""Speed of an octave's eddies, of each component, over that of a clip's smoke: .14 of the true one, of which estimates
show .6 (docs/experiments/continuation.md)."""

MIN_DENSITY_FRACTION = np.float32(0.05)
"""Fraction of the largest density above which a voxel is in the smoke."""

EDGE_VOXELS = 5
"""Voxels over which the eddies end beside the smoke."""


def small_eddy_speed(states: Sequence[SmokeState]) -> float:
    """The speed in m/s, root mean square of each component, that eddies of each of `SIZES` should have in a clip."""
    squares = [_mean_square(at_centres(m.velocity.faces), [_in_smoke(m.density)] * 3) for m in states]
    return INTENSITY * math.sqrt(float(np.median(squares)))


def with_small_eddies(velocity: Velocity, density: Array, speed: float, step: int = 0) -> Velocity:
    """A velocity whose smoke has eddies of each of `SIZES` of a `small_eddy_speed`; it may have divergence.

    What is missing is added, with other eddies in every step, so that they have nothing to do with the flow and their
    energy adds to its own.
    """
    faces = list(velocity.faces)
    smoke = _in_smoke(density)
    soft = ndimage.uniform_filter(smoke, EDGE_VOXELS)
    inside, near = (on_faces(np.stack([each] * 3, -1)) for each in (smoke, soft))
    for number, (size, found) in enumerate(_octaves(velocity)):
        missing = 3 * speed**2 - _mean_square(found, inside)
        if missing > 0:
            eddies = Turbulence(missing**0.5, size * velocity.voxel_size, step * len(SIZES) + number)
            added = eddies.velocity(velocity, 0.0)
            faces = [u + weight * eddy for u, weight, eddy in zip(faces, near, added, strict=True)]
    return velocity.with_faces(faces)


def _octaves(velocity: Velocity) -> Iterator[tuple[float, list[Array]]]:
    """Voxels of the eddies of each octave that a box holds, and a velocity's motion in it on faces."""
    wider = list(velocity.faces)
    for average, eddy in SIZES:
        if average < min(velocity.shape):
            averaged = [ndimage.uniform_filter(component, average) for component in wider]
            yield eddy, [u - mean for u, mean in zip(wider, averaged, strict=True)]
            wider = averaged


def _in_smoke(density: Array) -> Array:
    """1 in the smoke, 0 elsewhere."""
    return np.asarray((density > MIN_DENSITY_FRACTION * density.max()).astype(np.float32))


def _mean_square(components: Sequence[Array], weights: Sequence[Array]) -> float:
    """The mean square of a vector by its components, each with weights; 0 where there is no weight."""
    return sum(
        float(np.vdot(w, np.square(u))) / max(float(w.sum(dtype=np.float64)), 1e-30)
        for u, w in zip(components, weights, strict=True)
    )
