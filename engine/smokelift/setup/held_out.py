"""The one judge of a light and of a model of scattering: densities of one half of the pixels, beside the other half.

A wrong light can still reproduce its own picture: before black, unshadowed smoke fits any picture by being too thin in
shadow. So densities are fitted to one colour of a chequerboard of the clip's pixels. What they let through of the
background is taken away from the other half, and the rest is light that the smoke scatters. How strong the lights have
to be for that is the least-squares factor, zero at least.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from smokelift.checks.array_types import Doubles
from smokelift.density import DensitySettings, Observation, reconstruct_density
from smokelift.density.hull import project_voxels, reached
from smokelift.render import Optics, scene_optics
from smokelift.scene import Scattering
from smokelift.setup.coarse import CoarseFrame

MIN_CHANNEL_POWER = 1e-3
"""Power of a channel's light over that of the brightest one, below which the channel has no strength of its own: its
light is lost in 8 bits."""

BLACK = np.zeros(3, np.float32)


@dataclass(frozen=True)
class HeldOut:
    """What densities show beside the other half of the pixels.

    Attributes
    ----------
    error
        Root mean square of the difference, in shares of what the smoke changes there; of several cameras the root mean
        square of theirs.
    light
        Strength of the light, in multiples of the scene's, that brings the same densities nearest: more than 1 where
        they are too dark. 1 without scattered light.
    colours : (cameras, 3)
        The same for each camera and channel alone.
    """

    error: float
    light: float = 1.0
    colours: Doubles = field(default_factory=lambda: np.ones((1, 3)))


def held_out(frames: Sequence[CoarseFrame], model: Scattering, judge: Scattering, settings: DensitySettings) -> HeldOut:
    """Fit a model's densities to one half of the pixels of all cameras, and let the judge show them to the other half.

    Only pixels that the smoke's voxels can change count.
    """
    pixels: list[list[Doubles]] = [[] for _ in frames[0].views]
    for frame in frames:
        scene = replace(frame.scene, scattering=model)
        own, *others = (Observation(view.camera, view.fitted, view.plate) for view in frame.views)
        fitted = reconstruct_density(own.image, scene, settings=settings, plate=own.plate, views=others)
        clear = Optics(scene.domain, scene.medium, (), "absorption")
        lit = replace(scene_optics(scene), scattering=judge)
        for view, of_camera in zip(frame.views, pixels, strict=True):
            behind, shown = (
                optics.renderer(view.camera, picture, fitted.hull).image(fitted.density)
                for optics, picture in ((clear, view.plate.image), (lit, BLACK))
            )
            reach = reached(view.smoke, project_voxels(view.camera, scene.domain))
            parts = shown, view.held_out - behind, view.held_out - view.plate.image
            of_camera.append(np.stack([part[reach].astype(np.float64) for part in parts]))
    # of each camera and channel: squares of the light that is shown and its products with what is seen
    power, product, wrong, contrast = (np.zeros((len(pixels), 3)) for _ in range(4))
    for camera, parts_of in enumerate(pixels):
        shown, seen, changed = np.concatenate(parts_of, 1)
        power[camera], product[camera] = np.sum(shown**2, 0), np.sum(shown * seen, 0)
        wrong[camera], contrast[camera] = np.sum((shown - seen) ** 2, 0), np.sum(changed**2, 0)
    error = float(np.sqrt(np.mean(wrong.sum(1) / np.maximum(contrast.sum(1), 1e-30))))
    if not power.sum() > 0:
        return HeldOut(error, 1.0, np.ones_like(power))
    whole = np.maximum(product.sum(1, keepdims=True) / np.maximum(power.sum(1, keepdims=True), 1e-30), 0)
    bright = power > MIN_CHANNEL_POWER * power.max(1, keepdims=True)
    colours = np.where(bright, np.maximum(product, 0) / np.maximum(power, 1e-30), whole)
    return HeldOut(error, float(product.sum() / power.sum()), colours)
