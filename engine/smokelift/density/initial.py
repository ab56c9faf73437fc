"""The first guess of a frame: its picture's own, and as much of the density carried along as proves right.

A picture alone gives the static guess: an amount of smoke on every ray, spread over the depth by a profile. The density
carried along from the frame before knows of amounts that the renderer has corrected for shadows already, and of
structures along the rays. Both are judged before any correction, by E, the squared difference between the picture and
what a density renders to:

    amounts  as far as carried beats the static guess:  AMOUNTS * (1 - E(carried) / (E(static) + noise))
    depth    as far as its motion has been understood:  most    * (1 - E(carried) / (E(before) + noise))

and never below zero. `before` is the density of the frame before, left where it was: the skill that weather forecasts
are measured by. A wrong velocity is no better than none, and nothing is taken over. The share of the depth falls as
well where carried's changes along the rays, beside those across, are less like smoke's than the static guess's: wrong
velocities draw smoke out, or crumple it.

Amounts are mixed in logarithms and by a third at most: what no picture corrects (in thick smoke, in shadow) would else
grow from frame to frame without bound.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from smokelift.density.anisotropy import depth_anisotropy
from smokelift.density.hull import project_voxels
from smokelift.density.screen import view_frame
from smokelift.footage.plate import Plate, noise_at
from smokelift.render import Renderer, scene_lights
from smokelift.render.renderer import Image, Volume
from smokelift.scene import Medium, Scattering, Scene

AMOUNTS = 0.35
"""Largest share of carried's amounts. With all of them new views gain 0.05 dB, but the mass in what no picture shows
grows by a fifth in 24 frames, and on; with a half the smoke of a height may change by more than a tenth."""

LARGEST_CHANGE = 3.0
"""Of a ray's amount, either way."""

FAINT = 0.02
"""Optical depth, beside the largest, below which carried says nothing about amounts."""

UNLIKE_SMOKE = 0.3
"""Departure of the depth anisotropy from 1 that true smoke does not reach: 0.87 to 1.15 on four scenes at two
resolutions."""

WORST = 1.5
"""Departure of carried's depth anisotropy from 1, beside the static guess's, from which nothing is taken over. Up to 1
all is; a threshold instead would make smoke flicker."""


@dataclass(frozen=True, eq=False)
class Guess:
    """Where the fit of a frame starts.

    Attributes
    ----------
    density : (nx, ny, nz) float32
    figures
        ``share`` of the density that was carried along and ``amounts``, the share of its amounts; what decided them:
        ``loss_static``, ``loss_carried`` and ``loss_before`` (sums of squares over the picture, linear radiance),
        ``anisotropy_static`` and ``anisotropy_carried``.
    """

    density: Volume
    figures: Mapping[str, float]


def first_guess(
    image: Image,
    scene: Scene,
    plate: Plate,
    scattering: Scattering,
    static: Volume,
    carried: Volume,
    before: Volume,
    most: float,
) -> Guess:
    """Mix the static guess with what was carried along, as far as the picture bears it out.

    Parameters
    ----------
    image : (rows, columns, 3)
        Linear radiance.
    scene
        With the picture's camera and the domain.
    plate
        What is behind the smoke, and the picture's noise.
    scattering
        How light is scattered.
    static, carried, before : (nx, ny, nz)
        The picture's own guess, the density carried along, and that of the frame before as it was.
    most
        Largest share of `carried`, 0 to 1.
    """
    if not (static.any() and carried.any()):
        return Guess(static, {"share": 0.0, "amounts": 0.0})
    assert scene.camera is not None and scene.domain is not None
    somewhere = (static > 0) | (carried > 0) | (before > 0)
    lights, medium = scene_lights(scene), scene.medium or Medium()
    renderer = Renderer(scene.camera, scene.domain, medium, lights, plate.image, scattering, somewhere)

    def look(density: Volume) -> tuple[float, Image]:
        """Squared difference from the picture, and optical depths."""
        difference = renderer.image(density) - image
        depth = -np.log(np.maximum(renderer.transmittance, np.finfo(np.float32).tiny))
        return float(np.sum(np.square(difference, dtype=np.float64))), depth

    (loss_static, depth_static), (loss_carried, depth_carried) = look(static), look(carried)
    loss_before, _ = look(before)
    noise = float(np.sum(np.square(noise_at(image, plate), dtype=np.float64)))
    along = int(np.argmax(np.abs(view_frame(scene.camera)[1])))
    anisotropy_static, anisotropy_carried = (depth_anisotropy(each, along) for each in (static, carried))
    amounts = AMOUNTS * _better(loss_carried, loss_static + noise)
    unlike = _departure(anisotropy_carried) / _departure(anisotropy_static)
    share = most * _better(loss_carried, loss_before + noise) * float(np.clip((WORST - unlike) / (WORST - 1), 0, 1))
    guess = _with_amounts(static, scene, depth_static, depth_carried, amounts)
    return Guess(
        np.float32(1 - share) * guess + np.float32(share) * carried,
        {
            "share": share,
            "amounts": amounts,
            "loss_static": loss_static,
            "loss_carried": loss_carried,
            "loss_before": loss_before,
            "anisotropy_static": anisotropy_static,
            "anisotropy_carried": anisotropy_carried,
        },
    )


def _better(loss: float, other: float) -> float:
    """By what part of another loss this one is lower; 0 where it is not."""
    return max(0.0, 1 - loss / other) if other > 0 else 0.0


def _departure(anisotropy: float) -> float:
    """From 1, beyond what is usual; what changes along the rays only (a picture full of even fog) has no end."""
    return float(np.clip(abs(anisotropy - 1), UNLIKE_SMOKE, 100.0))


def _with_amounts(
    static: Volume, scene: Scene, have: NDArray[np.float32], want: NDArray[np.float32], share: float
) -> Volume:
    """The static guess, its rays changed from the optical depths (rows, columns) that they have towards others."""
    assert scene.camera is not None and scene.domain is not None
    faint = FAINT * want.max()
    change = np.log(np.clip((want + faint) / (have + faint), 1 / LARGEST_CHANGE, LARGEST_CHANGE))
    # where carried has nothing it knows of nothing: smoke may have come in
    step = share * change * want / (want + faint)
    # one pixel's blur keeps neighbouring rays from fighting over the voxels that they share
    step = ndimage.gaussian_filter(step.astype(np.float32), 0.7)
    smoky = static > 0
    changed = static.copy()
    changed[smoky] *= np.exp(project_voxels(scene.camera, scene.domain).read(step, smoky))
    return changed
