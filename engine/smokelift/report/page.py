"""A page of pictures and facts, as a picture or as HTML that needs no other file."""

from __future__ import annotations

import base64
import html
import io
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from PIL import Image, ImageDraw, ImageFont

from smokelift.output.atomic import atomic_path
from smokelift.setup.estimate import UNDETERMINED

PAGE_KINDS = (".png", ".html")

TILE = (480, 400)
"""Largest width and height of a picture on the page, in pixels."""

COLUMNS = 3
"""Pictures side by side."""

_GAP, _TEXT, _TITLE, _LINE = 16, 14, 22, 20
"""Pixels between parts, of two fonts, and from line to line."""

_WIDTH = COLUMNS * TILE[0] + (COLUMNS + 1) * _GAP
_STARTS = (_GAP, 170, 520, 670)
"""Left edges of the columns of the table, in pixels."""

PACKED = 2
"""Compression level of PNG files: half of the time of the usual 6, and a seventh more bytes."""

_PAPER, _INK, _FAINT, _UNKNOWN = (26, 26, 28), (232, 232, 232), (165, 165, 165), (255, 170, 70)
"""Colours, sRGB."""


@dataclass(frozen=True, eq=False)
class Panel:
    """A picture (rows, columns, 3) in sRGB codes, with its title."""

    title: str
    picture: NDArray[np.uint8]


@dataclass(frozen=True)
class Fact:
    """A line of the table: what it is about, the value that is taken, its origin, and a sentence that may be empty.

    ``origin`` is ``"given"``, ``"by hand"``, ``"measured"``, ``"estimated"`` or `UNDETERMINED`.
    """

    what: str
    value: str
    origin: str
    how: str = ""

    def as_dict(self) -> dict[str, str]:
        """Return the fact as JSON holds it."""
        return asdict(self)


@dataclass(frozen=True, eq=False)
class Page:
    """A page, from top to bottom."""

    title: str
    warnings: Sequence[str]
    panels: Sequence[Panel]
    facts: Sequence[Fact]
    notes: Sequence[str]


def write_page(path: Path, page: Page) -> None:
    """Write a page as the suffix says, one of `PAGE_KINDS`. It appears whole or not at all."""
    with atomic_path(path) as aside:
        if path.suffix.lower() == ".html":
            aside.write_text(_as_html(page), encoding="utf-8")
        else:
            _as_picture(page).save(aside, format="PNG", compress_level=PACKED)


def fitted(width: int, height: int) -> tuple[int, int]:
    """Return width and height of a picture on the page, in pixels."""
    scale = min(TILE[0] / width, TILE[1] / height)
    return max(1, round(width * scale)), max(1, round(height * scale))


def _as_picture(page: Page) -> Image.Image:
    text, title = ImageFont.load_default(_TEXT), ImageFont.load_default(_TITLE)
    table = [
        [_wrapped(cell, text, right - left - _GAP) for cell, left, right in zip(row, _STARTS, _ENDS, strict=True)]
        for row in ((fact.what, fact.value, fact.origin, fact.how) for fact in page.facts)
    ]
    warnings, notes = (
        [_wrapped(said, text, _WIDTH - 2 * _GAP) for said in sentences] for sentences in (page.warnings, page.notes)
    )
    rows = [page.panels[first : first + COLUMNS] for first in range(0, len(page.panels), COLUMNS)]
    heights = [max(panel.picture.shape[0] for panel in row) + _LINE + _GAP for row in rows]
    lines = sum(max(map(len, cells)) for cells in table) + sum(map(len, notes))
    start = 2 * _GAP + _TITLE
    above = start + sum(map(len, warnings)) * _LINE + len(warnings) * _LINE // 3 + _GAP * bool(warnings)
    below = (lines * _LINE) + (len(table) + len(notes)) * _LINE // 3 + 2 * _GAP
    whole = Image.new("RGB", (_WIDTH, above + sum(heights) + below), _PAPER)
    draw = ImageDraw.Draw(whole)
    draw.text((_GAP, _GAP), page.title, _INK, title)
    _write(draw, warnings, start, text, _UNKNOWN)
    top = above
    for row, height in zip(rows, heights, strict=True):
        for column, panel in enumerate(row):
            left = _GAP + column * (TILE[0] + _GAP)
            draw.text((left, top), panel.title, _FAINT, text)
            whole.paste(Image.fromarray(panel.picture), (left, top + _LINE))
        top += height
    for fact, cells in zip(page.facts, table, strict=True):
        colours = (_FAINT, _INK, _UNKNOWN if fact.origin == UNDETERMINED else _FAINT, _FAINT)
        for cell, left, colour in zip(cells, _STARTS, colours, strict=True):
            draw.text((left, top), "\n".join(cell), colour, text, spacing=_LINE - _TEXT)
        top += max(map(len, cells)) * _LINE + _LINE // 3
    _write(draw, notes, top, text, _FAINT)
    return whole


def _write(
    draw: ImageDraw.ImageDraw,
    sentences: Sequence[Sequence[str]],
    top: int,
    font: ImageFont.FreeTypeFont | ImageFont.ImageFont,
    colour: tuple[int, int, int],
) -> None:
    """Sentences in lines, one below the other."""
    for lines in sentences:
        draw.text((_GAP, top), "\n".join(lines), colour, font, spacing=_LINE - _TEXT)
        top += len(lines) * _LINE + _LINE // 3


_ENDS = (*_STARTS[1:], _WIDTH)


def _wrapped(text: str, font: ImageFont.FreeTypeFont | ImageFont.ImageFont, width: float) -> list[str]:
    """The lines of a text; none is wider than so many pixels unless a single word is."""
    lines: list[str] = []
    space, taken = font.getlength(" "), 0.0
    for word in text.split():
        length = font.getlength(word)
        if lines and taken + space + length <= width:
            lines[-1] += f" {word}"
            taken += space + length
        else:
            lines.append(word)
            taken = length
    return lines


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
    facts = "".join(
        f"<tr><td>{html.escape(fact.what)}</td><td>{html.escape(fact.value)}</td>"
        f'<td class="{html.escape(fact.origin)}">{html.escape(fact.origin)}</td>'
        f'<td class="how">{html.escape(fact.how)}</td></tr>\n'
        for fact in page.facts
    )
    notes = "".join(f"<p>{html.escape(note)}</p>\n" for note in page.notes)
    warnings = "".join(f'<p class="warning">{html.escape(warning)}</p>\n' for warning in page.warnings)
    return (
        f'<!DOCTYPE html>\n<html lang="en"><head><meta charset="utf-8"><title>{title}</title><style>{_STYLE}</style>'
        f"</head><body>\n<h1>{title}</h1>\n{warnings}{figures}\n<table>\n{facts}</table>\n{notes}</body></html>\n"
    )


def _data(picture: NDArray[np.uint8]) -> str:
    """A picture as a data URL."""
    file = io.BytesIO()
    Image.fromarray(picture).save(file, format="PNG", compress_level=PACKED)
    return f"data:image/png;base64,{base64.b64encode(file.getvalue()).decode('ascii')}"
