"""The page of a shot before it is reconstructed: pictures of what was found in the clip, above the facts.

It is a picture, or HTML that needs no other file.
"""

import base64
import html
import io
import itertools
import textwrap
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from PIL import Image, ImageDraw, ImageFont
from scipy import ndimage

from smokelift.checks import UNDETERMINED, Array, Doubles, Finding, counted
from smokelift.checks.whole_files import atomic_path, write_text
from smokelift.extraction.matte import Matte, matte
from smokelift.extraction.plate import Plate, resized
from smokelift.footage.images import linear_to_srgb
from smokelift.output.images import Tile, eight_bit
from smokelift.report.sentences import fact, sentence
from smokelift.scene import SHADOWED, Camera, DirectionalLight, Domain, PointLight, Scene
from smokelift.scene.camera import project_points
from smokelift.setup.first_estimate import unknown_part
from smokelift.setup.shot import Shot

BOX, LIGHT, SMOKE, HIDDEN, PATH = (90, 200, 255), (255, 220, 60), (255, 150, 40), (230, 60, 200), (120, 255, 120)
"""Colors (sRGB codes) of the box, light, smoke, unknown background and camera's path."""

MASK_EDGE = (255, 60, 60)
"""Color (sRGB code) of the mask's outline."""

ARROW_LENGTH = 0.35
"""Length of a light's arrow over the diagonal of the box."""

ARROW_HEAD = 16.0
"""Length of the arrow's head in pixels."""

MAX_SHOWN_DEVIATION = 16.0
"""Deviation from the background that is shown brightest, in units of noise."""

BINS = 96
"""Bins of the histogram."""

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


def inspection_page(shot: Shot, given: Scene, known: Sequence[Finding], findings: Iterable[Finding]) -> Page:
    """Return the page of a shot, of which the user's scene was ``given``.

    What is ``known`` is that of `smokelift.report.facts`. Other findings follow below; doubts stand above the pictures.
    """
    number = shot.smoky[0] if shot.smoky else 0
    columns, rows = tile_size(*shot.clip.size)
    whole = resized(shot.views[0].plate, (columns, rows))
    plate = whole.at(number)
    picture = shot.clip.stored(number).averaged(columns, rows)
    seen = matte(picture, plate)
    camera = shot.scene.camera.at(number).resized(columns, rows)
    unknown = unknown_part(whole, shot.clip, number)
    # the deviation from the background, the more orange the surer it is smoke
    strength = np.clip(seen.deviation / MAX_SHOWN_DEVIATION, 0, 1)[..., None]
    smoke = np.rint(strength * (255 + seen.probability[..., None] * (np.array(SMOKE) - 255))).astype(np.uint8)
    behind = eight_bit(plate.image)
    marked = behind.copy()
    marked[unknown] = np.rint(0.4 * behind[unknown] + 0.6 * np.array(HIDDEN))
    path = _path(shot, camera, picture)
    lit = " and the light" if _light_starts(shot, shot.scene.domain) else ""
    hidden = shot.clip.mask
    masked = "" if hidden is None else ", the mask's outline" if hidden.files else ", the edge of what it shows"
    frame = f"frame {shot.clip.numbers[number]}"
    panels = [
        Panel(f"{frame} with the box{masked}{lit}", _with_box(shot, camera, picture, number)),
        Panel("background", behind),
        Panel(f"smoke of {frame}: {seen.mask.mean():.1%} of the picture", smoke),
        Panel(f"unknown background: {unknown.mean():.1%} of the picture", marked),
        Panel("brightness: frame (gray), its smoke (orange), background (blue)", _histogram(picture, plate, seen)),
        *([] if path is None else [Panel("path of the box's middle while the camera moves", path)]),
    ]
    name = given.clip.path.name if given.clip is not None else "clip"
    width, height = shot.clip.size
    frames = f"{counted(shot.length, 'frame')} of {width} x {height} at {shot.clip.fps:.4g} a second"
    doubts, notes = (
        [each for each in findings if each.doubt is doubt and each not in known] for doubt in (True, False)
    )
    return Page(f"{name}: {frames}", doubts, panels, known, notes)


