"""Pictures that show at a glance what a sequence is: a contact sheet and a video."""

from __future__ import annotations

from collections.abc import Iterable
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

SHEET_ANGLES, PREVIEW_ANGLES = (0, 20, 45, 90), (0, 45)
"""Degrees by which the scene's camera is carried around the smoke."""

SHEET_HEIGHT, PREVIEW_HEIGHT = 320, 480
"""Rows of a picture, in pixels."""

SHEET_ROWS = 5


def write_contact_sheet(path: Path, sequence: Sequence, clip: Clip) -> None:
    """Write input, reconstruction and turned views of some frames side by side, as a PNG."""
    frames = sequence.frames
    spread = np.unique(np.linspace(0, len(frames) - 1, SHEET_ROWS + 2).round().astype(int))
    numbers = [frames[i] for i in spread[1:-1]] or list(frames)
    shots = _SideBySide(sequence, clip, SHEET_ANGLES, SHEET_HEIGHT)
    rows = [[eight_bit(picture) for picture in shots.pictures(number)] for number in numbers]
    titles = ["input", "reconstruction", *(f"{angle}\N{DEGREE SIGN}" for angle in SHEET_ANGLES[1:])]
    write_sheet(path, rows, titles, [f"frame {number}" for number in numbers])


def write_preview(path: Path, sequence: Sequence, clip: Clip) -> None:
    """Write input, reconstruction and a turned view side by side, as a video."""
    shots = _SideBySide(sequence, clip, PREVIEW_ANGLES, PREVIEW_HEIGHT)
    write_video(path, (np.concatenate(shots.pictures(number), 1) for number in sequence.frames), clip.fps)


class _SideBySide:
    """The input and the sequence from some angles, in pictures of one height."""

    def __init__(self, sequence: Sequence, clip: Clip, angles: Iterable[int], height: int) -> None:
        scene = sequence.scene
        self._sequence, self._clip = sequence, clip
        self._camera = _of_height(scene.camera, height)
        self._viewers = [Viewer(scene, orbit(self._camera, scene.domain, angle)) for angle in angles]

    def pictures(self, number: int) -> list[Image]:
        density = self._sequence.density(number)
        seen = area_average(self._clip.frame(number - 1), *self._camera.size)
        return [seen, *(viewer.image(number, density) for viewer in self._viewers)]


def _of_height(camera: Camera, height: int) -> Camera:
    return camera.resized(max(2, round(camera.size[0] * height / camera.size[1])), height)
