"""Pictures of runs beside the truth from where no camera stands: orbits of one moment, and strips from the side."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import numpy.typing as npt

from benchmarks.accuracy.scenes import KnownScene
from benchmarks.accuracy.score import BLACK, FRONT, SIDE, known_densities
from smokelift.footage.images import area_average
from smokelift.output.images import eight_bit
from smokelift.output.sheet import write_sheet
from smokelift.render import Image, scene_renderer
from smokelift.scene import orbit

ORBIT_ANGLES = range(0, 360, 30)
"""Degrees."""

STRIP_FRAMES = 8

Row = tuple[str, list[npt.NDArray[np.uint8]]]
"""A label, and sRGB tiles of one size."""


def orbit_rows(known: KnownScene, runs: list[str], folder: Callable[[KnownScene, str], Path]) -> list[Row]:
    """Return a late moment of the truth and of some runs from twelve angles; only what has densities is there."""
    frame = known.scored[3 * (len(known.scored) - 1) // 4]
    rows = []
    for run in dict.fromkeys(["truth", *runs]):
        if (densities := known_densities(known, run, folder(known, run))) is None:
            continue
        scene, density = densities.scene, densities.of_frame(frame)
        cameras = [orbit(known.cameras[FRONT], scene.domain, angle) for angle in ORBIT_ANGLES]
        pictures = [scene_renderer(scene, camera, BLACK).image(density) for camera in cameras]
        rows.append((f"{known.name}, frame {frame}: {run}", [_tile(picture) for picture in pictures]))
    return rows


def strip_rows(known: KnownScene, runs: list[str], folder: Callable[[KnownScene, str], Path]) -> list[Row]:
    """Return consecutive frames from the side, as the side's camera saw them and of some runs that have densities."""
    last = min(len(known.scored), 3 * (len(known.scored) - 1) // 4 + STRIP_FRAMES // 2)
    frames = known.scored[max(0, last - STRIP_FRAMES) :][:STRIP_FRAMES]
    about = f"{known.name}, frames {frames[0]} to {frames[-1]}"
    rows = [(f"{about}: truth", [_tile(known.seen(SIDE, frame)) for frame in frames])]
    for run in runs:
        if run == "truth" or (densities := known_densities(known, run, folder(known, run))) is None:
            continue
        renderer = scene_renderer(densities.scene, known.cameras[SIDE], BLACK)
        rows.append((f"{about}: {run}", [_tile(renderer.image(densities.of_frame(frame))) for frame in frames]))
    return rows


def write_rows(path: Path, rows: list[Row], titles: list[str]) -> None:
    """Write rows below each other as a PNG."""
    write_sheet(path, [tiles for _, tiles in rows], titles, [label for label, _ in rows])


def _tile(picture: Image) -> npt.NDArray[np.uint8]:
    rows, columns = picture.shape[:2]
    return eight_bit(area_average(picture, columns // 2, rows // 2))
