"""Smoke on a turntable, lit, before black: the pictures in which it is compared from all around."""

from dataclasses import replace

import numpy as np
import numpy.typing as npt

from smokelift.density.turntable import Turntable
from smokelift.render import Image, Volume, scene_optics
from smokelift.scene import Camera, CompleteScene, FiniteLight, PointLight
from smokelift.transport import Array

GAMMA = 2.2
"""Exponent of the gray values: differences count as they are seen."""


class Orbit:
    """Renders densities of one scene from all azimuths about the vertical; 0 is the camera's, orthographic.

    Smoke that no light makes brighter is shown by what it takes from white light behind it. The scene's background does
    not count. With `lights_turn` the lights go around with the camera, so that every azimuth is lit as the front is.
    """

    def __init__(self, scene: CompleteScene, *, lights_turn: bool = False) -> None:
        self.table = Turntable.facing(scene.camera.at(0), scene.domain)
        self._optics = scene_optics(scene)
        self._shines = scene.scattering != "absorption" and bool(self._optics.unshadowed_source().max() > 0)
        self._lights_turn = lights_turn

    def image(self, density: Volume, degrees: float, rows: int | None = None) -> Image:
        """Render a density (nx, ny, nz), by default at one pixel per voxel; linear radiance (rows, columns, 3)."""
        camera = self.table.camera(degrees)
        if rows is not None:
            columns = round(camera.size[0] * rows / camera.size[1])
            camera = camera.resized(columns, rows)
        optics = self._optics
        if self._lights_turn:
            optics = replace(optics, lights=tuple(self._turned(light, camera) for light in optics.lights))
        behind = np.full(3, 0 if self._shines else 1, np.float32)
        return optics.renderer(camera, behind).image(density)

    def picture(self, density: Volume, degrees: float) -> Array:
        """Render a density (nx, ny, nz) at one pixel per voxel as gray values (rows, columns) before black."""
        image = self.image(density, degrees)
        return gray(image if self._shines else 1 - image)

    def _turned(self, light: FiniteLight, camera: Camera) -> FiniteLight:
        """Return a light that stands to a camera as it does to the front's."""
        turn: npt.NDArray[np.float64] = _axes(camera) @ _axes(self.table.camera(0)).T
        if isinstance(light, PointLight):
            center = np.array(self._optics.domain.centre)
            x, y, z = (center + turn @ (np.array(light.position) - center)).tolist()
            return replace(light, position=(x, y, z))
        x, y, z = (turn @ np.array(light.direction)).tolist()
        return replace(light, direction=(x, y, z))


def gray(image: Image) -> Array:
    """Return linear radiance (rows, columns, 3) as gray values (rows, columns)."""
    return np.asarray(np.maximum(image.mean(-1), 0) ** (1 / GAMMA), np.float32)


def _axes(camera: Camera) -> npt.NDArray[np.float64]:
    return np.array(camera.matrix)[:3, :3]
