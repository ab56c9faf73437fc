"""How near a sequence is to the truth: to known volumes, and to what other cameras saw."""

from __future__ import annotations

from contextlib import ExitStack
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
from PIL import Image as Pillow

from smokelift.evaluation.scores import Figures, PictureScore, VolumeScore, resampled
from smokelift.evaluation.truth import Truth
from smokelift.footage.background import background_picture, open_plates
from smokelift.footage.clip import Clip, ClipError
from smokelift.footage.images import area_average
from smokelift.output.images import eight_bit
from smokelift.output.sequence import Sequence
from smokelift.output.sheet import write_sheet
from smokelift.output.viewer import Viewer
from smokelift.render.renderer import Image, Volume
from smokelift.scene import Camera, Scene

LONGEST_SIDE = 480
"""Pixels of the pictures that are compared, which are larger ones' means over areas; finer than any usual grid."""

TILE_HEIGHT = 320
SHEET_ROWS = 5

Tiles = dict[int, list[npt.NDArray[np.uint8]]]


@dataclass(frozen=True, eq=False)
class ReferenceView:
    """A camera with the clip that its pictures are compared with.

    Attributes
    ----------
    name
        To call it by.
    camera
        With as many pixels as the pictures are compared at; where it moves, from the sequence's first frame on.
    background : (rows, columns, 3) or (3,)
        Linear radiance behind the smoke.
    clip
        Its footage.
    first
        The clip's frame that the sequence's frame 1 belongs to.
    """

    name: str
    camera: Camera
    background: Image
    clip: Clip
    first: int

    def picture(self, number: int) -> Image:
        """The clip's picture of the sequence's frame of a number."""
        return area_average(self.clip.frame(self.first + number - 1), *self.camera.size)


@dataclass(frozen=True, eq=False)
class Evaluation:
    """What was found.

    Attributes
    ----------
    figures
        Nested plain values, as JSON holds them; None where there is nothing to say.
    titles, tiles
        Columns of a picture: for some frames, by number, the truth and the sequence side by side.
    """

    figures: Figures
    titles: tuple[str, ...]
    tiles: Tiles

    def write_picture(self, path: Path) -> None:
        """Write the tiles as a PNG."""
        write_sheet(path, list(self.tiles.values()), self.titles, [f"frame {number}" for number in self.tiles])


def evaluate(
    sequence: Sequence, truth_path: Path | None = None, view_paths: tuple[tuple[Path, Path], ...] = ()
) -> Evaluation:
    """Compare a sequence with the truth and with other views.

    Parameters
    ----------
    sequence
        What was reconstructed.
    truth_path
        A truth.npz over the same box and at the same rate; resolutions may differ.
    view_paths
        Camera files and clips, whose frame 0 is the input clip's. With any, the input view is scored too.

    Raises
    ------
    ValueError
        If a file cannot be read or does not belong to the sequence.
    """
    if not sequence.frames:
        raise ValueError(f"{sequence.directory}: there are no finished frames to evaluate yet.")
    frames = sequence.frames
    shown = {frames[i] for i in np.linspace(0, len(frames) - 1, SHEET_ROWS).round().astype(int)}
    tiles: Tiles = {number: [] for number in sorted(shown)}
    figures: Figures = {"directory": str(sequence.directory), "frames": len(frames), "notes": []}
    titles: list[str] = []
    if truth_path is not None:
        figures["truth"] = _against_truth(sequence, truth_path, tiles)
        titles += ["truth, along y", "sequence", "truth, along x", "sequence"]
    if view_paths:
        with ExitStack() as stack:
            views = _open_views(sequence, view_paths, stack, figures["notes"])
            figures["views"] = [_against_view(sequence, view, tiles) for view in views]
            titles += [title for view in views for title in (f"{view.name}, seen", "sequence")]
    return Evaluation(figures, tuple(titles), tiles)


def first_frame(sequence: Sequence) -> int:
    """The input clip's frame, from 0, that the sequence's frame 1 belongs to."""
    clip = sequence.scene.clip
    return clip.frames[0] if clip is not None and clip.frames is not None else 0


