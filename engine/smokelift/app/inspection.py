"""What is known of a shot before it is reconstructed, on one page: what was found in the clip, chosen and assumed."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from PIL import Image, ImageDraw

from smokelift.app.cost import Cost
from smokelift.app.page import TILE, Fact, Page, Panel, fitted
from smokelift.footage.exposure import shows_exposure, small
from smokelift.footage.images import area_average, linear_to_srgb
from smokelift.footage.matte import SMOKE_THRESHOLD, Matte, matte
from smokelift.footage.plate import Plate
from smokelift.output.images import eight_bit, write_image
from smokelift.scene import SHADOWED, Background, Camera, DirectionalLight, Domain, PointLight, Scene
from smokelift.scene.checks import counted
from smokelift.scene.projection import project
from smokelift.setup.background import BLACK
from smokelift.setup.choice import UNDETERMINED, Choice
from smokelift.setup.geometry import PICTURE_HEIGHT
from smokelift.setup.shot import Shot
from smokelift.setup.smoke import UNKNOWN

Tile = NDArray[np.uint8]

BOX, LIGHT, SMOKE, HIDDEN, PATH = (90, 200, 255), (255, 220, 60), (255, 150, 40), (230, 60, 200), (120, 255, 120)
"""Colours of the box, of light, of smoke, of what is unknown and of the camera's path, sRGB."""

ARROW = 0.35
"""Length of the arrow of a light over the diagonal of the box."""

HEAD = 16.0
"""Length of its head in pixels."""

BINS = 96
"""Of the histogram."""

CLEAN, NOISY = 2.0, 6.0
"""Noise in 8 bit codes up to which a clip is called clean, and from which noisy: thin smoke is lost in it
(docs/experiments/background.md)."""


def inspection(shot: Shot, given: Scene, known: Sequence[Fact], notes: Iterable[str]) -> Page:
    """Return the page of a shot.

    Parameters
    ----------
    shot
        Everything decided.
    given
        What the user said of it.
    known
        The `facts` of it.
    notes
        Sentences that are said as well.
    """
    number = shot.smoky[0] if shot.smoky else 0
    columns, rows = fitted(*shot.clip.size)
    pixels = shot.clip.size[0] * shot.clip.size[1] / (columns * rows)
    plate = shot.views[0].plates.at(number).through(lambda whole: area_average(whole, columns, rows), pixels)
    picture = shot.clip.area_average(number, columns, rows)
    seen = matte(picture, plate)
    camera = shot.scene.camera.at(number).resized(columns, rows)
    unknown = plate.confidence < UNKNOWN
    path = _path(shot, camera, picture)
    lit = " and the light" if _light_starts(shot, shot.scene.domain) else ""
    panels = [
        Panel(f"frame {number} with the box{lit}", _with_box(shot, camera, picture)),
        Panel("background", eight_bit(plate.image)),
        Panel(f"smoke of frame {number}: {seen.mask.mean():.1%} of the picture", _matte_picture(seen)),
        Panel(f"unknown background: {unknown.mean():.1%} of the picture", _unknown_picture(plate, unknown)),
        Panel("brightness: frame (grey), its smoke (orange), background (blue)", _histogram(picture, plate, seen)),
        *([] if path is None else [Panel("path of the box's middle while the camera moves", path)]),
    ]
    name = given.clip.path.name if given.clip is not None else "clip"
    width, height = shot.clip.size
    frames = f"{counted(shot.length, 'frame')} of {width} x {height} at {shot.clip.fps:.4g} a second"
    others = tuple(note for note in notes if note not in shot.doubts)
    return Page(f"{name}: {frames}", shot.doubts, panels, known, others)


