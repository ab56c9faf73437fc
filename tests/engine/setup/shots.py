"""Shots that the tests of `setup` look at."""

from dataclasses import replace
from pathlib import Path

import numpy as np

from smokelift.footage.clip import Clip
from smokelift.scene import Light, Scene, View, orbit
from smokelift.setup.prepare import prepare_shot
from smokelift.setup.settings import Settings
from smokelift.setup.shot import Shot


def shot_of(scene: Scene, settings: Settings) -> Shot:
    """Everything decided about a scene from its clip."""
    assert scene.clip is not None
    with Clip.open(scene.clip) as clip:
        return prepare_shot(clip, scene, settings)


AROUND = (0.0, 45.0, 90.0, 135.0)
"""Degrees about the smoke at which four cameras stand that see it from all sides."""


def filmed_around(plume, folder: Path, lights: tuple[Light, ...], angles: tuple[float, ...] = AROUND) -> Scene:
    """A scene without a light, of smoke that cameras at some angles filmed in one."""
    views = []
    for angle in angles:
        camera = orbit(plume.scene.camera, plume.scene.domain, angle)
        own = replace(plume.scene, camera=camera, lights=lights)
        views.append(View(camera, plume.write(folder / f"{angle:g}", plume.densities, own).clip))
    return replace(plume.scene, clip=views[0].clip, views=tuple(views[1:]), lights=())


def burning(number: int, picture: np.ndarray) -> np.ndarray:
    """A picture with a small flame where most smoke is."""
    rows, columns = np.indices(picture.shape[:2])
    row, column = np.unravel_index(np.argmax(picture.sum(-1)), rows.shape)
    flame = np.exp(-(((rows - row) / 2) ** 2) - ((columns - column) / 2) ** 2)[..., None]
    return picture + np.float32((1, 0.4, 0.08)) * flame.astype(np.float32)
