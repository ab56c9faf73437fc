"""What a camera sees of a density in a scene: the one way in which results are rendered."""

from functools import cached_property

import numpy as np

from smokelift.checks import require_kind
from smokelift.extraction.given_background import background_picture, behind, open_plates
from smokelift.render import Image, Renderer, Volume, scene_optics
from smokelift.render.emission import emitted
from smokelift.scene import Camera, CompleteScene, shared_part


class Viewer:
    """Renders the frames of a sequence for one camera; where nothing moves, one renderer serves all of them.

    By default that is the scene's own camera, before the scene's background;
    `smokelift.extraction.given_background.behind` says what another camera sees of a clean plate. A background that is
    given, (rows, columns, 3) or (3,), is linear radiance.
    """

    def __init__(self, scene: CompleteScene, camera: Camera | None = None, background: Image | None = None) -> None:
        require_kind(camera, Camera | None, "camera", "a Camera")
        self._scene, self._camera = scene, camera or scene.camera
        self._optics = scene_optics(scene)
        self._plates = open_plates(scene.background, scene.camera) if background is None else None
        self._first = scene.clip.first if scene.clip is not None else 0
        self._given = background
        self._moves = self._plates is not None or scene.camera.moves or self._camera.moves
        self._renderers: dict[int, Renderer] = {}

    def image(self, number: int, density: Volume, flame: Volume | None = None) -> Image:
        """Render a density (nx, ny, nz) as a frame, from 1; linear radiance (rows, columns, 3).

        The light of a flame (nx, ny, nz), radiance per meter, is added; that the smoke is lit by it is not shown.
        """
        frame = number - 1 if self._moves else 0
        if frame not in self._renderers:
            renderer = self._optics.renderer(self._camera.at(frame), self.background(frame + 1))
            self._renderers = {frame: renderer}
        image = self._renderers[frame].image(density)
        color = self._scene.medium.flame_color
        if flame is None or color is None:
            return image
        light = emitted(flame, density, self._camera.at(frame), self._optics)
        return np.asarray(image + light[..., None] * np.array(color, np.float32))

    def background(self, number: int) -> Image:
        """What is behind the smoke in a frame, from 1; linear radiance (rows, columns, 3) or (3,)."""
        if self._given is not None:
            return self._given
        frame = number - 1
        own, camera = self._scene.camera.at(frame), self._camera.at(frame)
        if self._plates is None or shared_part(own, camera) is None:
            return self._steady
        return behind(self._plates.frame(self._first + frame), own, camera)

    @cached_property
    def _steady(self) -> Image:
        """What is behind the smoke in all frames where the frame's own plate is not seen."""
        return background_picture(self._scene, self._camera.at(0))