def facts(shot: Shot, given: Scene, cost: Cost) -> tuple[Fact, ...]:
    """Return what is known of a shot, a line each."""
    scene, domain = shot.scene, shot.scene.domain
    plate = shot.views[0].plates.at(0)
    size = " x ".join(f"{high - low:.3g}" for low, high in zip(domain.min, domain.max, strict=True))
    calibrated, boxed = given.camera is not None, given.domain is not None
    medium = scene.medium
    thick = f"{medium.extinction:.3g} 1/m at density 1"
    tint = "grey" if medium.is_grey else ", ".join(f"{v:.2f}" for v in medium.color)
    told, know = given.medium is not None, "Give [medium] if you know it."
    taken = f"The picture is taken to be {PICTURE_HEIGHT:g} m high where the smoke is."
    around, placed = "around the smoke of the whole clip", "estimated"
    if not shot.smoky:
        around, placed = "over all of the picture", UNDETERMINED
    spent = f"about {cost.seconds:.0f} s, {cost.memory / 2**30:.1f} GiB of memory, {cost.disk / 1e6:.0f} MB on disk"
    return (
        _background(shot, given, plate),
        _exposure(shot, plate),
        _noise(plate),
        _known(
            "camera",
            f"{scene.camera.type}, {'moves' if scene.camera.moves else 'stands still'}",
            calibrated,
            _said(shot, "Camera"),
        ),
        _known("scale", f"box of {size} m", boxed, f"{taken} Give [camera] and [domain] in metres."),
        Fact("box", "as given", "given") if boxed else Fact("box", around, placed, _said(shot, "Domain")),
        _chosen(shot, "resolution", "grid", " x ".join(map(str, domain.resolution)), boxed),
        _known("extinction", thick, told, f"A picture shows it times the density only. {know}"),
        _known("albedo", f"{medium.albedo:.3g}", told, f"A picture shows it times the light only. {know}"),
        _chosen(shot, "smoke colour", "smoke colour", tint, told),
        *_light(shot, given),
        _chosen(shot, "scattering", "scattering", scene.scattering, given.scattering is not None),
        _place(shot),
        Fact(
            "cost",
            f"{counted(shot.length, 'frame')}: {spent}",
            "estimated",
            f"Right to a factor of two; {cost.memory_free / 2**30:.1f} GiB of memory are free.",
        ),
    )


def write_scene(path: Path, shot: Shot, given: Scene, known: Sequence[Fact]) -> tuple[Path, ...]:
    """Write all that was found into a scene file, with what is known of it as comments; return the files.

    A background of one colour that was estimated becomes a colour of the file. Any other is left to be found again: a
    picture does not say which of its parts are unknown, and by how much they may be wrong. It is written beside the
    file for those who want to mend it. The turns of a camera that was steadied belong to the background that they were
    found with, and are left to be found again, too; camera and box stay as they are given, if they are.

    Raises
    ------
    ValueError
        If a file is there already.
    """
    scene, plate = Scene(**vars(shot.scene)), shot.estimated_background
    picture = path.with_name(f"{path.stem}_background.exr")
    said = [f"{fact.what}: {fact.value} ({fact.origin})" for fact in known if fact.what != "cost"]
    colour = None if plate is None else plate[0, 0]
    one = colour is not None and bool((plate == colour).all())
    files = (path,) if plate is None or one else (path, picture)
    for file in files:
        if file.exists():
            raise ValueError(f"{file}: is there already; nothing was overwritten, give another name.")
    if colour is not None and one:
        red, green, blue = map(float, colour)
        scene = replace(scene, background=Background(color=(red, green, blue)))
    elif plate is not None:
        write_image(picture, plate, half=False)
        scene = replace(scene, background=None)
        said.append(f"A run finds the background again. {picture.name} shows it: once mended, give it in [background].")
    elif shot.moves and shot.scene.background == Background():
        scene = replace(scene, camera=given.camera, domain=given.domain, background=None)
    scene.save(path, said)
    return files


def _said(shot: Shot, about: str) -> str:
    """The sentence that is said about a part of a scene that is not given."""
    return next((note for note in shot.notes if note.startswith(about)), "")


def _known(what: str, value: str, is_given: bool, otherwise: str) -> Fact:
    """The line of what a user gives, or nothing determines."""
    return Fact(what, value, "given") if is_given else Fact(what, value, UNDETERMINED, otherwise)


def _background(shot: Shot, given: Scene, plate: Plate) -> Fact:
    if given.background is not None:
        return Fact("background", "as given", "given")
    unknown = float((plate.confidence < UNKNOWN).mean())
    colour = plate.image[0, 0]
    value = "a picture"
    if (plate.image == colour).all():
        value = "black" if colour.max() < BLACK else f"one colour, {', '.join(f'{v:.2g}' for v in colour)} (linear)"
    return Fact(
        "background",
        f"{value}, {unknown:.0%} of it unknown" if unknown else value,
        "estimated",
        _said(shot, "Background"),
    )


