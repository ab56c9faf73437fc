"""Projected descent on the exact gradient, preconditioned per voxel, with a step that needs no tuning.

Every voxel is measured in units of its own scale, start + floor: in these units the steepest descent changes a ray's
smoke in proportion to what is there, so what the start assumes about depth survives where the pictures say nothing.
The step length is Barzilai and Borwein's (1988), shortened until the objective falls sufficiently (Armijo, as in the
spectral projected gradient method of Birgin, Martinez and Raydan, 2000), so the objective never rises.
"""

from __future__ import annotations

import functools
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from smokelift.density.objective import Fit, Term, noise_floor, objective
from smokelift.render import Image, Volume

FLOOR = 0.1
"""Scale of an empty voxel of the hull, in mean densities of the start: it may fill, but more slowly than others
(docs/experiments/density-descent.md)."""

SUFFICIENT = 1e-4
"""Armijo's constant: share of the linear prediction that a step has to gain."""

LONGEST = 1e30
"""Step that is tried, at most: a start of next to nothing asks for more than 32 bits hold."""

SHORTEN = 0.3
"""Factor of a step that gains too little."""

SHORTENINGS = 40
"""Times that a step is shortened at most: 0.3^40 is below float32's resolution."""


def descend(
    terms: Sequence[Term],
    density: Volume,
    hull: NDArray[np.bool_],
    iterations: int,
    tolerance: float,
    patience: int,
    *,
    bound: float = np.inf,
) -> Fit:
    """Minimise the objective from a start.

    Parameters
    ----------
    terms
        Their renderers made with the hull as support.
    density : (nx, ny, nz)
        Start.
    hull : (nx, ny, nz) bool
        Voxels that may hold smoke.
    iterations
        At most so many steps.
    tolerance
        Share of the objective that a step has to gain.
    patience
        Stop after so many steps in a row that do not. Of Barzilai and Borwein's steps one may gain little and the next
        much.
    bound
        What no voxel may exceed; where the start does it is cut.
    """
    where = np.flatnonzero(hull)
    volume, slopes = (np.zeros(hull.shape, np.float32) for _ in range(2))
    current = np.minimum(density.ravel()[where], np.float32(bound))
    scale = current + np.float32(FLOOR * (current.mean() if current.size else 0.0))
    enough = noise_floor(terms)

    def residuals_of(candidate: NDArray[np.float32]) -> tuple[Image, ...]:
        volume.ravel()[where] = candidate
        return tuple(term.renderer.image(volume, keep_record=True) - term.view.image for term in terms)

    def gradient_of(residuals: tuple[Image, ...]) -> NDArray[np.float32]:
        """Derivative of the objective in units of the scale, for the last density evaluated."""
        parts = (
            term.renderer.gradient(term.image_gradient(residual), out=slopes).ravel().take(where)
            for term, residual in zip(terms, residuals, strict=True)
        )
        found = functools.reduce(np.add, parts)
        found *= scale
        return found

    def moved_by(trial: float) -> NDArray[np.float32]:
        """Where a step of this length arrives. New memory takes as long as the arithmetic, so there is little of it."""
        candidate = scale * np.float32(trial)
        candidate *= gradient
        np.subtract(current, candidate, out=candidate)
        return np.asarray(np.clip(candidate, 0, bound, out=candidate))

    residuals = residuals_of(current)
    loss, gradient = objective(terms, residuals), gradient_of(residuals)
    step: float | None = None
    done = idle = 0
    while done < iterations and loss > enough:
        slope = _dot(gradient, gradient)
        if not slope > 0:
            break
        trial = min(step or 0.1 * loss / slope, LONGEST)
        for _ in range(SHORTENINGS):
            candidate = moved_by(trial)
            moved = candidate - current
            moved /= scale
            new_residuals = residuals_of(candidate)
            new_loss = objective(terms, new_residuals)
            if new_loss <= loss + SUFFICIENT * _dot(gradient, moved):
                break
            trial *= SHORTEN
        else:
            volume.ravel()[where] = current
            return Fit(volume, loss, residuals, done)
        new_gradient = gradient_of(new_residuals)
        curvature = _dot(moved, np.subtract(new_gradient, gradient, out=gradient))
        step = _dot(moved, moved) / curvature if curvature > 0 else 4 * trial
        gained = loss - new_loss
        current, residuals, loss, gradient = candidate, new_residuals, new_loss, new_gradient
        done += 1
        idle = idle + 1 if gained < tolerance * loss else 0
        if idle == patience:
            break
    return Fit(volume, loss, residuals, done)


def _dot(a: NDArray[np.float32], b: NDArray[np.float32]) -> float:
    return float(np.vdot(a, b))
