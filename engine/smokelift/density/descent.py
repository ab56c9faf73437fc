"""Projected descent on the exact gradient, preconditioned per voxel, with a step that needs no tuning.

    minimise  sum_views sum_pixels |L(rho) - I|^2   subject to 0 <= rho <= densest, rho = 0 outside the hull

Every voxel is measured in units of its own scale w = rho_start + floor: in these units the steepest descent changes
a ray's smoke in proportion to what is there, so the depth profile of the start survives what the picture says
nothing about. The step length is Barzilai and Borwein's (1988), shortened until the loss falls sufficiently (Armijo,
as in the spectral projected gradient method of Birgin, Martinez and Raydan, 2000), so the loss never rises.
"""

from __future__ import annotations

import functools
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from smokelift.density.fit import Fit, Target
from smokelift.render.renderer import Image, Volume

FLOOR = 0.1
"""Scale of an empty voxel of the hull, in mean densities of the start: it may fill, but more slowly than others."""

PATIENCE = 2
"""Steps in turn without gain that end the descent. Of Barzilai and Borwein's one may gain little and the next one much;
ended by the first, some frames of a clip kept twice the error of others, and the smoke flickered."""

SUFFICIENT = 1e-4
SHORTEN = 0.3


def descend(
    targets: Sequence[Target],
    density: Volume,
    hull: NDArray[np.bool_],
    enough: float,
    iterations: int,
    tolerance: float,
    densest: float = np.inf,
) -> Fit:
    """Minimise the pictures' error from a start; see the module.

    Parameters
    ----------
    targets
        Their renderers made with the hull as support.
    density : (nx, ny, nz)
        Start.
    hull : (nx, ny, nz) bool
        Voxels that may hold smoke.
    enough
        Loss at which the targets' noise begins to be fitted; nothing is done below it.
    iterations
        At most so many steps.
    tolerance
        Stop when `PATIENCE` steps in turn lower the loss by less than this share each.
    densest
        What no voxel may exceed; where the start does it is cut.
    """
    where = np.flatnonzero(hull)
    volume = np.zeros_like(density)
    current = np.minimum(density.ravel()[where], np.float32(densest))
    scale = current + np.float32(FLOOR * (current.mean() if current.size else 0.0))

    def evaluate(candidate: NDArray[np.float32]) -> tuple[tuple[float, ...], list[Image]]:
        volume.ravel()[where] = candidate
        residuals = [
            target.weight[..., None] * (target.renderer.image(volume, keep_record=True) - target.image)
            for target in targets
        ]
        return tuple(float(np.sum(np.square(part, dtype=np.float64))) for part in residuals), residuals

    def gradient_of(residuals: list[Image]) -> NDArray[np.float32]:
        """Derivative of the loss in units of the scale, for the last density evaluated."""
        parts = (
            target.renderer.gradient(2 * target.weight[..., None] * residual).ravel()[where]
            for target, residual in zip(targets, residuals, strict=True)
        )
        return functools.reduce(np.add, parts) * scale

    losses, residuals = evaluate(current)
    loss, gradient = sum(losses), gradient_of(residuals)
    step: float | None = None
    done = idle = 0
    while done < iterations and loss > enough:
        slope = _dot(gradient, gradient)
        if slope <= 0:
            break
        trial = step or 0.1 * loss / slope
        while True:
            candidate = np.clip(current - np.float32(trial) * scale * gradient, 0, densest)
            moved = (candidate - current) / scale
            new_losses, residuals = evaluate(candidate)
            new_loss = sum(new_losses)
            if new_loss <= loss + SUFFICIENT * _dot(gradient, moved):
                break
            trial *= SHORTEN
            if trial * slope < 1e-9 * loss:
                volume.ravel()[where] = current
                return Fit(volume, losses, done)
        new_gradient = gradient_of(residuals)
        curvature = _dot(moved, new_gradient - gradient)
        step = _dot(moved, moved) / curvature if curvature > 0 else 4 * trial
        gained = loss - new_loss
        current, losses, loss, gradient = candidate, new_losses, new_loss, new_gradient
        done += 1
        idle = idle + 1 if gained < tolerance * loss else 0
        if idle == PATIENCE:
            break
    return Fit(volume, losses, done)


def _dot(a: NDArray[np.float32], b: NDArray[np.float32]) -> float:
    return float(np.vdot(a, b))
