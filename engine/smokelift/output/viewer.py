"""What a camera sees of a density in a scene: the one way in which results are rendered."""

from __future__ import annotations

import numpy as np

from smokelift.footage.background import background_picture, open_plates
from smokelift.footage.images import area_average
from smokelift.render import Image, Renderer, Volume, scene_optics
from smokelift.scene import Camera, CompleteScene, shared_part


class Viewer:
    """Renders the frames of a sequence for one camera; where nothing moves, one renderer serves all of them.

    A clean plate belongs to the scene's own camera. A camera at the same place that shows a part of that picture, at
    whatever resolution, has that part of the plate behind the smoke. Any other camera has the plate's mean colour.

    Parameters
    ----------
    scene
        What is rendered.
    camera
        By default the scene's own.
    background : (rows, columns, 3) or (3,), optional
        Linear radiance behind the smoke in place of the scene's.
    """

    def __init__(self, scene: CompleteScene, camera: Camera | None = None, background: Image | None = None) -> None:
        self._scene, self._camera = scene, camera or scene.camera
        self._optics = scene_optics(scene)
        self._plates = open_plates(scene.background, scene.camera) if background is None else None
        self._first = scene.clip.first if scene.clip is not None else 0
        self._given = background
        self._picture = background_picture(scene) if background is None else background
        self._moves = self._plates is not None or scene.camera.moves or self._camera.moves
        self._renderers: dict[int, Renderer] = {}

    def image(self, number: int, density: Volume) -> Image:
        """Render a density (nx, ny, nz) as a frame, from 1; linear radiance (rows, columns, 3)."""
        frame = number - 1 if self._moves else 0
        if frame not in self._renderers:
            renderer = self._optics.renderer(self._camera.at(frame), self._behind(frame))
            self._renderers = {frame: renderer}
        return self._renderers[frame].image(density)

    def background(self, number: int) -> Image:
        """What is behind the smoke in a frame, from 1; linear radiance (rows, columns, 3) or (3,)."""
        return self._behind(number - 1)

    def _behind(self, frame: int) -> Image:
        if self._given is not None:
            return self._given
        own = self._scene.camera
        part = shared_part(own.at(frame), self._camera.at(frame))
        picture = self._picture
        if part is not None and self._plates is not None:
            picture = area_average(self._plates.frame(self._first + frame), *own.size)
        if picture.ndim == 1:
            return picture
        if part is None:
            return np.asarray(picture.mean(axis=(0, 1)))
        return area_average(picture[part], *self._camera.size)
