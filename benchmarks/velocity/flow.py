"""A pair of densities whose motion is a formula: a puff that rises and churns, with detail down to a few voxels.

The velocity is the curl of a vector potential, so it has no divergence anywhere. An envelope E keeps its vorticity to
where the smoke is, as in smoke that drives its own motion; inside there are a vortex ring that rises and plane waves
(kinematic turbulence: Kraichnan 1970, Phys. Fluids 13, 22):

    v(x) = curl E(x) (w z x x / 2 + sum_k a_k sin(k . x + p_k)),    E(x) = exp(-|x|^2 / 2 s^2)

Lengths are in longest sides of the box, times in frames; X(x, t) is where the smoke at x was t frames ago, traced with
fourth-order Runge-Kutta. With f the smoke `STIRRED` frames ago, a ball with structure,

    before(x) = f(X(x, STIRRED))        after(x) = f(X(X(x, 1), STIRRED))        motion(x) = x - X(x, 1)

so both densities sample one function, and no step of Smokelift takes part. The known answer is the motion and not v,
because the motion carries the one density into the other.

Velocity and smoke have the spectrum k^(-5/3) (Kolmogorov 1941, Corrsin 1951) down to the same number of voxels at every
size: a finer grid has finer smoke and finer eddies, and moves by more voxels per frame.
"""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from benchmarks.velocity.pairs import Pair
from smokelift.transport import Array

FASTEST = 1 / 64
"""Largest speed in longest sides per frame, about: one and a half voxels of 96, four and a half of 288."""

TURBULENCE = 0.3
"""Root mean square speed of the plane waves, relative to the ring's in its middle."""

RADIUS = 0.13
"""Standard deviation s of the envelope."""

STIRRED = 4.0
"""Frames during which the flow draws out the smoke before the first density."""

STEPS_PER_FRAME = 2
"""Runge-Kutta steps of the frame between the densities; one per frame is enough before, which both share."""

BALL = 0.22
"""Radius of the smoke before the flow draws it out."""

REACH = 0.36
"""Radius beyond which densities and motion are zero; no smoke comes near it."""

STRUCTURE = 0.8
"""Root mean square of the structure, relative to the smooth ball."""

COARSEST, FINEST = 0.25, 10.0
"""Wavelengths: the longest in longest sides, the shortest in voxels."""

WAVES = 6
"""Plane waves in an octave."""

BATCH = 1 << 14
"""Points that are traced together, few enough for the cache."""


@dataclass(frozen=True, eq=False)
class Waves:
    """Plane waves with random directions and phases, and amplitudes with a spectrum of k^(-5/3).

    Attributes
    ----------
    vectors : (count, 3) float32
        k.
    phases, amplitudes : (count,) float32
        Of each; a sum of such sines has the root mean square 1.
    """

    vectors: Array
    phases: Array
    amplitudes: Array

    @staticmethod
    def random(rng: np.random.Generator, voxels: int) -> "Waves":
        """Draw one as fine as this many voxels along the longest side can show."""
        octaves = max(1, 1 + int(np.log2(COARSEST * voxels / FINEST)))
        length = np.repeat(COARSEST * 0.5 ** np.arange(octaves), WAVES)
        direction = rng.standard_normal((len(length), 3))
        vectors = 2 * np.pi * direction / (length * np.linalg.norm(direction, axis=1))[:, None]
        phases = rng.uniform(0, 2 * np.pi, len(length))
        amplitudes = np.cbrt(length)
        amplitudes *= np.sqrt(2 / np.sum(amplitudes**2))
        return Waves(vectors.astype(np.float32), phases.astype(np.float32), amplitudes.astype(np.float32))

    def angles(self, x: Array) -> Array:
        """k . x + p at positions (3, points), for each wave."""
        return np.asarray(self.vectors @ x + self.phases[:, None])