def _exposure(shot: Shot, plate: Plate) -> Fact:
    if not shows_exposure(small(plate.image)):
        how = "The background is too dark or too bright to show it: what flickers is taken for smoke."
        return Fact("exposure", "taken to be steady", UNDETERMINED, how)
    value = f"changes by up to {shot.exposure:.0%}, evened out" if shot.exposure > 0 else "steady"
    return Fact("exposure", value, "measured", "Of what does not move, against the background.")


def _noise(plate: Plate) -> Fact:
    codes = 255 * float(plate.noise.total.max())
    kind = "clean" if codes <= CLEAN else "noisy: thin smoke is lost in it" if codes >= NOISY else "usual"
    lasting = 255 * float(plate.noise.lasting.max())
    return Fact("noise", f"{kind}, {codes:.1f} of 255", "measured", f"{lasting:.1f} of it is shared by neighbours.")


def _light(shot: Shot, given: Scene) -> tuple[Fact, ...]:
    """The lines of the light: how strong it is, and what of it one picture does not tell."""
    if shot.scene.scattering == "absorption":
        return (Fact("light", "none is needed", "estimated" if given.scattering is None else "given"),)
    strength, thickness = _choice(shot, "light strength"), _choice(shot, "smoke thickness")
    if strength is not None:
        return (Fact("light", f"{strength.chosen} times as strong as given", "measured", strength.reason),)
    if given.lights or thickness is None:
        return (Fact("light", "as given", "given"),)
    colour = ", ".join(f"{v:.2g}" for v in shot.optics.unshadowed_source())
    hides, origin = "as the light asks for", UNDETERMINED
    how = "Light strength: as much as the thickest smoke shows; if none is thick, the light is stronger."
    if not shot.smoky:
        how = "Light strength: no smoke shows it."
    if shot.scene.scattering in SHADOWED:
        how = "Light strength: as much as comes from behind the smoke, in the color that the clip asks for."
    if thickness.chosen != UNDETERMINED:
        hides, origin = f"hides {thickness.measured['hidden']:.0%} of what it covers", "measured"
        how = "Light strength: what the smoke adds for what it hides of the texture behind it."
    return (
        Fact("light strength", f"smoke of radiance {colour}", origin, how),
        _chosen(shot, "smoke thickness", "smoke thickness", hides, False),
        _chosen(shot, "light direction", "sun's direction", "no sun", False),
        _chosen(shot, "light direction", "sun's color", "that of all light", False),
        _chosen(shot, "light direction", "ambient share", "all light is from everywhere", False),
    )


def _place(shot: Shot) -> Fact:
    given, place = shot.settings.axis_depth, shot.place
    if given is not None:
        return Fact("place in depth", f"{given:.2f} m behind the middle of the box", "given")
    if len(shot.views) > 1:
        return Fact("place in depth", "as the cameras show it", "estimated")
    value = "the middle of the box"
    if place is not None:
        depth = round(place.depth, 2) + 0.0  # no minus before zero
        value = f"{depth:.2f} m behind the middle of the box, give or take {place.deviation:.2f} m"
    return _chosen(shot, "axis depth", "place in depth", value, False)


def _chosen(shot: Shot, what: str, name: str, value: str, is_given: bool) -> Fact:
    """The line of a choice, or of what was not chosen because it is given or was not measured."""
    choice = _choice(shot, what)
    if is_given or choice is None:
        return Fact(name, value, "given" if is_given else UNDETERMINED)
    untold = choice.chosen == UNDETERMINED or not (shot.smoky or choice.by_hand)
    return Fact(name, value, UNDETERMINED if untold else "by hand" if choice.by_hand else "measured", choice.reason)


def _choice(shot: Shot, what: str) -> Choice[Any] | None:
    return next((choice for choice in shot.choices if choice.what == what), None)


def _with_box(shot: Shot, camera: Camera, picture: NDArray[np.float32]) -> Tile:
    """A frame with the edges of the box, and an arrow for each light whose direction is known."""
    domain, shown = shot.scene.domain, Image.fromarray(eight_bit(picture))
    draw = ImageDraw.Draw(shown)
    corners = domain.corners()
    # corners that differ along one axis are joined
    edges = [(a, b) for a in range(8) for b in range(a) if np.sum(corners[a] != corners[b]) == 1]
    for a, b in edges:
        _line(draw, camera, corners[[a, b]], BOX)
    for start in _light_starts(shot, domain):
        _line(draw, camera, np.array([start, domain.centre]), LIGHT, head=True)
    return np.asarray(shown)


