"""Pictures of runs beside the truth from where no camera stands: a page of orbits, and strips from the side."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from benchmarks.accuracy.scenes import KnownScene
from benchmarks.accuracy.score import SIDE, around, known_densities
from benchmarks.baked import BLACK
from smokelift.evaluation.orbit import Orbit
from smokelift.evaluation.orbit_page import orbit_curves, orbit_tiles, write_orbit_page
from smokelift.evaluation.orbit_scores import AZIMUTHS
from smokelift.footage.images import area_average
from smokelift.output.images import Tile, eight_bit
from smokelift.render import Image, scene_renderer

STRIP_FRAMES = 8

Row = tuple[str, list[Tile]]
"""A label, and sRGB tiles of one size."""


def write_orbits(known: KnownScene, runs: list[str], folder: Callable[[KnownScene, str], Path], path: Path) -> None:
    """Write a late moment of the truth and of some runs from all around, with their scores; only what has densities."""
    frame = known.scored[3 * (len(known.scored) - 1) // 4]
    rows: dict[str, list[Tile]] = {}
    curves: dict[str, list[float | None]] = {}
    for run in dict.fromkeys(["truth", *runs]):
        if (densities := known_densities(known, run, folder(known, run))) is not None:
            label = f"{known.name}, frame {frame}: {run}"
            rows[label] = orbit_tiles(Orbit(densities.scene), densities.of_frame(frame))
            if run != "truth":
                curves |= orbit_curves(around(known, densities), run)
    write_orbit_page(path, rows, AZIMUTHS, curves)


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


def _tile(picture: Image) -> Tile:
    rows, columns = picture.shape[:2]
    return eight_bit(area_average(picture, columns // 2, rows // 2))