def _against_truth(sequence: Sequence, path: Path, tiles: Tiles) -> Figures:
    truth = Truth.load(path)
    _check_box(sequence, truth, path)
    offset = first_frame(sequence) - 1
    if (last := sequence.frames[-1] + offset) >= truth.frames:
        raise ValueError(
            f"{path}: holds {truth.frames} frames, but the sequence goes on to frame {last} of its clip (from 0); "
            "give the truth of that clip, or evaluate a sequence of fewer frames."
        )
    score = VolumeScore(truth)
    white = max(float(_projection(truth.density(n + offset), axis).max()) for n in tiles for axis in (0, 1))
    for number in sequence.frames:
        density = sequence.density(number)
        # the first frame's velocity is the second's
        score.add(number + offset, density, sequence.velocity(number) if number > sequence.frames[0] else None)
        if number in tiles:
            true, found = truth.density(number + offset), resampled(density, truth.shape)
            for axis in (1, 0):
                tiles[number] += [_tile(_projection(volume, axis) / max(white, 1e-30)) for volume in (true, found)]
    return {"path": str(path), **score.figures()}


def _check_box(sequence: Sequence, truth: Truth, path: Path) -> None:
    domain = sequence.scene.domain
    box = np.array(domain.max) - np.array(domain.min)
    wanted = np.array(truth.shape) * truth.voxel_size
    if not np.allclose(box, wanted, rtol=0.01):
        raise ValueError(
            f"{path}: is a box of {_metres(wanted)}, but the sequence's is {_metres(box)}; reconstruct with the "
            "truth's box as [domain] in the scene file."
        )
    fps = sequence.scene.clip.fps if sequence.scene.clip else None
    if fps is not None and abs(fps - truth.fps) > 0.01 * truth.fps:
        raise ValueError(
            f"{path}: has {truth.fps:g} frames a second, but the sequence has {fps:g}; give fps in the scene's [clip]."
        )


def _metres(size: npt.NDArray[np.float64]) -> str:
    return " x ".join(f"{length:.3g}" for length in size) + " m"


def _open_views(
    sequence: Sequence, paths: tuple[tuple[Path, Path], ...], stack: ExitStack, notes: list[str]
) -> list[ReferenceView]:
    scene = sequence.scene
    views = []
    if (plates := open_plates(scene)) is not None:
        plates.close()
        notes.append("The input view was left out: what stands behind the smoke there changes.")
    elif scene.clip is not None:
        try:
            clip = stack.enter_context(Clip.open(scene.clip))
            views.append(_view("input", scene.camera, None, clip, 0, sequence))
        except ClipError as error:
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
            f"{clip.path}: has {len(clip)} frames, but the sequence goes on to frame {last} of its clip (from 0); "
            "give the whole clip of that camera."
        )
    scale = min(1.0, LONGEST_SIDE / max(clip.size))
    camera = camera.resized(*(max(1, round(side * scale)) for side in clip.size))
    if camera.moves:
        camera = replace(camera, matrix=camera.matrices[first], matrices=camera.matrices[first:])
    if background is None:
        background = Viewer(sequence.scene, camera).background(1)
    elif background.ndim == 3:
        background = area_average(background, *camera.size)
    return ReferenceView(name, camera, background, clip, first)


def _against_view(sequence: Sequence, view: ReferenceView, tiles: Tiles) -> Figures:
    viewer = Viewer(sequence.scene, view.camera, view.background)
    score = PictureScore(view.background)
    for number in sequence.frames:
        pictures = view.picture(number), viewer.image(number, sequence.density(number))
        score.add(pictures[1], pictures[0])
        if number in tiles:
            tiles[number] += [_fitted(eight_bit(picture)) for picture in pictures]
    return {"name": view.name, "clip": str(view.clip.path), "size": list(view.camera.size), **score.figures()}


def _projection(volume: Volume, axis: int) -> npt.NDArray[Any]:
    """Mean density along y or x as a picture, z up."""
    return np.asarray(volume.mean(axis=axis).T[::-1])


def _tile(values: npt.NDArray[Any]) -> npt.NDArray[np.uint8]:
    grey = np.rint(255 * np.sqrt(np.clip(values, 0, 1))).astype(np.uint8)
    return _fitted(np.repeat(grey[..., None], 3, axis=-1))


def _fitted(tile: npt.NDArray[np.uint8]) -> npt.NDArray[np.uint8]:
    rows, columns = tile.shape[:2]
    size = max(1, round(columns * TILE_HEIGHT / rows)), TILE_HEIGHT
    return np.asarray(Pillow.fromarray(tile).resize(size, Pillow.Resampling.BILINEAR))
