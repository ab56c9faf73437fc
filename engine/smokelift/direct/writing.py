"""Writes what has become of a sequence as another sequence, which opens in Blender as any other."""

from __future__ import annotations

import time
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from smokelift.direct.constraint import Mask
from smokelift.direct.moment import Moment
from smokelift.output.checksum import checksum
from smokelift.output.layout import INDEX
from smokelift.output.sequence import Sequence
from smokelift.output.writer import SequenceWriter
from smokelift.scene import Camera
from smokelift.transport import Velocity, divergence

USUAL_FPS = 24.0
"""Frames a second where the clip does not say."""

SHORTEST = 4
"""Frames that a sequence needs to be continued, retimed or looped."""

Written = tuple[int, Mapping[str, Any]]
"""Number and figures of a frame."""


def open_source(directory: str | Path) -> Sequence:
    """Open the sequence that is directed.

    Raises
    ------
    ValueError
        If there is none, or it has too few frames.
    """
    sequence = Sequence.open(directory)
    if len(sequence.frames) < SHORTEST:
        raise ValueError(
            f"{directory}: has {len(sequence.frames)} frames; {SHORTEST} are needed to see how smoke moves."
        )
    return sequence


def time_step(sequence: Sequence) -> float:
    """Seconds from one frame of a sequence to the next."""
    clip = sequence.scene.clip
    return 1 / ((clip.fps if clip is not None else None) or USUAL_FPS)


def directed_writer(
    sequence: Sequence,
    out: str | Path,
    job: str,
    settings: Mapping[str, Any],
    how: str,
    places: list[float],
    *,
    npz: bool,
    resume: bool,
) -> SequenceWriter:
    """The writer of a sequence that is made from another.

    Parameters
    ----------
    sequence
        The other.
    out
        Directory to write to.
    job, settings
        What is done to it; kept in the settings under ``direct``.
    how
        The same as a sentence for the provenance.
    places
        For every frame that is written, the number of the frame of `sequence` whose camera it has; between frames the
        nearest, beyond them the last.
    npz, resume
        As in `SequenceWriter`.
    """
    scene = replace(sequence.scene, camera=_camera_of(sequence.scene.camera, places))
    return SequenceWriter(
        out,
        scene,
        {**sequence.settings, "direct": {"job": job, **settings}},
        choices=sequence.choices,
        provenance=[*sequence.provenance, {"what": job, "origin": "made up", "how": how, "settings": {}}],
        sources={"sequence": {INDEX: checksum([sequence.directory / INDEX])}},
        npz=npz,
        resume=resume,
    )


def write_copy(
    sequence: Sequence, place: int, writer: SequenceWriter, number: int, further: Mapping[str, float]
) -> Written:
    """Write a frame of the clip as it is, under a number, with further figures."""
    figures = {**sequence.figures(place), "origin": "clip", **further}
    faces = sequence.staggered_velocity(place).faces
    density, flame = sequence.density(place), sequence.flame(place)
    writer.write(number, density, faces, figures, ready=sequence.files(place), flame=flame)
    return number, {**figures, "seconds_density": 0.0, "seconds_velocity": 0.0}


def simulated_figures(
    moment: Moment, began: float, origin: str, further: Mapping[str, float], solid: Mask | None = None
) -> dict[str, Any]:
    """The figures of a frame that no picture shows.

    Parameters
    ----------
    moment
        The frame.
    began
        `time.perf_counter` when work on it began.
    origin
        In a word.
    further
        Further figures.
    solid : (nx, ny, nz) bool, optional
        Obstacles, inside which nothing counts.
    """
    return {
        "origin": origin,
        "mass": float(moment.density.sum(dtype=np.float64)) * moment.velocity.voxel_size**3,
        "divergence": _largest_divergence(moment.velocity, solid),
        **further,
        "seconds_density": 0.0,
        "seconds_velocity": time.perf_counter() - began,
    }


def _largest_divergence(velocity: Velocity, solid: Mask | None) -> float:
    """The largest |div u| outside obstacles times voxel size over the largest |u|."""
    largest = max(float(np.abs(component).max()) for component in velocity.faces)
    left = np.abs(divergence(velocity))
    if solid is not None:
        left = left[~solid]
    return float(left.max()) * velocity.voxel_size / largest if largest > 0 else 0.0


def _camera_of(camera: Camera, places: list[float]) -> Camera:
    if not camera.moves:
        return camera
    last = len(camera.matrices) - 1
    matrices = tuple(camera.matrices[min(max(round(place) - 1, 0), last)] for place in places)
    return replace(camera, matrix=matrices[0], matrices=matrices)
