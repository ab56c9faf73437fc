"""What a camera sees behind the smoke: one colour, or a clean plate read from disk."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from smokelift.footage import images
from smokelift.footage.plate import open_plates
from smokelift.scene import Camera, CompleteScene, Scene


def background_picture(scene: Scene | CompleteScene, camera: Camera | None = None) -> NDArray[np.float32]:
    """Return the background as a camera sees it.

    A clean plate belongs to the scene's own camera, so before another camera its mean colour takes its place. Of a
    plate that changes from frame to frame, it is the clip's first frame.

    Parameters
    ----------
    scene
        Without a background it is black.
    camera
        By default the scene's own.

    Returns
    -------
    (rows, columns, 3) or (3,) float32
        Linear radiance; (3,) where it is one colour.

    Raises
    ------
    ImageError, ClipError
        If the clean plate cannot be read.
    """
    background = scene.background
    if background is not None and background.color is not None:
        return np.array(background.color, np.float32)
    if background is None or background.image is None:
        return np.zeros(3, np.float32)
    plates = open_plates(scene)
    if plates is None:
        picture = images.read_image(background.image)
    else:
        picture = plates.frame(scene.clip.first if scene.clip is not None else 0)
    if camera is not None and camera != scene.camera:
        return np.asarray(picture.reshape(-1, 3).mean(0))
    width, height = scene.camera.size if scene.camera else picture.shape[1::-1]
    return images.area_average(picture, width, height)
