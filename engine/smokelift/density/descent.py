"""Projected descent on the exact gradient, preconditioned per voxel, with a step that needs no tuning.

Every voxel is measured in units of its own scale, start + floor. In these units the steepest descent changes a ray's
smoke in proportion to what is there, so what the start assumes of depth survives where the pictures say nothing. The
direction is that of the limited-memory BFGS method (Nocedal 1980), among the voxels that no bound holds (two-metric
projection: Bertsekas 1982). What neighbors share counts more in it than what each wants for itself: thick smoke that
is too dark is so over a whole lobe, and voxels that mend it one by one become spikes. No voxel changes by more than a
fraction of itself. The step is shortened until the objective falls sufficiently (Armijo), so the objective never rises.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from scipy.linalg.blas import saxpy

import smokelift._core as _core
from smokelift.checks import Array
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
"""Fraction of the linear prediction that a step has to gain (Armijo's constant: Nocedal and Wright, "Numerical
Optimization", 2006)."""

MAX_CHANGE = 0.25
"""Largest change of a voxel in one step, as a fraction of what it holds and the floor. Without it density spikes grow
where few rays pass, at floor and ceiling (docs/experiments/density-descent.md)."""

FIRST_GAIN = 0.1
"""Fraction of the objective that the first step would gain if the objective were linear: of its curvature nothing is
known yet."""

MAX_FIRST_STEP = 1e30
"""Largest factor of the first step: a start of next to nothing asks for more than 32 bits hold."""

SHORTEN = 0.3
"""Factor of a step that gains too little."""

SHORTENINGS = 40
"""Largest number of times that a step is shortened: 0.3^40 is below float32's resolution."""


def descend(
    terms: Sequence[Term],
    density: Volume,
    where: _core.MarkedVoxels,
    iterations: int,
    tolerance: float,
    patience: int,
    *,
    bound: float,
    expected: Volume,
) -> Fit:
    """Minimize the objective from a start (nx, ny, nz), in the voxels ``where`` smoke may be: the renderers' support.

    The result takes the start's place, which is zero outside them. It ends after so many iterations, or after
    ``patience`` steps in a row that each gain less than ``tolerance``, a fraction of the objective: one may gain little
    and the next much. No voxel exceeds ``bound``; the start is cut to it. ``expected`` (nx, ny, nz) bounds the scale of
    empty voxels, so that smoke fades where a prior expects none.
    """
    where = where.above_zero(density, expected)
    current = where.take(density)
    np.minimum(current, np.float32(bound), out=current)
    floor = where.take(expected)
    np.minimum(floor, np.float32(FLOOR * current.mean() if current.size else 0), out=floor)
    problem = _Problem(terms, where, density, floor, current)
    residuals = problem.residuals(current)
    loss, enough = objective(terms, residuals), noise_floor(terms)
    room = _Room(current.size)
    curvature = _Curvature(where, room)
    direction = room.take()
    gradient: Array | None = None
    step: _Step | None = None
    done = idle = 0
    while done < iterations and loss > enough and idle < patience:
        before, gradient = gradient, problem.gradient(residuals, room.take())
        if before is not None and step is not None:
            curvature.learn(step.moved, np.subtract(gradient, before, out=before))
        _free(gradient, gradient, current, bound, direction)
        curvature.newton(direction)
        _free(direction, gradient, current, bound, direction)
        slope = _dot(gradient, direction)
        if not slope > 0:
            break
        length = 1.0 if curvature.known else min(FIRST_GAIN * loss / slope, MAX_FIRST_STEP)
        step = problem.step(current, loss, gradient, direction, length, bound, room)
        if step is None:
            problem.show(current)
            break
        idle = idle + 1 if loss - step.loss < tolerance * step.loss else 0
        room.give(current)
        current, residuals, loss = step.density, step.residuals, step.loss
        done += 1
    return Fit(problem.volume, loss, residuals, done)


class _Room:
    """Arrays (n,) that were given back: new memory takes several times as long as the arithmetic."""

    def __init__(self, size: int) -> None:
        self._size = size
        self._spare: list[Array] = []

    def take(self) -> Array:
        """An array that holds anything."""
        return self._spare.pop() if self._spare else np.empty(self._size, np.float32)

    def give(self, *arrays: Array) -> None:
        """Give back arrays that nobody reads any more."""
        self._spare += arrays


class _Problem:
    """The objective of the voxels `where` of a density.

    `volume` (nx, ny, nz) is the density that was shown last. `floor` (n,) is the unit of an empty voxel, and beside the
    ``start`` (n,) that of each.
    """

    def __init__(
        self, terms: Sequence[Term], where: _core.MarkedVoxels, volume: Volume, floor: Array, start: Array
    ) -> None:
        self.terms, self.volume, self.floor, self.scale = terms, volume, floor, floor + start
        self._where, self._slopes = where, np.zeros(volume.shape, np.float32)

    def show(self, density: Array) -> None:
        """Write a density of the voxels (n,) into the volume."""
        self._where.put(density, self.volume)

    def residuals(self, density: Array) -> tuple[Image, ...]:
        """What is left of the pictures, L - I, for a density of the voxels."""
        self.show(density)
        return tuple(term.renderer.image(self.volume, keep_record=True) - term.view.image for term in self.terms)

    def gradient(self, residuals: tuple[Image, ...], out: Array) -> Array:
        """Derivative of the objective (n,) in units of the scale, at the density that was rendered last."""
        for number, (term, residual) in enumerate(zip(self.terms, residuals, strict=True)):
            found = term.renderer.gradient(term.image_gradient(residual), out=self._slopes)
            if number == 0:
                self._where.take(found, out)
            else:
                out += self._where.take(found)
        out *= self.scale
        return out

    def step(
        self, current: Array, loss: float, gradient: Array, direction: Array, length: float, bound: float, room: _Room
    ) -> _Step | None:
        """Step against a direction, shortened until the objective falls sufficiently; None if it never does."""
        density, moved = room.take(), room.take()
        reach = np.float32(MAX_CHANGE) * (current + self.floor)
        lowest, highest = np.maximum(current - reach, 0), np.minimum(current + reach, np.float32(bound))
        for _ in range(SHORTENINGS):
            with np.errstate(over="ignore", invalid="ignore"):  # the first step may be longer than numbers reach
                np.multiply(direction, np.float32(-length), out=density)
                density *= self.scale
                density += current
            np.clip(density, lowest, highest, out=density)
            np.subtract(density, current, out=moved)
            moved /= self.scale
            residuals = self.residuals(density)
            found = objective(self.terms, residuals)
            # what the bounds leave of a long step need not lead down
            if found <= loss + SUFFICIENT * min(_dot(gradient, moved), 0.0):
                return _Step(density, moved, residuals, found)
            length *= SHORTEN
        return None


class _Step(NamedTuple):
    """Where a step arrives: the density, the way there in units of the scale, the residuals, and the objective."""

    density: Array
    moved: Array
    residuals: tuple[Image, ...]
    loss: float


class _Curvature:
    """The objective's second derivatives, as far as its last steps show them.

    Of each of the last `MEMORY` steps it keeps s, the step itself, y, the change of the gradient along it, and their
    product ys = 1 / rho (Nocedal, "Updating quasi-Newton matrices with limited storage", 1980). Where nothing is known,
    the inverse of the second derivatives is a multiple of what neighbors share: a voxel and, `SHARED` times as much,
    the means over its cubes, those of two lattices half a cube apart, so that no cube shows.
    """

    def __init__(self, where: _core.MarkedVoxels, room: _Room) -> None:
        self._where, self._room = where, room
        self._steps: deque[tuple[Array, Array, float]] = deque()

    @property
    def known(self) -> bool:
        """Whether a step has shown any."""
        return bool(self._steps)

    def learn(self, s: Array, y: Array) -> None:
        """Remember a step s and the gradient's change y, unless the objective is not convex along the step."""
        ys = _dot(s, y)
        if not ys > 0:
            self._room.give(s, y)
            return
        if len(self._steps) == MEMORY:
            self._room.give(*self._steps.popleft()[:2])
        self._steps.append((s, y, ys))

    def newton(self, q: Array) -> None:
        """Newton's step for a gradient q, in its place."""
        alphas = []
        for s, y, ys in reversed(self._steps):
            alphas.append(_dot(s, q) / ys)
            saxpy(y, q, a=-alphas[-1])
        if self._steps:
            _, y, ys = self._steps[-1]
            shared = self._room.take()
            self._where.smooth_in_cubes(y, BLOCK, SHARED, shared)
            q *= np.float32(ys / _dot(y, shared))
            self._room.give(shared)
        self._where.smooth_in_cubes(q, BLOCK, SHARED, q)
        for (s, y, ys), alpha in zip(self._steps, reversed(alphas), strict=True):
            beta = _dot(y, q) / ys
            saxpy(s, q, a=alpha - beta)


def _free(values: Array, gradient: Array, density: Array, bound: float, out: Array) -> None:
    """Write values, but 0 where a density is 0 or at its bound and the gradient leads beyond that."""
    np.copyto(out, values)
    out[((density <= 0) & (gradient > 0)) | ((density >= bound) & (gradient < 0))] = 0


def _dot(a: Array, b: Array) -> float:
    return float(np.vdot(a, b))
