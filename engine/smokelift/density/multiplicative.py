"""The multiplicative front fit: every ray's smoke is scaled until the picture is right, its depth profile kept.

For one ray with scattered radiance S and transmittance T the effective source is J = S / (1 - T). If all smoke on
the ray is scaled by s, the picture becomes J (1 - T^s) + T^s B; the transmittance that explains the target I best is

    t = <I - J, B - J> / |B - J|^2,   s = ln t / ln T.

Where shadows or thickness make the picture insensitive to s, the step is damped by the true sensitivity dL / d ln s,
and where smoke and background look alike the picture says little, so the neighbours' step counts instead.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from smokelift.density.fit import Fit
from smokelift.density.hull import Projection
from smokelift.render.renderer import Image, Renderer, Volume

STEP_RANGE = (0.4, 2.5)
"""Largest change of a ray's smoke in one iteration."""

RELAXATION = 0.9
DAMPING = 0.4
"""Relative sensitivity at which the step is halved."""

PROBE = 1.05
"""Scale of the density for the secant dL / d ln s."""


def fit_multiplicative(
    renderer: Renderer,
    target: Image,
    background: Image,
    density: Volume,
    projection: Projection,
    weight: NDArray[np.float32],
    noise: Image,
    enough: float,
    iterations: int,
    tolerance: float,
) -> Fit:
    """Scale the smoke of every ray until the picture matches; returns the best density seen.

    Parameters
    ----------
    renderer, background : (rows, columns, 3)
    target : (rows, columns, 3)
        Linear radiance.
    density : (nx, ny, nz)
        Start; voxels at zero stay there.
    projection
        Where voxels lie in the picture.
    weight : (rows, columns)
        How much the picture counts, 0 to 1; where it counts less, steps are shorter as well.
    noise : (rows, columns, 3)
        Standard deviation of the target's noise, linear radiance.
    enough
        Loss at which the target's noise begins to be fitted; nothing is done below it.
    iterations
        At most so many.
    tolerance
        Stop when an iteration lowers the loss by less than this share.
    """
    best, best_loss, current, done = density, np.inf, density, 0
    filled = density > 0
    for done in range(iterations + 1):
        image = renderer.image(current)
        transmittance = renderer.transmittance
        loss = float(np.sum(weight[..., None] * np.square(image - target, dtype=np.float64)))
        gained = best_loss - loss
        if loss < best_loss:
            best, best_loss = current, loss
        if done == iterations or loss <= enough or (done > 2 and gained < tolerance * loss):
            break
        secant = (renderer.image(current * np.float32(PROBE)) - image) / np.log(PROBE)
        step = _log_scale(image, transmittance, secant, target, background, weight, noise)
        scaled = current.copy()
        scaled[filled] *= np.exp(RELAXATION * projection.read(step, filled))
        current = scaled
    return Fit(best, best_loss, done)


def _log_scale(
    image: Image,
    transmittance: Image,
    secant: Image,
    target: Image,
    background: Image,
    weight: NDArray[np.float32],
    noise: Image,
) -> NDArray[np.float32]:
    """Logarithm of each pixel's scale, damped and smoothed, (rows, columns)."""
    clear = transmittance[..., None]
    solid = np.maximum(1 - clear, 1e-6)
    source = (image - clear * background) / solid
    contrast = background - source
    power = np.sum(contrast**2, -1)
    floor = np.mean(noise**2, -1)
    wanted = np.clip(np.sum((target - source) * contrast, -1) / (power + 1e-20), 1e-4, 1.0)
    scale = np.log(wanted) / np.minimum(np.log(np.maximum(transmittance, 1e-30)), -1e-6)
    change = np.sqrt(np.sum((image - background) ** 2, -1))
    sensitivity = np.sqrt(np.sum(secant**2, -1)) / np.maximum(change, 1e-6)
    gain = weight * sensitivity**2 / (sensitivity**2 + DAMPING**2)
    step = gain * np.log(np.clip(scale, *STEP_RANGE))
    trust = weight * power / (power + floor)
    # one pixel's blur keeps neighbouring rays from fighting over the voxels that they share
    return np.asarray(
        ndimage.gaussian_filter(trust * step, 0.7) / (ndimage.gaussian_filter(trust, 0.7) + 1e-3), np.float32
    )
