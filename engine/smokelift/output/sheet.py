"""Tiles side by side on one picture, with their names."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from PIL import Image, ImageDraw

from smokelift.output.atomic import atomic_path

Tile = NDArray[np.uint8]

GAP = 4
"""Pixels between tiles."""

_LINE = 16
"""Pixels of a line of text."""


def write_sheet(path: Path, rows: Sequence[Sequence[Tile]], titles: Sequence[str], labels: Sequence[str]) -> None:
    """Write rows of tiles as a PNG, whatever the file's suffix, with titles above columns and labels above rows.

    Tiles are sRGB (rows, columns, 3), of one height in a row, and as wide as those of the first row or across all
    columns.
    """
    lefts = GAP + np.cumsum([0, *(tile.shape[1] + GAP for tile in rows[0])])
    tops = _LINE + np.cumsum([0, *(tiles[0].shape[0] + _LINE + GAP for tiles in rows)])
    whole = Image.new("RGB", (int(lefts[-1]), int(tops[-1])), (32, 32, 32))
    draw = ImageDraw.Draw(whole)
    for title, left in zip(titles, lefts, strict=False):
        draw.text((left, 2), title, fill=(230, 230, 230))
    for top, tiles, label in zip(tops, rows, labels, strict=False):
        draw.text((GAP, top + 2), label, fill=(170, 170, 170))
        for tile, left in zip(tiles, lefts, strict=False):
            whole.paste(Image.fromarray(tile), (int(left), int(top) + _LINE))
    with atomic_path(path) as aside:
        whole.save(aside, format="PNG")
