"""Pictures that show at a glance what a sequence is: a contact sheet, an orbit, a strip and a video.

All of them show the part of the picture that holds smoke in some frame. The scene's own camera has the clip's
background behind the smoke, all others one color: the background's own where it has one, else black.
"""

from collections.abc import Iterator
from collections.abc import Sequence as Rows
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import NamedTuple

import numpy as np

from smokelift.extraction.given_background import background_picture, single_color
from smokelift.footage.clip import Clip
from smokelift.footage.images import area_average
from smokelift.output.framing import Framing, frame_smoke
from smokelift.output.images import eight_bit, write_sheet, write_video
from smokelift.output.index import CONTACT_SHEET, ORBIT, PREVIEW, STRIP
from smokelift.output.sequence import Sequence, Viewer
from smokelift.render import Image
from smokelift.scene import Camera, orbit

SHEET_ANGLES, ORBIT_ANGLES, SIDE_DEGREES = (20, 45, 90), tuple(range(0, 360, 30)), 90
"""Degrees by which the scene's camera is carried around the smoke."""

SHEET_HEIGHT, PREVIEW_HEIGHT = 320, 480
"""Rows of a picture, in pixels."""

SHEET_ROWS, ORBIT_COLUMNS, STRIP_FRAMES = 5, 6, 8
"""Frames that the contact sheet shows, pictures of the orbit side by side, and frames of the strip."""

MAX_DEGREES_PER_SECOND = 90.0
"""Degrees per second by which the video's camera turns at most; in longer clips it goes around once."""


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
        """A frame as each viewer shows it."""
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
