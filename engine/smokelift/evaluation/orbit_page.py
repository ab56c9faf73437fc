"""One page of orbits: a moment of each density from ten azimuths, and how far each is from smoke by azimuth."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
from PIL import Image as Pillow
from PIL import ImageDraw

from smokelift.evaluation.orbit import Orbit
from smokelift.output.images import GAP, Tile, eight_bit, write_sheet
from smokelift.render import Volume

DEGREES = tuple(range(0, 180, 18))
"""Azimuths of the columns."""

TITLES = tuple(f"{degrees}\N{DEGREE SIGN}" for degrees in DEGREES)

TILE_ROWS, CURVE_ROWS = 240, 180
"""Pixels."""

COLOURS = ((240, 170, 60), (90, 170, 250), (120, 220, 120), (240, 110, 180), (180, 140, 250))
"""Colours of the curves, in order."""

GREY = (120, 120, 120)


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
        draw.text((2, height - 12), f"{value:g}", fill=GREY)
    for index, (name, values) in enumerate(curves.items()):
        colour = COLOURS[index % len(COLOURS)]
        points = [place(at, value) for at, value in zip(azimuths, values, strict=True) if value is not None]
        for ends in pairwise(points):
            draw.line(ends, fill=colour, width=2)
        draw.text((column, 2 + 12 * index), name, fill=colour)
    return np.asarray(picture)
