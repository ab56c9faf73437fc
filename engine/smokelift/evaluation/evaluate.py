"""How near a sequence is to known volumes and other cameras' clips, and whether it looks like smoke from all around."""

from collections.abc import Iterator
from contextlib import ExitStack
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from smokelift.checks import counted
from smokelift.evaluation.orbit import Orbit, orbit_scores
from smokelift.evaluation.truth import Figures, Truth, means, on_grid, picture_figures, resampled, volume_means
from smokelift.extraction.given_background import background_picture, open_plates
from smokelift.footage.clip import Clip
from smokelift.footage.images import area_average, reduced_size
from smokelift.output.images import eight_bit, write_sheet
from smokelift.output.sequence import Sequence, Viewer
from smokelift.render import Image, Volume
from smokelift.scene import Camera, Scene

MAX_COMPARED_SIDE = 480
"""Pixels of a compared picture at most: larger ones are averaged over areas. Finer than any usual grid."""

INPUT = "input"
"""Name of the view that the sequence was made from."""

TILE_AZIMUTHS, TILE_ROWS = tuple(range(0, 180, 18)), 240
"""Azimuths of the pictures, in degrees, and their rows of pixels."""

LABEL_SCORES = ("patches", "patches_worst", "patches_own", "edges", "flicker")
"""Scores in the label of a picture's row."""


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


def open_views(sequence: Sequence, paths: list[list[Path]], stack: ExitStack, notes: list[str]) -> list[ReferenceView]:
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


def evaluate(
    sequence: Sequence, truth_path: Path | None, view_paths: list[list[Path]], picture_path: Path | None
) -> Figures:
    """Compare a sequence with the truth and with other views, and its orbit with the truth's or with its own front.

    The last needs neither truth nor view: what smoke looks like from another side is, in its texture, what its
    front looks like. The truth is a truth.npz over the same box and at the same rate; resolutions may differ. Views
    are camera files and clips, whose frame 0 is the input clip's. With any, or without a truth, the input is
    compared as well. With the path of a picture, a late frame is drawn from all around.

    What is found are nested plain values, as JSON holds them; None where there is nothing to say. It is a ValueError if
    a file cannot be read or does not belong to the sequence.
    """
    if not sequence.frames:
        raise ValueError(f"{sequence.directory}: there are no finished frames to evaluate yet.")
    directed = sequence.settings.get("direct")
    if isinstance(directed, dict) and directed.get("job") in ("retime", "loop"):
        raise ValueError(
            f"{sequence.directory}: its frames are no longer those of the clip; evaluate the sequence that it was made "
            "from."
        )
    figures: Figures = {"directory": str(sequence.directory), "frames": len(sequence.frames), "notes": []}
    truth, whole = None, sequence
    if truth_path is not None:
        # the truth is known in the clip's box, which smoke that goes on may have left
        sequence = sequence.within(sequence.box(sequence.frames[0]))
        truth = _load_truth(sequence, truth_path)
        figures["truth"] = {"path": str(truth_path), **volume_means(truth, _volumes(sequence))}
    with ExitStack() as stack:
        views = open_views(whole, view_paths, stack, figures["notes"])
        if view_paths or truth is None:
            figures["views"] = [_against_view(whole, view) for view in views]
    figures["orbit"] = _orbit_figures(sequence, truth)
    if picture_path is not None:
        _write_picture(picture_path, sequence, truth, figures["orbit"])
    return figures


def _write_picture(path: Path, sequence: Sequence, truth: Truth | None, scores: Figures) -> None:
    """Write a late frame from all around, below the truth's where it is known, with its scores, as a PNG."""
    number = sequence.frames[3 * (len(sequence.frames) - 1) // 4]
    known = [name for name in LABEL_SCORES if scores[name] is not None]
    shown = ", ".join(f"{name.replace('_', ' ')} {scores[name]:.3f}" for name in known)
    rows = [(f"frame {number}, beside the {scores['reference']}: {shown}", sequence.scene, sequence.density(number))]
    if truth is not None:
        true = _true_density(sequence, truth, number)
        rows.insert(0, (f"truth, frame {number}", on_grid(sequence.scene, truth.shape), true))
    tiles = [
        [eight_bit(Orbit(scene).image(density, degrees, TILE_ROWS)) for degrees in TILE_AZIMUTHS]
        for _, scene, density in rows
    ]
    titles = [f"{degrees}\N{DEGREE SIGN}" for degrees in TILE_AZIMUTHS]
    write_sheet(path, tiles, titles, [label for label, _, _ in rows])


def _orbit_figures(sequence: Sequence, truth: Truth | None) -> Figures:
    """Compare the orbit with the truth's, on its grid, or with the front."""
    frames = sequence.frames
    if truth is None:
        return orbit_scores(sequence.scene, len(frames), lambda index: sequence.density(frames[index]))
    shape = truth.shape
    return orbit_scores(
        on_grid(sequence.scene, shape),
        len(frames),
        lambda index: resampled(sequence.density(frames[index]), shape),
        lambda index: _true_density(sequence, truth, frames[index]),
    )


def _load_truth(sequence: Sequence, path: Path) -> Truth:
    truth, domain = Truth.load(path), sequence.scene.domain
    box = np.array(domain.max) - np.array(domain.min)
    wanted = np.array(truth.shape) * truth.voxel_size
    if not np.allclose(box, wanted, rtol=0.01):
        its, own = (" x ".join(f"{length:.3g}" for length in size) for size in (wanted, box))
        raise ValueError(
            f"{path}: is a box of {its} m, but the sequence's is {own} m; reconstruct with the "
            "truth's box as [domain] in the scene file."
        )
    fps = sequence.scene.clip.fps if sequence.scene.clip else None
    if fps is not None and abs(fps - truth.fps) > 0.01 * truth.fps:
        raise ValueError(
            f"{path}: has {truth.fps:g} frames per second, but the sequence has {fps:g}; give fps in the scene's "
            "[clip]."
        )
    if (last := sequence.frames[-1] + first_frame(sequence) - 1) >= truth.frames:
        raise ValueError(
            f"{path}: holds {counted(truth.frames, 'frame')}, but the sequence goes on to frame {last} of its clip "
            "(from 0); give the truth of that clip, or evaluate a sequence of fewer frames."
        )
    return truth


def _true_density(sequence: Sequence, truth: Truth, number: int) -> Volume:
    return truth.density(number + first_frame(sequence) - 1)


def _volumes(sequence: Sequence) -> Iterator[tuple[int, Volume, Volume | None]]:
    for number in sequence.frames:
        # the first frame's velocity is the second's
        velocity = sequence.velocity_at_centres(number) if number > sequence.frames[0] else None
        yield number + first_frame(sequence) - 1, sequence.density(number), velocity


def _against_view(sequence: Sequence, view: ReferenceView) -> Figures:
    viewer = Viewer(sequence.scene, view.camera, view.background)
    frames = [
        picture_figures(viewer.image(number, sequence.density(number), sequence.flame(number)), view.picture(number))
        for number in sequence.frames
    ]
    return {"name": view.name, "clip": str(view.clip.path), "size": list(view.camera.size), **means(frames)}
