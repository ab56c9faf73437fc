"""The page of a shot before it is reconstructed: pictures of what was found in the clip, above the facts."""

from collections.abc import Iterable, Sequence

import numpy as np
from PIL import Image, ImageDraw
from scipy import ndimage

from smokelift.checks import Array, Doubles, Finding, counted
from smokelift.extraction.matte import Matte, matte
from smokelift.extraction.plate import Plate, resized
from smokelift.footage.images import linear_to_srgb
from smokelift.output.images import Tile, eight_bit
from smokelift.report.page import TILE, Color, Page, Panel, tile_size
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
    """Histogram of sRGB values, on a logarithmic scale."""
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
