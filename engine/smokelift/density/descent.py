"""Projected descent on the exact gradient, preconditioned per voxel, with a step that needs no tuning.

Every voxel is measured in units of its own scale, start + floor. In these units the steepest descent changes a ray's
smoke in proportion to what is there, so what the start assumes of depth survives where the pictures say nothing. The
direction is that of the limited-memory BFGS method (Nocedal 1980), among the voxels that no bound holds (two-metric
projection: Bertsekas 1982). What neighbours share counts more in it than what each wants for itself: thick smoke that
is too dark is so over a whole lobe, and voxels that mend it one by one become spikes. No voxel changes by more than a
share of itself. The step is shortened until the objective falls sufficiently (Armijo), so the objective never rises.
"""

from __future__ import annotations

import functools
from collections import deque
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.linalg.blas import saxpy

from smokelift.checks.array_types import Array
from smokelift.density.objective import Fit, Term, noise_floor, objective
from smokelift.render import Image, Volume

MEMORY = 3
"""Steps that the direction remembers: as good as six, in half the memory (docs/experiments/density-descent.md)."""

BLOCK = 4
"""Voxels along the cubes whose voxels share a step: small lobes (docs/experiments/density-descent.md)."""

SHARED = 3.0
"""Weight of a gradient's mean over such a cube, over that of the gradient itself
(docs/experiments/density-descent.md)."""

FLOOR = 0.1
"""Scale of an empty voxel of the hull, in mean densities of the start, or what the prior expects there if that is less.
The voxel may fill, but more slowly than others (docs/experiments/density-descent.md)."""

SUFFICIENT = 1e-4
"""Share of the linear prediction that a step has to gain (Armijo's constant)."""

MAX_CHANGE = np.float32(0.25)
"""Largest change of a voxel in one step, as a share of what it holds and the floor. Without it density spikes grow
where few rays pass, at floor and ceiling (docs/experiments/density-descent.md)."""

MAX_FIRST_STEP = 1e30
"""Largest first step: a start of next to nothing asks for more than 32 bits hold."""

SHORTEN = 0.3
"""Factor of a step that gains too little."""

SHORTENINGS = 40
"""Largest number of times that a step is shortened: 0.3^40 is below float32's resolution."""


def descend(
    terms: Sequence[Term],
    density: Volume,
    hull: NDArray[np.bool_],
    iterations: int,
    tolerance: float,
    patience: int,
    *,
    bound: float = np.inf,
    recorded: tuple[Image, ...] = (),
    expected: Volume | None = None,
) -> Fit:
    """Minimise the objective from a start (nx, ny, nz), in the voxels of the hull, which is the renderers' support.

    It ends after so many iterations, or after ``patience`` steps in a row that each gain less than ``tolerance``, a
    share of the objective: one may gain little and the next much. No voxel exceeds ``bound``; the start is cut to it.
    ``recorded`` is what is left of each term's picture at the start, L - I, if the renderers hold the records of these
    pictures. ``expected`` (nx, ny, nz) bounds the scale of empty voxels, so that smoke fades where a prior expects
    none.
    """
    where = np.flatnonzero(hull)
    if expected is not None:
        where = where[(density.ravel()[where] > 0) | (expected.ravel()[where] > 0)]
    began = density.ravel()[where]
    current = np.minimum(began, np.float32(bound))
    floor = np.full(current.shape, FLOOR * current.mean() if current.size else 0, np.float32)
    if expected is not None:
        np.minimum(floor, expected.ravel()[where], out=floor)
    shape = hull.shape
    problem = _Problem(terms, where, np.zeros(shape, np.float32), np.zeros(shape, np.float32), current + floor)
    if recorded and np.array_equal(current, began):
        problem.show(current)
        residuals = recorded
    else:
        residuals = problem.residuals(current)
    loss, enough = objective(terms, residuals), noise_floor(terms)
    curvature = _Curvature(_Neighbours(where, shape))
    gradient: Array | None = None
    step: _Step | None = None
    done = idle = 0
    while done < iterations and loss > enough and idle < patience:
        before, gradient = gradient, problem.gradient(residuals)
        if before is not None and step is not None:
            curvature.learn(step.moved, np.subtract(gradient, before, out=before))
        held = ((current <= 0) & (gradient > 0)) | ((current >= bound) & (gradient < 0))
        direction = curvature.newton(np.where(held, np.float32(0), gradient))
        direction[held] = 0
        slope = _dot(gradient, direction)
        if not slope > 0:
            break
        length = 1.0 if curvature.known else min(0.1 * loss / slope, MAX_FIRST_STEP)
        reach = MAX_CHANGE * (current + floor)
        lowest, highest = np.maximum(current - reach, 0), np.minimum(current + reach, np.float32(bound))
        step = _step(problem, current, loss, gradient, direction, length, (lowest, highest))
        if step is None:
            problem.show(current)
            break
        idle = idle + 1 if loss - step.loss < tolerance * step.loss else 0
        current, residuals, loss = step.density, step.residuals, step.loss
        done += 1
    return Fit(problem.volume, loss, residuals, done)