@dataclass(frozen=True, eq=False)
class Flow:
    """The velocity.

    Attributes
    ----------
    speed
        w.
    waves
        Of the potential.
    potential, turning : (waves, 3) float32
        a_k and k x a_k, relative to w.
    """

    speed: float
    waves: Waves
    potential: Array
    turning: Array

    @staticmethod
    def random(rng: np.random.Generator, voxels: int) -> "Flow":
        """Draw one as fine as this many voxels along the longest side can show."""
        waves = Waves.random(rng, voxels)
        across = np.cross(waves.vectors, rng.standard_normal(waves.vectors.shape))
        across *= TURBULENCE * (waves.amplitudes / np.linalg.norm(across, axis=1))[:, None]
        potential = across / np.linalg.norm(waves.vectors, axis=1)[:, None]
        turning = np.cross(waves.vectors, potential)
        return Flow(FASTEST / (1 + TURBULENCE), waves, potential.astype(np.float32), turning.astype(np.float32))

    def velocity(self, x: Array) -> Array:
        """v at positions (3, points)."""
        double = np.float32(2 * RADIUS**2)
        squares = np.sum(x * x, 0) / double
        angles = self.waves.angles(x)
        v = x * (x[2] / double) + self.turning.T @ np.cos(angles)
        v -= np.cross(x, self.potential.T @ np.sin(angles), axis=0) * (2 / double)
        v[2] += 1 - squares
        return np.asarray(np.float32(self.speed) * np.exp(-squares) * v)

    def back(self, x: Array, frames: float, steps: int) -> Array:
        """X(x, frames)."""
        h = np.float32(-frames / steps)
        for _ in range(steps):
            k1 = self.velocity(x)
            k2 = self.velocity(x + h / 2 * k1)
            k3 = self.velocity(x + h / 2 * k2)
            k4 = self.velocity(x + h * k3)
            x = x + h / 6 * (k1 + 2 * k2 + 2 * k3 + k4)
        return x


def built_in_pair(shape: tuple[int, int, int], seed: int) -> Pair:
    """Return two densities and the motion between them."""
    stirred, positions = Stirred.random(shape, seed), _positions(shape)
    before, after = (np.zeros(positions.shape[1], np.float32) for _ in range(2))
    motion = np.zeros_like(positions)
    for part in _batches(positions):
        x = positions[:, part]
        last = stirred.flow.back(x, 1.0, STEPS_PER_FRAME)
        motion[:, part] = (x - last) * np.float32(max(shape))
        before[part], after[part] = (stirred.density(end, 0.0) for end in (x, last))
    vectors = np.stack([component.reshape(shape) for component in motion], -1)
    return Pair(before.reshape(shape), after.reshape(shape), vectors, np.zeros(shape, bool))


def built_in_densities(shape: tuple[int, int, int], seed: int, frames: int) -> Iterator[Array]:
    """Yield the densities of successive frames."""
    stirred, positions = Stirred.random(shape, seed), _positions(shape)
    for frame in range(frames):
        density = np.zeros(positions.shape[1], np.float32)
        for part in _batches(positions):
            density[part] = stirred.density(positions[:, part], frame)
        yield density.reshape(shape)


@dataclass(frozen=True, eq=False)
class Stirred:
    """A ball of smoke with structure that a flow has drawn out."""

    flow: Flow
    structure: Waves

    @staticmethod
    def random(shape: tuple[int, int, int], seed: int) -> "Stirred":
        """Draw one as fine as a box of these voxels can show."""
        rng = np.random.default_rng(seed)
        return Stirred(Flow.random(rng, max(shape)), Waves.random(rng, max(shape)))

    def density(self, x: Array, frames: float) -> Array:
        """f(X(x, STIRRED + frames)) at positions (3, points)."""
        since = STIRRED + frames
        origin = self.flow.back(x, since, round(since))
        ball = np.maximum(1 - np.sum(origin * origin, 0) / np.float32(BALL**2), 0)
        varied = 1 + STRUCTURE * self.structure.amplitudes @ np.sin(self.structure.angles(origin))
        return np.asarray(ball * np.maximum(varied, 0))


def _batches(positions: Array) -> Iterator[npt.NDArray[np.intp]]:
    """Yield the numbers of the points that smoke can reach, so many at a time."""
    near = np.flatnonzero(np.sum(positions * positions, 0) < REACH**2)
    for start in range(0, len(near), BATCH):
        yield near[start : start + BATCH]


def _positions(shape: tuple[int, int, int]) -> Array:
    """Voxel centers (3, voxels), in longest sides from the middle."""
    axes = [(np.arange(n, dtype=np.float32) + np.float32(0.5 - n / 2)) / np.float32(max(shape)) for n in shape]
    return np.stack([a.ravel() for a in np.meshgrid(*axes, indexing="ij")])
