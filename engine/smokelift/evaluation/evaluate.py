"""How near a sequence is to known volumes and other cameras' clips, and whether its sides look like smoke."""

from __future__ import annotations

from contextlib import ExitStack
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
from PIL import Image as Pillow

from smokelift.checks import counted
from smokelift.evaluation.frame_means import Figures, PictureMeans, VolumeMeans
from smokelift.evaluation.reference_view import INPUT, ReferenceView, first_frame, open_views
from smokelift.evaluation.resampling import resampled
from smokelift.evaluation.sides import DEGREES, evaluate_sides
from smokelift.evaluation.truth import Truth
from smokelift.output.images import eight_bit
from smokelift.output.sequence import Sequence
from smokelift.output.sheet import write_sheet
from smokelift.output.viewer import Viewer
from smokelift.render import Volume

TILE_HEIGHT = 320
"""Pixels."""

SHEET_ROWS = 5
"""Frames that are shown at most."""

Tiles = dict[int, list[npt.NDArray[np.uint8]]]


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
    """Compare a sequence with the truth and with other views, and its sides with its front in their statistics.

    The last needs neither truth nor view: what smoke looks like from another side is, in its statistics, what its front
    looks like.

    Parameters
    ----------
    sequence
        What was reconstructed.
    truth_path
        A truth.npz over the same box and at the same rate; resolutions may differ.
    view_paths
        Camera files and clips, whose frame 0 is the input clip's. With any, or without a truth, the input is compared
        as well.

    Raises
    ------
    ValueError
        If a file cannot be read or does not belong to the sequence.
    """
    if not sequence.frames:
        raise ValueError(f"{sequence.directory}: there are no finished frames to evaluate yet.")
    directed = sequence.settings.get("direct")
    if isinstance(directed, dict) and directed.get("job") in ("retime", "loop"):
        raise ValueError(
            f"{sequence.directory}: its frames are no longer those of the clip; evaluate the sequence that it was made "
            "from."
        )
    frames = sequence.frames
    shown = {frames[i] for i in np.linspace(0, len(frames) - 1, SHEET_ROWS).round().astype(int)}
    tiles: Tiles = {number: [] for number in sorted(shown)}
    figures: Figures = {"directory": str(sequence.directory), "frames": len(frames), "notes": []}
    titles: list[str] = []
    truth = None
    if truth_path is not None:
        truth = _load_truth(sequence, truth_path)
        figures["truth"] = {"path": str(truth_path), **_against_truth(sequence, truth, tiles)}
        titles += ["truth, along y", "sequence", "truth, along x", "sequence"]
    with ExitStack() as stack:
        views = open_views(sequence, view_paths, stack, figures["notes"])
        if view_paths or truth is None:
            figures["views"] = [_against_view(sequence, view, tiles) for view in views]
            titles += [title for view in views for title in (view.name, "sequence")]
        filmed = next((view for view in views if view.name == INPUT), None)
        sides = evaluate_sides(sequence, truth, filmed, shown)
    figures["sides"] = sides.figures
    for number, pictures in sides.pictures.items():
        tiles[number] += [_fitted(eight_bit(picture)) for picture in pictures]
    turned = [f"{degrees}\N{DEGREE SIGN}" for degrees in DEGREES]
    titles += turned if truth is None else [title for name in turned for title in (f"truth, {name}", "sequence")]
    return Evaluation(figures, tuple(titles), tiles)


def _load_truth(sequence: Sequence, path: Path) -> Truth:
    truth = Truth.load(path)
    _check_box(sequence, truth, path)
    if (last := sequence.frames[-1] + first_frame(sequence) - 1) >= truth.frames:
        raise ValueError(
            f"{path}: holds {counted(truth.frames, 'frame')}, but the sequence goes on to frame {last} of its clip "
            "(from 0); give the truth of that clip, or evaluate a sequence of fewer frames."
        )
    return truth


def _against_truth(sequence: Sequence, truth: Truth, tiles: Tiles) -> Figures:
    offset = first_frame(sequence) - 1
    means = VolumeMeans(truth)
    white = max(float(_projection(truth.density(n + offset), axis).max()) for n in tiles for axis in (0, 1))
    for number in sequence.frames:
        density = sequence.density(number)
        # the first frame's velocity is the second's
        means.add(number + offset, density, sequence.velocity(number) if number > sequence.frames[0] else None)
        if number in tiles:
            true, found = truth.density(number + offset), resampled(density, truth.shape)
            for axis in (1, 0):
                tiles[number] += [_tile(_projection(volume, axis) / max(white, 1e-30)) for volume in (true, found)]
    return means.figures()


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


def _against_view(sequence: Sequence, view: ReferenceView, tiles: Tiles) -> Figures:
    viewer = Viewer(sequence.scene, view.camera, view.background)
    means = PictureMeans(view.background)
    for number in sequence.frames:
        pictures = view.picture(number), viewer.image(number, sequence.density(number), sequence.flame(number))
        means.add(pictures[1], pictures[0])
        if number in tiles:
            tiles[number] += [_fitted(eight_bit(picture)) for picture in pictures]
    return {"name": view.name, "clip": str(view.clip.path), "size": list(view.camera.size), **means.figures()}


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