@dataclass(frozen=True, eq=False)
class _Problem:
    """The objective of the hull's voxels, which are at `where` (n,) in the flat volume.

    `volume` (nx, ny, nz) is the density that was shown last, `slopes` (nx, ny, nz) room for a gradient, and `scale`
    (n,) the unit of each voxel.
    """

    terms: Sequence[Term]
    where: NDArray[np.intp]
    volume: Volume
    slopes: Volume
    scale: Array

    def show(self, density: Array) -> None:
        """Write a density of the hull's voxels (n,) into the volume."""
        self.volume.ravel()[self.where] = density

    def residuals(self, density: Array) -> tuple[Image, ...]:
        """What is left of the pictures, L - I, for a density of the hull's voxels."""
        self.show(density)
        return tuple(term.renderer.image(self.volume, keep_record=True) - term.view.image for term in self.terms)

    def gradient(self, residuals: tuple[Image, ...]) -> Array:
        """Derivative of the objective (n,) in units of the scale, at the density that was rendered last."""
        parts = (
            term.renderer.gradient(term.image_gradient(residual), out=self.slopes).ravel().take(self.where)
            for term, residual in zip(self.terms, residuals, strict=True)
        )
        found = functools.reduce(np.add, parts)
        found *= self.scale
        return found


@dataclass(frozen=True, eq=False)
class _Step:
    """Where a step arrives: the density, the way there in units of the scale, the residuals, and the objective."""

    density: Array
    moved: Array
    residuals: tuple[Image, ...]
    loss: float


def _step(
    problem: _Problem,
    current: Array,
    loss: float,
    gradient: Array,
    direction: Array,
    length: float,
    bounds: tuple[Array, Array],
) -> _Step | None:
    """Step against a direction, shortened until the objective falls sufficiently; None if it never does."""
    for _ in range(SHORTENINGS):
        # allocation takes as long as the arithmetic, so there is little of it
        density = direction * np.float32(-length)
        density *= problem.scale
        density += current
        np.clip(density, *bounds, out=density)
        moved = density - current
        moved /= problem.scale
        residuals = problem.residuals(density)
        found = objective(problem.terms, residuals)
        # what the bounds leave of a long step need not lead down
        if found <= loss + SUFFICIENT * min(_dot(gradient, moved), 0.0):
            return _Step(density, moved, residuals, found)
        length *= SHORTEN
    return None


class _Curvature:
    """The objective's second derivatives, as far as its last steps show them.

    Of each of the last `MEMORY` steps it keeps s, the step itself, y, the change of the gradient along it, and their
    product ys = 1 / rho (Nocedal, "Updating quasi-Newton matrices with limited storage", 1980). Where nothing is known,
    the inverse of the second derivatives is a multiple of what `neighbours` does.
    """

    def __init__(self, neighbours: _Neighbours) -> None:
        self._neighbours = neighbours
        self._steps: deque[tuple[Array, Array, float]] = deque(maxlen=MEMORY)

    @property
    def known(self) -> bool:
        """Whether a step has shown any."""
        return bool(self._steps)

    def learn(self, s: Array, y: Array) -> None:
        """Remember a step s and the gradient's change y, unless the objective is not convex along the step."""
        ys = _dot(s, y)
        if ys > 0:
            self._steps.append((s, y, ys))

    def newton(self, q: Array) -> Array:
        """Newton's step for a gradient q, which is overwritten."""
        alphas = []
        for s, y, ys in reversed(self._steps):
            alphas.append(_dot(s, q) / ys)
            q = saxpy(y, q, a=-alphas[-1])
        if self._steps:
            _, y, ys = self._steps[-1]
            q *= np.float32(ys / _dot(y, self._neighbours.shared(y)))
        q = self._neighbours.shared(q)
        for (s, y, ys), alpha in zip(self._steps, reversed(alphas), strict=True):
            beta = _dot(y, q) / ys
            q = saxpy(s, q, a=alpha - beta)
        return q


class _Neighbours:
    """Cubes of voxels that share a step, in two lattices half a cube apart, so that no cube shows.

    ``where`` (n,) are the voxels in a flat volume of the shape.
    """

    def __init__(self, where: NDArray[np.intp], shape: tuple[int, ...]) -> None:
        places = np.unravel_index(where, shape)
        self._lattices = []
        for offset in (0, BLOCK // 2):
            cubes = [(count + offset) // BLOCK + 1 for count in shape]
            cube = np.ravel_multi_index([(place + offset) // BLOCK for place in places], cubes)
            self._lattices.append((cube, np.maximum(np.bincount(cube), 1)))

    def shared(self, values: Array) -> Array:
        """The voxels' values (n,) and, `SHARED` times as much, their means over the cubes."""
        result = values / np.float32(1 + SHARED)
        for cube, count in self._lattices:
            mean = np.bincount(cube, values) * (SHARED / (1 + SHARED) / len(self._lattices)) / count
            result += mean.astype(np.float32)[cube]
        return result


def _dot(a: Array, b: Array) -> float:
    return float(np.vdot(a, b))
