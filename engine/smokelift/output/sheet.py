"""Tiles side by side on one picture, with their names."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from PIL import Image, ImageDraw

from smokelift.output.atomic import atomic_path

Tile = NDArray[np.uint8]

_GAP, _LINE = 4, 16
"""Pixels between tiles, and of a line of text."""


def write_sheet(path: Path, rows: Sequence[Sequence[Tile]], titles: Sequence[str], labels: Sequence[str]) -> None:
    """Write rows of tiles as a PNG.

    Parameters
    ----------
    path
        The file, whatever its suffix.
    rows
        sRGB tiles (rows, columns, 3) of one height, as wide as the others in their column.
    titles
        Above the columns.
    labels
        Above the rows.
    """
    height = rows[0][0].shape[0]
    lefts = _GAP + np.cumsum([0, *(tile.shape[1] + _GAP for tile in rows[0])])
    whole = Image.new("RGB", (int(lefts[-1]), _LINE + len(rows) * (height + _LINE + _GAP)), (32, 32, 32))
    draw = ImageDraw.Draw(whole)
    for title, left in zip(titles, lefts, strict=False):
        draw.text((left, 2), title, fill=(230, 230, 230))
    for row, (tiles, label) in enumerate(zip(rows, labels, strict=True)):
        top = _LINE + row * (height + _LINE + _GAP)
        draw.text((_GAP, top + 2), label, fill=(170, 170, 170))
        for tile, left in zip(tiles, lefts, strict=False):
            whole.paste(Image.fromarray(tile), (int(left), top + _LINE))
    with atomic_path(path) as aside:
        whole.save(aside, format="PNG")
