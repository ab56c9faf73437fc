"""The multiplicative front fit: every ray's smoke is scaled until the picture is right, its depth profile kept.

For one ray with scattered radiance S and transmittance T the effective source is J = S / (1 - T). If all smoke on
the ray is scaled by s, the picture becomes J (1 - T^s) + T^s B; the transmittance that explains the target I best is

    t = <I - J, B - J> / |B - J|^2,   s = ln t / ln T.

Where shadows or thickness make the picture insensitive to s, the step is damped by the true sensitivity dL / d ln s,
and where smoke and background look alike the picture says little, so the neighbours' step counts instead.

Of several pictures each has its turn, so that the density becomes the one nearest to the start that all agree with:
multiplicative algebraic reconstruction (Gordon, Bender and Herman 1970).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from smokelift.density.fit import Fit, Target
from smokelift.density.hull import Projection, read_bilinearly
from smokelift.render.renderer import Image, Volume

STEP_RANGE = (0.4, 2.5)
"""Largest change of a ray's smoke in one iteration."""

RELAXATION = 0.9
DAMPING = 0.4
"""Relative sensitivity at which the step is halved."""

PROBE = 1.05
"""Scale of the density for the secant dL / d ln s."""


@dataclass(frozen=True, eq=False)
class RayTarget(Target):
    """A picture whose rays' smoke can be scaled; where it counts less, steps are shorter as well.

    Attributes
    ----------
    background : (rows, columns, 3)
        Linear radiance behind the smoke.
    noise : (rows, columns, 3)
        Standard deviation of the picture's noise, linear radiance.
    projection
        Where voxels lie in the picture.
    """

    background: Image
    noise: Image
    projection: Projection


def fit_multiplicative(
    targets: Sequence[RayTarget], density: Volume, enough: float, iterations: int, tolerance: float
) -> Fit:
    """Scale the smoke of every ray until the pictures match; returns the best density seen.

    Parameters
    ----------
    targets
        What is to be met.
    density : (nx, ny, nz)
        Start; voxels at zero stay there.
    enough
        Loss at which the targets' noise begins to be fitted; nothing is done below it.
    iterations
        At most so many, in each of which every target has a turn.
    tolerance
        Stop when an iteration lowers the loss by less than this share.
    """
    best, current, done = Fit(density, (np.inf,), 0), density, 0
    filled = np.flatnonzero(density)
    places = [_Places.of(filled, target.projection) for target in targets]
    for done in range(iterations + 1):
        images = [target.renderer.image(current) for target in targets]
        losses = tuple(
            float(np.sum(target.weight[..., None] * np.square(image - target.image, dtype=np.float64)))
            for target, image in zip(targets, images, strict=True)
        )
        loss = sum(losses)
        gained = best.loss - loss
        if loss < best.loss:
            best = Fit(current, losses, done)
        if done == iterations or loss <= enough or (done > 2 and gained < tolerance * loss):
            break
        for turn, (target, place) in enumerate(zip(targets, places, strict=True)):
            image = images[0] if turn == 0 else target.renderer.image(current)
            current = _scaled(current, filled, place, target, image)
    return Fit(best.density, best.losses, done)


@dataclass(frozen=True, eq=False)
class _Places:
    """Where some voxels (n,) lie in a picture: rows, columns, and whether they are in it."""

    rows: NDArray[np.float32]
    columns: NDArray[np.float32]
    visible: NDArray[np.bool_]

    @staticmethod
    def of(voxels: NDArray[np.intp], projection: Projection) -> _Places:
        rows, columns = (values.ravel()[voxels] for values in (projection.rows, projection.columns))
        return _Places(rows, columns, projection.visible.ravel()[voxels])


def _scaled(density: Volume, filled: NDArray[np.intp], places: _Places, target: RayTarget, image: Image) -> Volume:
    """The density whose picture is nearer to a target, from the one with a picture."""
    transmittance = target.renderer.transmittance
    secant = (target.renderer.image(density * np.float32(PROBE)) - image) / np.log(PROBE)
    step = read_bilinearly(_log_scale(image, transmittance, secant, target), places.rows, places.columns)
    scaled = density.copy()
    scaled.ravel()[filled] *= np.exp(RELAXATION * np.where(places.visible, step, np.float32(0)))
    return scaled


def _log_scale(image: Image, transmittance: Image, secant: Image, target: RayTarget) -> NDArray[np.float32]:
    """Logarithm of each pixel's scale, damped and smoothed, (rows, columns)."""
    background, weight = target.background, target.weight
    clear = transmittance[..., None]
    solid = np.maximum(1 - clear, 1e-6)
    source = (image - clear * background) / solid
    contrast = background - source
    power = np.sum(contrast**2, -1)
    floor = np.mean(target.noise**2, -1)
    wanted = np.clip(np.sum((target.image - source) * contrast, -1) / (power + 1e-20), 1e-4, 1.0)
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
