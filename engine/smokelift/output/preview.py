"""Pictures that show at a glance what a sequence is: a contact sheet, an orbit, a strip and a video.

All of them show the part of the picture that holds smoke in some frame, from wherever around the smoke it is seen. The
scene's own camera has the clip's background behind the smoke, all others one color: the background's own where it has
one, else black.
"""

from collections.abc import Iterator
from collections.abc import Sequence as Rows
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from smokelift.extraction.given_background import background_picture, single_color
from smokelift.footage.clip import Clip
from smokelift.footage.images import area_average
from smokelift.output.images import eight_bit, write_sheet, write_video
from smokelift.output.index import CONTACT_SHEET, ORBIT, PREVIEW, STRIP
from smokelift.output.sequence import Sequence, Viewer
from smokelift.render import Image
from smokelift.scene import Camera, Domain, orbit
from smokelift.scene.camera import project_points

MIN_VISIBLE_DEPTH = 0.01
"""Optical depth from which smoke is seen: it changes what is behind it by as much, which is a step or two of 8 bits."""

MARGIN_FRACTION = 0.05
"""Margin on each side, as a fraction of the smoke's longer side in the picture."""

MIN_ASPECT = 0.5
"""Width over height of the part at least, and the reverse, where the picture has room for it."""

TURN_STEP = 15
"""Degrees between the turns from which the smoke is measured."""

RIM_POINTS = 24
"""Points of the ellipse in which smoke stands that is as deep as its box."""

SHEET_ANGLES, ORBIT_ANGLES, SIDE_DEGREES = (20, 45, 90), tuple(range(0, 360, 30)), 90
"""Degrees by which the scene's camera is carried around the smoke."""

SHEET_HEIGHT, PREVIEW_HEIGHT = 320, 480
"""Rows of a picture, in pixels."""

SHEET_ROWS, ORBIT_COLUMNS, STRIP_FRAMES = 5, 6, 8
"""Frames that the contact sheet shows, pictures of the orbit side by side, and frames of the strip."""

MAX_DEGREES_PER_SECOND = 90.0
"""Degrees per second by which the video's camera turns at most; in longer clips it goes around once."""


@dataclass(frozen=True)
class Framing:
    """Where in a camera's picture the smoke is."""

    box: Domain
    """The smoke of all frames; what cameras are turned about."""
    left: int
    top: int
    width: int
    height: int
    """The part of the full picture, in its pixels."""

    def camera(self, camera: Camera, height: int) -> Camera:
        """Return the camera of the part, so many pixels high."""
        part = camera.cropped(self.left, self.top, self.width, self.height)
        return part.resized(max(2, round(self.width * height / self.height)), height)

    def part(self, picture: NDArray[np.float32]) -> NDArray[np.float32]:
        """Return the part of a full picture (rows, columns, ...)."""
        return picture[self.top : self.top + self.height, self.left : self.left + self.width]


def frame_smoke(sequence: Sequence) -> Framing:
    """Find where the smoke of a sequence is, from the scene's camera and from that camera turned about the smoke.

    It reads every frame.
    """
    scene = sequence.scene
    box = _smoke_box(sequence)
    rim = _rim(box)
    seen = [
        pixels
        for matrix in range(len(scene.camera.matrices) or 1)
        for yaw in range(0, 360, TURN_STEP)
        for pixels, depth in [project_points(orbit(scene.camera.at(matrix), box, yaw), rim)]
        if (depth > 0).all()
    ]
    width, height = scene.camera.size
    if not seen:
        return Framing(box, 0, 0, width, height)
    points = np.concatenate(seen)
    low, high = points.min(0), points.max(0)
    low, high = low - MARGIN_FRACTION * (high - low).max(), high + MARGIN_FRACTION * (high - low).max()
    least = MIN_ASPECT * (high - low)[::-1]
    lacking = np.maximum(least - (high - low), 0) / 2
    left, top = np.clip(np.floor(low - lacking), 0, [width - 1, height - 1]).astype(int)
    right, bottom = np.clip(np.ceil(high + lacking), [left + 1, top + 1], [width, height]).astype(int)
    return Framing(box, int(left), int(top), int(right - left), int(bottom - top))


