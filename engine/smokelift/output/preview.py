"""Pictures that show at a glance what a sequence is: a contact sheet, an orbit, a strip and a video."""

from __future__ import annotations

from collections.abc import Iterator
from collections.abc import Sequence as Rows
from dataclasses import replace
from pathlib import Path

import numpy as np

from smokelift.footage.clip import Clip
from smokelift.footage.images import area_average
from smokelift.output.images import eight_bit
from smokelift.output.sequence import Sequence
from smokelift.output.sheet import write_sheet
from smokelift.output.video import write_video
from smokelift.output.viewer import Viewer
from smokelift.render import Image
from smokelift.scene import Camera, orbit

SHEET_ANGLES = (0, 20, 45, 90)
ORBIT_ANGLES = tuple(range(0, 360, 30))
SIDE = 90
"""Degrees by which the scene's camera is carried around the smoke."""

SHEET_HEIGHT, PREVIEW_HEIGHT = 320, 480
"""Rows of a picture, in pixels."""

SHEET_ROWS = 5

ORBIT_COLUMNS = 6

STRIP_FRAMES = 8

TURN = 90.0
"""Degrees a second by which the video's camera turns at most; in longer clips it goes around once."""


def write_contact_sheet(path: Path, sequence: Sequence, clip: Clip) -> None:
    """Write input, reconstruction and turned views of some frames side by side, as a PNG."""
    frames = sequence.frames
    spread = np.unique(np.linspace(0, len(frames) - 1, SHEET_ROWS + 2).round().astype(int))
    numbers = [frames[i] for i in spread[1:-1]] or list(frames)
    camera = _of_height(sequence.scene.camera, SHEET_HEIGHT)
    viewers = [Viewer(sequence.scene, orbit(camera, sequence.scene.domain, angle)) for angle in SHEET_ANGLES]
    rows = []
    for number in numbers:
        density = sequence.density(number)
        rows.append([_filmed(clip, number, camera), *(viewer.image(number, density) for viewer in viewers)])
    titles = ["input", "reconstruction", *(_degrees(angle) for angle in SHEET_ANGLES[1:])]
    _write_pictures(path, rows, titles, [f"frame {number}" for number in numbers])


def write_orbit(path: Path, sequence: Sequence) -> None:
    """Write one moment from twelve angles, as a PNG."""
    number = _late(sequence)
    density, domain = sequence.density(number), sequence.scene.domain
    camera = _of_height(sequence.scene.camera.at(number - 1), SHEET_HEIGHT)
    behind = Viewer(sequence.scene, orbit(camera, domain, SIDE)).background(number)  # from all sides alike
    viewers = [Viewer(sequence.scene, orbit(camera, domain, angle), behind) for angle in ORBIT_ANGLES]
    pictures = [viewer.image(number, density) for viewer in viewers]
    firsts = range(0, len(pictures), ORBIT_COLUMNS)
    rows = [pictures[first : first + ORBIT_COLUMNS] for first in firsts]
    columns = [", ".join(map(_degrees, ORBIT_ANGLES[column::ORBIT_COLUMNS])) for column in range(ORBIT_COLUMNS)]
    _write_pictures(
        path, rows, columns, [f"frame {number}, from {_degrees(ORBIT_ANGLES[first])} on" for first in firsts]
    )


def write_strip(path: Path, sequence: Sequence, clip: Clip) -> None:
    """Write consecutive frames of the input and, below, of the reconstruction from the side, as a PNG."""
    frames, scene = sequence.frames, sequence.scene
    last = min(len(frames), frames.index(_late(sequence)) + STRIP_FRAMES // 2)
    numbers = frames[max(0, last - STRIP_FRAMES) :][:STRIP_FRAMES]
    camera = _of_height(scene.camera, SHEET_HEIGHT)
    viewer = Viewer(scene, orbit(camera, scene.domain, SIDE))
    filmed = [_filmed(clip, number, camera) for number in numbers]
    turned = [viewer.image(number, sequence.density(number)) for number in numbers]
    titles = [f"frame {number}" for number in numbers]
    _write_pictures(path, [filmed, turned], titles, ["input", f"reconstruction from {_degrees(SIDE)}"])


def write_preview(path: Path, sequence: Sequence, clip: Clip) -> None:
    """Write input, reconstruction and a view that turns while the smoke moves side by side, as a video."""
    write_video(path, _turning(sequence, clip), clip.fps)


def _turning(sequence: Sequence, clip: Clip) -> Iterator[Image]:
    scene, frames = sequence.scene, sequence.frames
    step = min(TURN / clip.fps, 360 / len(frames))
    camera = _of_height(scene.camera, PREVIEW_HEIGHT)
    turns = [orbit(camera.at(n), scene.domain, step * n) for n in range(frames[-1])]
    turning = replace(turns[0], matrices=tuple(turned.matrix for turned in turns))
    behind = Viewer(scene, orbit(camera, scene.domain, SIDE)).background(frames[0])  # no plate turns along
    front, around = Viewer(scene, camera), Viewer(scene, turning, behind)
    for number in frames:
        density = sequence.density(number)
        views = _filmed(clip, number, camera), front.image(number, density), around.image(number, density)
        yield np.concatenate(views, 1)


def _late(sequence: Sequence) -> int:
    """The frame after three quarters of a sequence, when the smoke has developed."""
    return sequence.frames[3 * (len(sequence.frames) - 1) // 4]


def _filmed(clip: Clip, number: int, camera: Camera) -> Image:
    return area_average(clip.frame(number - 1), *camera.size)


def _of_height(camera: Camera, height: int) -> Camera:
    return camera.resized(max(2, round(camera.size[0] * height / camera.size[1])), height)


def _write_pictures(path: Path, rows: Rows[Rows[Image]], titles: Rows[str], labels: Rows[str]) -> None:
    write_sheet(path, [[eight_bit(picture) for picture in row] for row in rows], titles, labels)


def _degrees(angle: float) -> str:
    return f"{angle}\N{DEGREE SIGN}"
