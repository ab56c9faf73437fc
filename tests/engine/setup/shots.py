"""Shots that the tests of `setup` look at."""

import numpy as np

from smokelift import Clip, Scene, Settings, Shot, prepare_shot
from smokelift.setup.first_estimate import first_estimate
from smokelift.setup.geometry import Geometry, find_geometry


def shot_of(scene: Scene, settings: Settings) -> Shot:
    """Everything decided about a scene from its clip."""
    with Clip.open(scene.clip) as clip:
        return prepare_shot(clip, scene, settings)


def geometry_of(scene: Scene, settings: Settings) -> Geometry:
    """Camera, box and resolution of a scene from its clip."""
    with Clip.open(scene.clip) as clip:
        return find_geometry(scene, first_estimate(clip, scene.camera, scene.background), settings)


def burning(number: int, picture: np.ndarray) -> np.ndarray:
    """A picture with a small flame where most smoke is."""
    rows, columns = np.indices(picture.shape[:2])
    row, column = np.unravel_index(np.argmax(picture.sum(-1)), rows.shape)
    flame = np.exp(-(((rows - row) / 2) ** 2) - ((columns - column) / 2) ** 2)[..., None]
    return picture + np.float32((1, 0.4, 0.08)) * flame.astype(np.float32)
