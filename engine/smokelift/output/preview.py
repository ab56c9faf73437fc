"""Pictures that show at a glance what a sequence is: a contact sheet, an orbit, a strip and a video.

All of them show the part of the picture that holds smoke in some frame. The scene's own camera has the clip's
background behind the smoke, all others one color: the background's own where it has one, else black.
"""

from __future__ import annotations

from collections.abc import Iterator
from collections.abc import Sequence as Rows
from dataclasses import replace
from pathlib import Path

import numpy as np

from smokelift.footage.clip import Clip
from smokelift.footage.given_background import backdrop_colour, background_picture
from smokelift.footage.images import area_average
from smokelift.output.framing import Framing
from smokelift.output.images import eight_bit, write_sheet, write_video
from smokelift.output.sequence import Sequence
from smokelift.output.viewer import Viewer
from smokelift.render import Image
from smokelift.scene import Camera, CompleteScene, orbit

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


def write_contact_sheet(path: Path, sequence: Sequence, clip: Clip, framing: Framing) -> None:
    """Write input, reconstruction and turned views of some frames side by side, as a PNG."""
    frames = sequence.frames
    spread = np.unique(np.linspace(0, len(frames) - 1, SHEET_ROWS + 2).round().astype(int))
    numbers = [frames[i] for i in spread[1:-1]] or list(frames)
    scene, camera = sequence.scene, framing.camera(sequence.scene.camera, SHEET_HEIGHT)
    own, others = _behind_own(scene, clip), _behind_others(scene, clip)
    viewers = [Viewer(scene, orbit(camera, framing.box, angle), others if angle else own) for angle in SHEET_ANGLES]
    rows = [[_filmed(clip, n, framing, camera), *_rendered(sequence, n, viewers)] for n in numbers]
    titles = ["input", "reconstruction", *(_degrees(angle) for angle in SHEET_ANGLES[1:])]
    _write_pictures(path, rows, titles, [f"frame {number}" for number in numbers])


def write_orbit(path: Path, sequence: Sequence, clip: Clip, framing: Framing) -> None:
    """Write one moment from twelve angles, as a PNG."""
    number = _late(sequence)
    behind = _behind_others(sequence.scene, clip)
    camera = framing.camera(sequence.scene.camera.at(number - 1), SHEET_HEIGHT)
    viewers = [Viewer(sequence.scene, orbit(camera, framing.box, angle), behind) for angle in ORBIT_ANGLES]
    pictures = _rendered(sequence, number, viewers)
    firsts = range(0, len(pictures), ORBIT_COLUMNS)
    rows = [pictures[first : first + ORBIT_COLUMNS] for first in firsts]
    columns = [", ".join(map(_degrees, ORBIT_ANGLES[column::ORBIT_COLUMNS])) for column in range(ORBIT_COLUMNS)]
    _write_pictures(
        path, rows, columns, [f"frame {number}, from {_degrees(ORBIT_ANGLES[first])} on" for first in firsts]
    )


def write_strip(path: Path, sequence: Sequence, clip: Clip, framing: Framing) -> None:
    """Write consecutive frames of the input and, below, of the reconstruction from the side, as a PNG."""
    frames, scene = sequence.frames, sequence.scene
    last = min(len(frames), frames.index(_late(sequence)) + STRIP_FRAMES // 2)
    numbers = frames[max(0, last - STRIP_FRAMES) :][:STRIP_FRAMES]
    camera = framing.camera(scene.camera, SHEET_HEIGHT)
    viewer = Viewer(scene, orbit(camera, framing.box, SIDE), _behind_others(scene, clip))
    filmed = [_filmed(clip, number, framing, camera) for number in numbers]
    turned = [_rendered(sequence, number, [viewer])[0] for number in numbers]
    titles = [f"frame {number}" for number in numbers]
    _write_pictures(path, [filmed, turned], titles, ["input", f"reconstruction from {_degrees(SIDE)}"])


def write_preview(path: Path, sequence: Sequence, clip: Clip, framing: Framing) -> None:
    """Write input, reconstruction and a view that turns while the smoke moves side by side, as a video."""
    write_video(path, _turning(sequence, clip, framing), clip.fps)


def _turning(sequence: Sequence, clip: Clip, framing: Framing) -> Iterator[Image]:
    scene, frames = sequence.scene, sequence.frames
    step = min(TURN / clip.fps, 360 / len(frames))
    camera = framing.camera(scene.camera, PREVIEW_HEIGHT)
    turns = [orbit(camera.at(n), framing.box, step * n) for n in range(frames[-1])]
    turning = replace(turns[0], matrices=tuple(turned.matrix for turned in turns))
    viewers = [Viewer(scene, camera, _behind_own(scene, clip)), Viewer(scene, turning, _behind_others(scene, clip))]
    for number in frames:
        yield np.concatenate([_filmed(clip, number, framing, camera), *_rendered(sequence, number, viewers)], 1)


def _behind_own(scene: CompleteScene, clip: Clip) -> Image | None:
    """What is behind the smoke for the scene's own camera, (3,) linear; None if the scene says it."""
    return _behind_others(scene, clip) if scene.background.estimated else None


def _behind_others(scene: CompleteScene, clip: Clip) -> Image:
    """What is behind the smoke for all cameras but the scene's own: one linear color, (3,).

    A background seen from aside is not known, and its mean color looks like haze. It is taken only where black hides
    the smoke, which absorbs and does no more; of a background that the sequence does not keep, the clip's mean is.
    """
    absorbs = scene.scattering == "absorption"
    if absorbs and scene.background.estimated:
        return np.asarray(clip.frame(0).mean((0, 1)))
    plate = background_picture(scene)
    color = plate if plate.ndim == 1 else backdrop_colour(plate)
    if color is not None:
        return color
    return np.asarray(plate.mean((0, 1)) if absorbs else np.zeros(3), np.float32)


def _late(sequence: Sequence) -> int:
    """The frame after three quarters of a sequence, when the smoke has developed."""
    return sequence.frames[3 * (len(sequence.frames) - 1) // 4]


def _rendered(sequence: Sequence, number: int, viewers: Rows[Viewer]) -> list[Image]:
    """A frame as each viewer shows it."""
    volumes = sequence.density(number), sequence.flame(number)
    return [viewer.image(number, *volumes) for viewer in viewers]


def _filmed(clip: Clip, number: int, framing: Framing, camera: Camera) -> Image:
    return area_average(framing.part(clip.frame(number - 1)), *camera.size)


def _write_pictures(path: Path, rows: Rows[Rows[Image]], titles: Rows[str], labels: Rows[str]) -> None:
    write_sheet(path, [[eight_bit(picture) for picture in row] for row in rows], titles, labels)


def _degrees(angle: float) -> str:
    return f"{angle}\N{DEGREE SIGN}"
