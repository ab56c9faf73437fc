"""The background that a scene gives, read from disk: one colour, a clean plate, or one clean plate a frame."""

from __future__ import annotations

import numpy as np

from smokelift.footage.clip import Clip, is_video
from smokelift.footage.images import Picture, area_average, read_image
from smokelift.footage.plate import Plates, changing_plate, known_plate
from smokelift.scene import Camera, CompleteScene, Scene


def open_plates(scene: Scene | CompleteScene) -> Clip | None:
    """Open a scene's clean plate as a clip if it changes from frame to frame, and return None if it does not.

    Its frames are counted as those of the clip's file. A numbered picture stands for itself before a still camera, and
    for the sequence that it begins before one that moves.

    Raises
    ------
    ClipError
        If it cannot be read.
    """
    image = scene.background.image if scene.background is not None else None
    moves = scene.camera is not None and scene.camera.moves
    if image is None or not (moves or "#" in image.name or is_video(image)):
        return None
    return Clip.open(image)


def given_plates(scene: Scene | CompleteScene, clip: Clip) -> Plates | None:
    """Return the background of every frame of a clip as its scene gives it; None if it has to be estimated.

    Parameters
    ----------
    scene
        For its background, and for whether its camera moves.
    clip
        The footage that its camera took.

    Raises
    ------
    ClipError, ImageError
        If a picture or a frame cannot be read.
    ValueError
        If there are fewer plates than frames.
    """
    plates = open_plates(scene)
    if plates is not None:
        return changing_plate(plates, clip)
    background = scene.background
    if background is None:
        return None
    if background.image is not None:
        return known_plate(read_image(background.image), clip)
    return None if background.color is None else known_plate(background.color, clip)


def background_picture(scene: Scene | CompleteScene, camera: Camera | None = None) -> Picture:
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
        picture = read_image(background.image)
    else:
        with plates:
            picture = plates.frame(scene.clip.first if scene.clip is not None else 0)
    if camera is not None and camera != scene.camera:
        return np.asarray(picture.reshape(-1, 3).mean(0))
    width, height = scene.camera.size if scene.camera else picture.shape[1::-1]
    return area_average(picture, width, height)
