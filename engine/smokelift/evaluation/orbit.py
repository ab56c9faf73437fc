"""Smoke on a turntable, lit, before black: the pictures in which it is compared from all around, and a page of them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
from PIL import Image as Pillow
from PIL import ImageDraw

from smokelift.density.turntable import Turntable
from smokelift.output.images import GAP, Tile, eight_bit, write_sheet
from smokelift.render import Image, Volume, scene_optics
from smokelift.scene import Camera, CompleteScene, FiniteLight, PointLight
from smokelift.transport import Array

GAMMA = 2.2
"""Exponent of the gray values: differences count as they are seen."""

DEGREES = tuple(range(0, 180, 18))
"""Azimuths of the columns."""

TITLES = tuple(f"{degrees}\N{DEGREE SIGN}" for degrees in DEGREES)

TILE_ROWS, CURVE_ROWS = 240, 180
"""Pixels."""

COLORS = ((240, 170, 60), (90, 170, 250), (120, 220, 120), (240, 110, 180), (180, 140, 250))
"""Colors of the curves, in order."""

GRAY = (120, 120, 120)


class Orbit:
    """Renders densities of one scene from all azimuths about the vertical; 0 is the camera's, orthographic.

    Smoke that no light makes brighter is shown by what it takes from white light behind it. The scene's background does
    not count. With `lights_turn` the lights go around with the camera, so that every azimuth is lit as the front is.
    """

    def __init__(self, scene: CompleteScene, *, lights_turn: bool = False) -> None:
        self.table = Turntable.before(scene.camera.at(0), scene.domain)
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


def orbit_tiles(orbit: Orbit, density: Volume) -> list[Tile]:
    """Return sRGB tiles (rows, columns, 3) of a density from `DEGREES`."""
    return [eight_bit(orbit.image(density, degrees, TILE_ROWS)) for degrees in DEGREES]


def orbit_curves(scores: Mapping[str, Any], name: str) -> dict[str, list[float | None]]:
    """Return the curves of some `orbit_scores`: of the sequence, and of the reference itself."""
    curves = {f"{name}: patches": scores["patches_by_azimuth"]}
    own = scores["patches_own_by_azimuth"] or len(scores["azimuths"]) * [scores["patches_own"]]
    return curves | {f"{scores['reference']}: patches, own": own}


def write_orbit_page(
    path: Path,
    rows: Mapping[str, Sequence[Tile]],
    azimuths: Sequence[float],
    curves: Mapping[str, Sequence[float | None]],
) -> None:
    """Write rows of `orbit_tiles` by their labels, and curves over azimuths (degrees) below them, as a PNG."""
    widths = [tile.shape[1] for tile in next(iter(rows.values()))]
    curve = _drawn(sum(widths) + GAP * (len(widths) - 1), azimuths, curves)
    write_sheet(path, [*rows.values(), [curve]], TITLES, [*rows, "patches by azimuth: 0 is the reference's texture"])


def _drawn(width: int, azimuths: Sequence[float], curves: Mapping[str, Sequence[float | None]]) -> Tile:
    """A tile with curves from 0 up, their names, and the scales of both axes; azimuths lie below their columns."""
    known = [value for values in curves.values() for value in values if value is not None]
    top = 1.15 * max(known, default=1.0) or 1.0
    picture = Pillow.new("RGB", (width, CURVE_ROWS), (16, 16, 16))
    draw = ImageDraw.Draw(picture)
    column = width / len(DEGREES)

    def place(degrees: float, value: float) -> tuple[float, float]:
        return column * (degrees / DEGREES[1] + 0.5), (CURVE_ROWS - 4) * (1 - value / top)

    step = 10 ** np.floor(np.log10(top / 2))
    step *= max(factor for factor in (1, 2, 5) if factor * step <= top / 2)
    for value in np.arange(0, top, step):
        height = place(0, value)[1]
        draw.line([(0, height), (width, height)], fill=(50, 50, 50))
        draw.text((2, height - 12), f"{value:g}", fill=GRAY)
    for index, (name, values) in enumerate(curves.items()):
        color = COLORS[index % len(COLORS)]
        points = [place(at, value) for at, value in zip(azimuths, values, strict=True) if value is not None]
        for ends in pairwise(points):
            draw.line(ends, fill=color, width=2)
        draw.text((column, 2 + 12 * index), name, fill=color)
    return np.asarray(picture)