def _light_starts(shot: Shot, domain: Domain) -> list[NDArray[np.float64]]:
    """Where the arrows of the lights begin, on their way to the middle of the box."""
    if shot.scene.scattering not in SHADOWED:
        return []
    middle = np.array(domain.centre)
    length = ARROW * float(np.linalg.norm(np.array(domain.max) - domain.min))
    ways = [np.array(light.direction) for light in shot.scene.lights if isinstance(light, DirectionalLight)]
    ways += [middle - light.position for light in shot.scene.lights if isinstance(light, PointLight)]
    return [middle - length * way / np.linalg.norm(way) for way in ways]


def _line(
    draw: ImageDraw.ImageDraw,
    camera: Camera,
    points: NDArray[np.float64],
    colour: tuple[int, int, int],
    head: bool = False,
) -> None:
    """A line through points of the world (n, 3), if all are before the camera; an arrow if asked for."""
    pixels, depth = project(camera, points)
    if (depth <= 0).any():
        return
    draw.line([(float(x), float(y)) for x, y in pixels], fill=colour, width=3 if head else 1)
    along = pixels[-1] - pixels[-2]
    length = float(np.hypot(*along))
    if head and length > 0:
        along *= HEAD / length
        across = 0.5 * np.array([-along[1], along[0]])
        tip, base = pixels[-1], pixels[-1] - along
        draw.polygon([(float(x), float(y)) for x, y in (tip, base + across, base - across)], fill=colour)


def _matte_picture(seen: Matte) -> Tile:
    """The deviation from the background, white where it is certain, and orange where it is taken for smoke."""
    strength = np.clip(seen.deviation / (4 * SMOKE_THRESHOLD), 0, 1)[..., None]
    colour = np.where(seen.mask[..., None], np.array(SMOKE), np.array([255, 255, 255]))
    return np.asarray(np.rint(strength * colour), np.uint8)


def _unknown_picture(plate: Plate, unknown: NDArray[np.bool_]) -> Tile:
    """The background with what is unknown of it in one colour."""
    codes = eight_bit(plate.image).astype(np.float64)
    codes[unknown] = 0.4 * codes[unknown] + 0.6 * np.array(HIDDEN)
    return np.asarray(np.rint(codes), np.uint8)


def _histogram(picture: NDArray[np.float32], plate: Plate, seen: Matte) -> Tile:
    """How many pixels have which sRGB value, on a logarithmic scale."""
    width, height = TILE[0], TILE[0] // 2
    shown = Image.new("RGB", (width, height), (12, 12, 14))
    draw = ImageDraw.Draw(shown)
    grey = [np.clip(linear_to_srgb(each).mean(-1), 0, 1) for each in (picture, plate.image)]
    parts = ((grey[0], (110, 110, 110)), (grey[0][seen.mask], SMOKE), (grey[1], (80, 140, 255)))
    highest = np.log1p(picture.shape[0] * picture.shape[1])
    for place, (values, colour) in enumerate(parts):
        counts = np.histogram(values, BINS, (0, 1))[0]
        tops = height - 1 - np.log1p(counts) / highest * (height - 8)
        points = [(float((n + 0.5) * width / BINS), float(top)) for n, top in enumerate(tops)]
        if place == 0:
            draw.polygon([(0, height), *points, (width, height)], fill=colour)
        else:
            draw.line(points, fill=colour, width=2)
    return np.asarray(shown)


def _path(shot: Shot, camera: Camera, picture: NDArray[np.float32]) -> Tile | None:
    """Where the middle of the box goes in the picture of a camera that moves; None of one that stands still."""
    if not shot.moves:
        return None
    shown = Image.fromarray(eight_bit(0.3 * picture))
    middle = np.array([shot.scene.domain.centre])
    places = [project(shot.scene.camera.at(n).resized(*camera.size), middle) for n in range(shot.length)]
    points = [(float(pixels[0, 0]), float(pixels[0, 1])) for pixels, depth in places if depth[0] > 0]
    if len(points) > 1:
        ImageDraw.Draw(shown).line(points, fill=PATH, width=2)
    return np.asarray(shown)