def _smoke_box(sequence: Sequence) -> Domain:
    """The box of the smoke that is seen from the front or from the side in any frame; the whole domain without any."""
    domain = sequence.scene.domain
    opacity = sequence.scene.medium.extinction * domain.voxel_size
    nx, ny, nz = domain.shape
    front, side = np.zeros((nx, nz), np.bool_), np.zeros((ny, nz), np.bool_)
    for number in sequence.frames:
        density = sequence.density(number)
        front |= opacity * density.sum(1) > MIN_VISIBLE_DEPTH
        side |= opacity * density.sum(0) > MIN_VISIBLE_DEPTH
    if not (front.any() and side.any()):
        return domain
    x, y, z = (np.flatnonzero(line) for line in (front.any(1), side.any(1), front.any(0)))
    return domain.part(tuple(slice(int(seen[0]), int(seen[-1]) + 1) for seen in (x, y, z)))


def _rim(box: Domain) -> NDArray[np.float64]:
    """Points (n, 3) of the upright elliptic cylinder in a box: smoke seldom fills a box's edges."""
    turns = 2 * np.pi * np.arange(RIM_POINTS) / RIM_POINTS
    low, high, (x, y, _) = np.array(box.min), np.array(box.max), box.centre
    half = (high - low) / 2
    rim = [np.stack([x + half[0] * np.cos(turns), y + half[1] * np.sin(turns), np.full(RIM_POINTS, z)], -1)
           for z in (low[2], high[2])]  # fmt: skip
    return np.concatenate(rim)


class Sheet(NamedTuple):
    """Rows of pictures, with titles of the columns and labels of the rows."""

    rows: list[list[Image]]
    titles: list[str]
    labels: list[str]