def _with_box(shot: Shot, camera: Camera, picture: Array, number: int) -> Tile:
    """A frame with the mask's outline, the box's edges, and an arrow for each light with a direction."""
    codes, seen = eight_bit(picture), shot.clip.seen(number, *camera.size)
    if seen is not None:
        codes[seen & ~ndimage.binary_erosion(seen, np.ones((3, 3)), border_value=1)] = MASK_EDGE
    domain, shown = shot.scene.domain, Image.fromarray(codes)
    draw = ImageDraw.Draw(shown)
    corners = domain.corners()
    # an edge joins corners that differ along one axis
    edges = [(a, b) for a in range(8) for b in range(a) if np.sum(corners[a] != corners[b]) == 1]
    for a, b in edges:
        _line(draw, camera, corners[[a, b]], BOX)
    for start in _light_starts(shot, domain):
        _line(draw, camera, np.array([start, domain.centre]), LIGHT, head=True)
    return np.asarray(shown)


def _light_starts(shot: Shot, domain: Domain) -> list[Doubles]:
    """Points (3,) where the lights' arrows to the middle of the box begin."""
    if shot.scene.scattering not in SHADOWED:
        return []
    middle = np.array(domain.centre)
    length = ARROW_LENGTH * float(np.linalg.norm(np.array(domain.max) - domain.min))
    ways = [np.array(light.direction) for light in shot.scene.lights if isinstance(light, DirectionalLight)]
    ways += [middle - light.position for light in shot.scene.lights if isinstance(light, PointLight)]
    return [middle - length * way / np.linalg.norm(way) for way in ways]


def _line(draw: ImageDraw.ImageDraw, camera: Camera, points: Doubles, color: Color, head: bool = False) -> None:
    """A line through world points (n, 3), if all are before the camera; with a ``head`` an arrow."""
    pixels, depth = project_points(camera, points)
    if (depth <= 0).any():
        return
    draw.line([(float(x), float(y)) for x, y in pixels], fill=color, width=3 if head else 1)
    along = pixels[-1] - pixels[-2]
    length = float(np.hypot(*along))
    if head and length > 0:
        along *= ARROW_HEAD / length
        across = 0.5 * np.array([-along[1], along[0]])
        tip, base = pixels[-1], pixels[-1] - along
        draw.polygon([(float(x), float(y)) for x, y in (tip, base + across, base - across)], fill=color)


def _histogram(picture: Array, plate: Plate, seen: Matte) -> Tile:
    width, height = TILE[0], TILE[0] // 2
    shown = Image.new("RGB", (width, height), (12, 12, 14))
    draw = ImageDraw.Draw(shown)
    gray = [np.clip(linear_to_srgb(each).mean(-1), 0, 1) for each in (picture, plate.image)]
    parts = ((gray[0], (110, 110, 110)), (gray[0][seen.mask], SMOKE), (gray[1], (80, 140, 255)))
    highest = np.log1p(picture.shape[0] * picture.shape[1])
    for place, (values, color) in enumerate(parts):
        counts = np.histogram(values, BINS, (0, 1))[0]
        tops = height - 1 - np.log1p(counts) / highest * (height - 8)
        points = [(float((n + 0.5) * width / BINS), float(top)) for n, top in enumerate(tops)]
        if place == 0:
            draw.polygon([(0, height), *points, (width, height)], fill=color)
        else:
            draw.line(points, fill=color, width=2)
    return np.asarray(shown)


def _path(shot: Shot, camera: Camera, picture: Array) -> Tile | None:
    """Path of the box's middle in the picture of a camera that moves; None if it stands still."""
    if not shot.moves:
        return None
    shown = Image.fromarray(eight_bit(0.3 * picture))
    middle = np.array([shot.scene.domain.centre])
    places = [project_points(shot.scene.camera.at(n).resized(*camera.size), middle) for n in range(shot.length)]
    points = [(float(pixels[0, 0]), float(pixels[0, 1])) for pixels, depth in places if depth[0] > 0]
    if len(points) > 1:
        ImageDraw.Draw(shown).line(points, fill=PATH, width=2)
    return np.asarray(shown)


def write_page(path: Path, page: Page) -> None:
    """Write a page as the suffix says, one of `PAGE_KINDS`. It appears whole or not at all."""
    if path.suffix.lower() == ".html":
        write_text(path, _as_html(page))
        return
    with atomic_path(path) as temporary:
        _as_picture(page).save(temporary, format="PNG", compress_level=PNG_COMPRESSION)


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
    file = io.BytesIO()
    Image.fromarray(picture).save(file, format="PNG", compress_level=PNG_COMPRESSION)
    return f"data:image/png;base64,{base64.b64encode(file.getvalue()).decode('ascii')}"
