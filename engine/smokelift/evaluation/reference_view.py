"""Cameras whose clips a sequence is compared with."""

from contextlib import ExitStack
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from smokelift.checks import counted
from smokelift.extraction.given_background import background_picture, open_plates
from smokelift.footage.clip import Clip
from smokelift.footage.images import area_average, reduced_size
from smokelift.output.sequence import Sequence, Viewer
from smokelift.render import Image
from smokelift.scene import Camera, Scene

MAX_COMPARED_SIDE = 480
"""Pixels of a compared picture at most: larger ones are averaged over areas. Finer than any usual grid."""

INPUT = "input"
"""Name of the view that the sequence was made from."""


@dataclass(frozen=True, eq=False)
class ReferenceView:
    """A camera with the clip that its pictures are compared with."""

    name: str
    """To call it by."""
    camera: Camera
    """With as many pixels as the pictures are compared at; where it moves, from the sequence's first frame on."""
    background: Image
    """(rows, columns, 3) or (3,): linear radiance behind the smoke."""
    clip: Clip
    """Its footage."""
    first: int
    """The clip's frame that the sequence's frame 1 belongs to."""

    def picture(self, number: int) -> Image:
        """The clip's picture of a frame of the sequence, with its background where a mask hides it.

        Linear radiance (rows, columns, 3).
        """
        frame = self.first + number - 1
        picture = area_average(self.clip.frame(frame), *self.camera.size)
        seen = self.clip.seen(frame, *self.camera.size)
        return picture if seen is None else np.where(seen[..., None], picture, self.background)


def first_frame(sequence: Sequence) -> int:
    """Return the frame of the input clip's file, from 0, that the sequence's frame 1 belongs to."""
    clip = sequence.scene.clip
    return 0 if clip is None else clip.first


def open_views(
    sequence: Sequence, paths: tuple[tuple[Path, Path], ...], stack: ExitStack, notes: list[str]
) -> list[ReferenceView]:
    """Open the sequence's own input, and other cameras with their clips, by the paths of both.

    The stack closes the clips. The notes take a sentence if the input cannot be compared with. It raises ValueError if
    a file cannot be read, or a camera does not fit its clip.
    """
    scene = sequence.scene
    views = []
    if (plates := open_plates(scene.background, scene.camera)) is not None:
        plates.close()
        notes.append("The input view was left out: what stands behind the smoke there changes.")
    elif scene.clip is not None:
        try:
            clip = stack.enter_context(Clip.open(scene.clip))
            views.append(_view(INPUT, scene.camera, None, clip, 0, sequence))
        except ValueError as error:
            notes.append(f"The input view was left out: {error}")
    for camera_path, clip_path in paths:
        other = Scene.load(camera_path)
        if other.camera is None:
            raise ValueError(f"{camera_path}: has no [camera].")
        clip = stack.enter_context(Clip.open(clip_path))
        behind = None if other.background is None else background_picture(other)
        views.append(_view(camera_path.stem, other.camera, behind, clip, first_frame(sequence), sequence))
    return views


def _view(
    name: str, camera: Camera, background: Image | None, clip: Clip, first: int, sequence: Sequence
) -> ReferenceView:
    if camera.size[0] * clip.size[1] != camera.size[1] * clip.size[0]:
        raise ValueError(
            f"{clip.path}: its pictures are {clip.size[0]} x {clip.size[1]}, the camera's {camera.size[0]} x "
            f"{camera.size[1]}; [camera] size must have the clip's shape."
        )
    if (last := first + sequence.frames[-1] - 1) >= len(clip):
        raise ValueError(
            f"{clip.path}: has {counted(len(clip), 'frame')}, but the sequence goes on to frame {last} of its clip "
            "(from 0); give the whole clip of that camera."
        )
    camera = camera.resized(*clip.size).resized(*reduced_size(*clip.size, MAX_COMPARED_SIDE))
    if camera.moves:
        camera = replace(camera, matrix=camera.matrices[first], matrices=camera.matrices[first:])
    if background is None:
        background = Viewer(sequence.scene, camera).background(1)
    elif background.ndim == 3:
        background = area_average(background, *camera.size)
    return ReferenceView(name, camera, background, clip, first)