@dataclass(frozen=True)
class Preview:
    """A sequence beside its clip, in the part of the picture that holds the smoke."""

    sequence: Sequence
    clip: Clip
    framing: Framing

    def contact_sheet(self) -> Sheet:
        """Input, reconstruction and turned views of some frames."""
        frames = self.sequence.frames
        spread = np.unique(np.linspace(0, len(frames) - 1, SHEET_ROWS + 2).round().astype(int))
        numbers = [frames[i] for i in spread[1:-1]] or list(frames)
        camera = self._camera(SHEET_HEIGHT)
        viewers = [self._own_viewer(camera), *self._viewers(camera, SHEET_ANGLES)]
        rows = [[self._filmed(number, camera), *self._rendered(number, viewers)] for number in numbers]
        titles = ["input", "reconstruction", *(_degrees(angle) for angle in SHEET_ANGLES)]
        return Sheet(rows, titles, [f"frame {number}" for number in numbers])

    def orbit(self) -> Sheet:
        """One frame from twelve angles."""
        number = self._late
        camera = self.framing.camera(self.sequence.scene.camera.at(number - 1), SHEET_HEIGHT)
        pictures = self._rendered(number, self._viewers(camera, ORBIT_ANGLES))
        firsts = range(0, len(pictures), ORBIT_COLUMNS)
        rows = [pictures[first : first + ORBIT_COLUMNS] for first in firsts]
        titles = [", ".join(map(_degrees, ORBIT_ANGLES[column::ORBIT_COLUMNS])) for column in range(ORBIT_COLUMNS)]
        return Sheet(rows, titles, [f"frame {number}, from {_degrees(ORBIT_ANGLES[first])} on" for first in firsts])

    def strip(self) -> Sheet:
        """Consecutive frames of the input and, below, of the reconstruction from the side."""
        frames = self.sequence.frames
        last = min(len(frames), frames.index(self._late) + STRIP_FRAMES // 2)
        numbers = frames[max(0, last - STRIP_FRAMES) :][:STRIP_FRAMES]
        camera = self._camera(SHEET_HEIGHT)
        viewers = self._viewers(camera, [SIDE_DEGREES])
        filmed = [self._filmed(number, camera) for number in numbers]
        turned = [self._rendered(number, viewers)[0] for number in numbers]
        labels = ["input", f"reconstruction from {_degrees(SIDE_DEGREES)}"]
        return Sheet([filmed, turned], [f"frame {number}" for number in numbers], labels)

    def video(self) -> Iterator[Image]:
        """Input, reconstruction and a view that turns while the smoke moves side by side, frame by frame."""
        frames, camera = self.sequence.frames, self._camera(PREVIEW_HEIGHT)
        step = min(MAX_DEGREES_PER_SECOND / self.clip.fps, 360 / len(frames))
        turns = [orbit(camera.at(n), self.framing.box, step * n) for n in range(frames[-1])]
        turning = replace(turns[0], matrices=tuple(turned.matrix for turned in turns))
        viewers = [self._own_viewer(camera), Viewer(self.sequence.scene, turning, self._behind)]
        for number in frames:
            yield np.concatenate([self._filmed(number, camera), *self._rendered(number, viewers)], 1)

    @cached_property
    def _late(self) -> int:
        """The frame after three quarters of the sequence, when the smoke has developed."""
        return self.sequence.frames[3 * (len(self.sequence.frames) - 1) // 4]

    def _camera(self, height: int) -> Camera:
        return self.framing.camera(self.sequence.scene.camera, height)

    def _own_viewer(self, camera: Camera) -> Viewer:
        scene = self.sequence.scene
        return Viewer(scene, camera, self._behind if scene.background.estimated else None)

    def _viewers(self, camera: Camera, angles: Rows[int]) -> list[Viewer]:
        """The camera turned about the smoke by some angles in degrees."""
        turned = (orbit(camera, self.framing.box, angle) for angle in angles)
        return [Viewer(self.sequence.scene, each, self._behind) for each in turned]

    @cached_property
    def _behind(self) -> Image:
        """What is behind the smoke for all cameras but the scene's own: one linear color, (3,).

        A background seen from aside is not known, and its mean color looks like haze. It is taken only where black
        hides the smoke, which absorbs and does no more; of a background that the sequence does not keep, the clip's
        mean is.
        """
        scene = self.sequence.scene
        absorbs = scene.scattering == "absorption"
        if absorbs and scene.background.estimated:
            return np.asarray(self.clip.frame(0).mean((0, 1)))
        plate = background_picture(scene)
        color = plate if plate.ndim == 1 else single_color(plate)
        if color is not None:
            return color
        return np.asarray(plate.mean((0, 1)) if absorbs else np.zeros(3), np.float32)

    def _rendered(self, number: int, viewers: Rows[Viewer]) -> list[Image]:
        volumes = self.sequence.density(number), self.sequence.flame(number)
        return [viewer.image(number, *volumes) for viewer in viewers]

    def _filmed(self, number: int, camera: Camera) -> Image:
        return area_average(self.framing.part(self.clip.frame(number - 1)), *camera.size)


def write_previews(out: Path, sequence: Sequence, clip: Clip) -> None:
    """Write three pictures and a video of a sequence into a directory, with names that `PICTURES` has."""
    preview = Preview(sequence, clip, frame_smoke(sequence))
    for name, make in ((CONTACT_SHEET, preview.contact_sheet), (ORBIT, preview.orbit), (STRIP, preview.strip)):
        rows, titles, labels = make()
        write_sheet(out / name, [[eight_bit(picture) for picture in row] for row in rows], titles, labels)
    write_video(out / PREVIEW, preview.video(), clip.fps)


def _degrees(angle: float) -> str:
    return f"{angle}\N{DEGREE SIGN}"
