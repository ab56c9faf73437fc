"""A page of pictures and facts, as a picture or as HTML that needs no other file."""

import base64
import html
import io
import itertools
import textwrap
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from PIL import Image, ImageDraw, ImageFont

from smokelift.checks import UNDETERMINED, Finding
from smokelift.checks.whole_files import atomic_path, write_text
from smokelift.report.sentences import fact, sentence

Color = tuple[int, int, int]
"""Codes (sRGB) of red, green and blue."""

PAGE_KINDS = (".png", ".html")

TILE = (480, 400)
"""Largest width and height of a picture on the page, in pixels."""

COLUMNS = 3
"""Pictures side by side."""

_GAP, _TEXT, _TITLE, _LINE = 16, 14, 22, 20
"""Pixels between parts, of two fonts, and from line to line."""

_WIDTH = COLUMNS * TILE[0] + (COLUMNS + 1) * _GAP
"""Width of the page, in pixels (by definition)."""
_STARTS = (_GAP, 170, 520, 670)
"""Left edges of the columns of the table, in pixels."""

PNG_COMPRESSION = 2
"""Compression level of PNG files: half of the time of the usual 6, and a seventh more bytes."""

_PAPER, _INK, _FAINT, _UNKNOWN = (26, 26, 28), (232, 232, 232), (165, 165, 165), (255, 170, 70)
"""Colors (sRGB codes) of the page, of its text, of faint text and of what is unknown."""


@dataclass(frozen=True, eq=False)
class Panel:
    """A picture (rows, columns, 3) in sRGB codes, with its title."""

    title: str
    picture: NDArray[np.uint8]


@dataclass(frozen=True, eq=False)
class Page:
    """A page, from top to bottom; `facts` are the lines of a table."""

    title: str
    doubts: Sequence[Finding]
    panels: Sequence[Panel]
    facts: Sequence[Finding]
    notes: Sequence[Finding]


def write_page(path: Path, page: Page) -> None:
    """Write a page as the suffix says, one of `PAGE_KINDS`. It appears whole or not at all."""
    if path.suffix.lower() == ".html":
        write_text(path, _as_html(page))
        return
    with atomic_path(path) as aside:
        _as_picture(page).save(aside, format="PNG", compress_level=PNG_COMPRESSION)


def tile_size(width: int, height: int) -> tuple[int, int]:
    """Return width and height of a picture on the page, in pixels."""
    scale = min(TILE[0] / width, TILE[1] / height)
    return max(1, round(width * scale)), max(1, round(height * scale))


def _as_picture(page: Page) -> Image.Image:
    rows = [page.panels[first : first + COLUMNS] for first in range(0, len(page.panels), COLUMNS)]
    strips = [
        _written([page.title], [_INK], _TITLE),
        *(_written([sentence(doubt)], [_UNKNOWN]) for doubt in page.doubts),
        *map(_side_by_side, rows),
        *(_table_row(fact(line)) for line in page.facts),
        *(_written([sentence(note)], [_FAINT]) for note in page.notes),
    ]
    space = np.full((_GAP, _WIDTH, 3), _PAPER, np.uint8)
    return Image.fromarray(np.vstack([space, *strips, space]))


def _table_row(line: Mapping[str, str]) -> NDArray[np.uint8]:
    cells = [line[name] for name in ("what", "value", "origin", "how")]
    return _written(cells, [_FAINT, _INK, _UNKNOWN if line["origin"] == UNDETERMINED else _FAINT, _FAINT])


def _side_by_side(panels: Sequence[Panel]) -> NDArray[np.uint8]:
    """Pictures with their titles above them."""
    height = max(panel.picture.shape[0] for panel in panels) + _LINE + _GAP
    strip = Image.new("RGB", (_WIDTH, height), _PAPER)
    for column, panel in enumerate(panels):
        left = _GAP + column * (TILE[0] + _GAP)
        ImageDraw.Draw(strip).text((left, 0), panel.title, _FAINT, ImageFont.load_default(_TEXT))
        strip.paste(Image.fromarray(panel.picture), (left, _LINE))
    return np.asarray(strip)


def _written(cells: Sequence[str], colors: Sequence[Color], size: int = _TEXT) -> NDArray[np.uint8]:
    """One text over the whole width, or those of a table's columns."""
    font = ImageFont.load_default(size)
    starts = _STARTS if len(cells) > 1 else (_GAP,)
    letters = [int((end - start - _GAP) / font.getlength("n")) for start, end in itertools.pairwise((*starts, _WIDTH))]
    wrapped = [textwrap.wrap(cell, width) for cell, width in zip(cells, letters, strict=True)]
    height = max(map(len, wrapped)) * (size + _LINE - _TEXT) + _LINE // 3
    strip = Image.new("RGB", (_WIDTH, height), _PAPER)
    for lines, color, left in zip(wrapped, colors, starts, strict=True):
        ImageDraw.Draw(strip).text((left, 0), "\n".join(lines), color, font, spacing=_LINE - _TEXT)
    return np.asarray(strip)


_STYLE = """
body { background: #1a1a1c; color: #e8e8e8; font: 15px sans-serif; margin: 1.5em }
figure { display: inline-block; margin: 0 1em 1em 0; vertical-align: top }
figcaption, .how, p { color: #a5a5a5 }
td { padding: .25em 1em .25em 0; vertical-align: top }
.undetermined, p.warning { color: #ffaa46 }
"""


def _as_html(page: Page) -> str:
    title = html.escape(page.title)
    figures = "".join(
        f'<figure><figcaption>{html.escape(panel.title)}</figcaption><img alt="" src="{_data(panel.picture)}"></figure>'
        for panel in page.panels
    )
    row = '<tr><td>{what}</td><td>{value}</td><td class="{origin}">{origin}</td><td class="how">{how}</td></tr>\n'
    lines = [{name: html.escape(words) for name, words in fact(line).items()} for line in page.facts]
    table = "".join(map(row.format_map, lines))
    doubts = "".join(f'<p class="warning">{html.escape(sentence(doubt))}</p>\n' for doubt in page.doubts)
    notes = "".join(f"<p>{html.escape(sentence(note))}</p>\n" for note in page.notes)
    return (
        f'<!DOCTYPE html>\n<html lang="en"><head><meta charset="utf-8"><title>{title}</title><style>{_STYLE}</style>'
        f"</head><body>\n<h1>{title}</h1>\n{doubts}{figures}\n<table>\n{table}</table>\n{notes}</body></html>\n"
    )


def _data(picture: NDArray[np.uint8]) -> str:
    """A picture as a data URL."""
    file = io.BytesIO()
    Image.fromarray(picture).save(file, format="PNG", compress_level=PNG_COMPRESSION)
    return f"data:image/png;base64,{base64.b64encode(file.getvalue()).decode('ascii')}"
