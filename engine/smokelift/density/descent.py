"""Projected descent on the exact gradient, preconditioned per voxel, with a step that needs no tuning.

    minimise  sum |L(rho) - I|^2   subject to rho >= 0, rho = 0 outside the hull

Every voxel is measured in units of its own scale w = rho_start + floor: in these units the steepest descent changes
a ray's smoke in proportion to what is there, so the depth profile of the start survives what the picture says
nothing about. The step length is Barzilai and Borwein's (1988), shortened until the loss falls sufficiently (Armijo,
as in the spectral projected gradient method of Birgin, Martinez and Raydan, 2000), so the loss never rises.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from smokelift.density.fit import Fit
from smokelift.render.renderer import Image, Renderer, Volume

FLOOR = 0.1
"""Scale of an empty voxel of the hull, in mean densities of the start: it may fill, but more slowly than others."""

SUFFICIENT = 1e-4
SHORTEN = 0.3


def descend(
    renderer: Renderer,
    target: Image,
    density: Volume,
    hull: NDArray[np.bool_],
    weight: NDArray[np.float32],
    enough: float,
    iterations: int,
    tolerance: float,
) -> Fit:
    """Minimise the picture's error from a start; see the module.

    Parameters
    ----------
    renderer
        Made with the hull as its support.
    target : (rows, columns, 3)
        Linear radiance.
    density : (nx, ny, nz)
        Start.
    hull : (nx, ny, nz) bool
        Voxels that may hold smoke.
    weight : (rows, columns)
        Weight of each pixel.
    enough
        Loss at which the target's noise begins to be fitted; nothing is done below it.
    iterations
        At most so many steps.
    tolerance
        Stop when a step lowers the loss by less than this share.
    """
    where = np.flatnonzero(hull)
    volume = np.zeros_like(density)
    current = density.ravel()[where]
    scale = current + np.float32(FLOOR * (current.mean() if current.size else 0.0))

    def evaluate(candidate: NDArray[np.float32]) -> tuple[float, Image]:
        volume.ravel()[where] = candidate
        residual = weight[..., None] * (renderer.image(volume, keep_record=True) - target)
        return float(np.sum(np.square(residual, dtype=np.float64))), residual

    def gradient_of(residual: Image) -> NDArray[np.float32]:
        """Derivative of the loss in units of the scale, for the last density evaluated."""
        return renderer.gradient(2 * weight[..., None] * residual).ravel()[where] * scale

    loss, residual = evaluate(current)
    gradient = gradient_of(residual)
    step: float | None = None
    done = 0
    while done < iterations and loss > enough:
        slope = _dot(gradient, gradient)
        if slope <= 0:
            break
        trial = step or 0.1 * loss / slope
        while True:
            candidate = np.maximum(current - np.float32(trial) * scale * gradient, 0)
            moved = (candidate - current) / scale
            new_loss, residual = evaluate(candidate)
            if new_loss <= loss + SUFFICIENT * _dot(gradient, moved):
                break
            trial *= SHORTEN
            if trial * slope < 1e-9 * loss:
                volume.ravel()[where] = current
                return Fit(volume, loss, done)
        new_gradient = gradient_of(residual)
        curvature = _dot(moved, new_gradient - gradient)
        step = _dot(moved, moved) / curvature if curvature > 0 else 4 * trial
        gained = loss - new_loss
        current, loss, gradient = candidate, new_loss, new_gradient
        done += 1
        if gained < tolerance * loss:
            break
    return Fit(volume, loss, done)


def _dot(a: NDArray[np.float32], b: NDArray[np.float32]) -> float:
    return float(np.vdot(a, b))
