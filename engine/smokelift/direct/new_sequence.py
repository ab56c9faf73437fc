"""Writes what has become of a sequence as another sequence, which opens in Blender as any other."""

import time
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from smokelift.checks import Mask, counted
from smokelift.direct.state import SmokeState, largest_divergence
from smokelift.output.index import INDEX, checksum
from smokelift.output.sequence import Sequence
from smokelift.output.writer import SequenceWriter
from smokelift.transport import faces_in

MIN_FRAMES = 4
"""Frames that a sequence needs to be continued, retimed or looped."""

Written = tuple[int, Mapping[str, Any]]
"""Number and figures of a frame."""


def open_source(directory: str | Path) -> Sequence:
    """Open the sequence that is directed; ValueError if there is none, or it has too few frames."""
    sequence = Sequence.open(directory)
    if len(sequence.frames) < MIN_FRAMES:
        has = counted(len(sequence.frames), "frame")
        raise ValueError(f"{directory}: has {has}; {MIN_FRAMES} are needed to see how smoke moves.")
    return sequence


def directed_writer(
    sequence: Sequence,
    out: str | Path,
    job: str,
    settings: Mapping[str, Any],
    how: str,
    camera_frames: list[float],
    *,
    npz: bool,
    resume: bool,
) -> SequenceWriter:
    """The writer of a sequence that is made from another, of which `open_source` knows that it has enough frames.

    The job and its settings are kept in the settings under ``direct``, and ``how`` says the same as a sentence for
    the provenance. Every frame that is written has the camera of a frame of `sequence`: ``camera_frames`` are their
    numbers, from 1, between frames the nearest, beyond them the last. ``npz`` and ``resume`` are those of
    `SequenceWriter`. Jobs yield the number and the figures of every frame, which is written already.
    """
    camera = sequence.scene.camera
    if camera.moves:
        last = len(camera.matrices) - 1
        matrices = tuple(camera.matrices[min(max(round(frame) - 1, 0), last)] for frame in camera_frames)
        camera = replace(camera, matrix=matrices[0], matrices=matrices)
    return SequenceWriter(
        out,
        replace(sequence.scene, camera=camera),
        {**sequence.settings, "direct": {"job": job, **settings}},
        npz=npz,
        resume=resume,
        start_number=sequence.start_number,
        choices=sequence.choices,
        provenance=[*sequence.provenance, {"what": job, "origin": "made up", "how": how, "settings": {}}],
        sources={"sequence": {INDEX: checksum([sequence.directory / INDEX])}},
    )


def write_copy(
    sequence: Sequence, source: int, writer: SequenceWriter, number: int, further: Mapping[str, float]
) -> Written:
    """Write the frame `source` of a sequence unchanged as the frame `number` of another, with further figures."""
    figures = {**sequence.figures(source), "origin": "clip", **further}
    box = sequence.box(source)
    part = box.slices_in(sequence.scene.domain)
    density, flame = sequence.density(source)[part], sequence.flame(source)
    faces = faces_in(sequence.velocity(source).faces, part)
    flame = None if flame is None else flame[part]
    writer.write(number, density, faces, figures, ready=sequence.files(source), flame=flame, box=box)
    return number, {**figures, "seconds_density": 0.0, "seconds_velocity": 0.0}


def write_simulated(
    writer: SequenceWriter,
    number: int,
    smoke: SmokeState,
    origin: str,
    further: Mapping[str, float],
    *,
    started: float,
    solid: Mask | None = None,
    **options: Any,
) -> Written:
    """Write a frame that no picture shows, with its figures and further ones.

    The origin is a word for where it comes from, and work on it ``started`` at a time of `time.perf_counter`. No
    divergence counts inside ``solid`` obstacles (nx, ny, nz). Options are those of `SequenceWriter.write`.
    """
    figures = {
        "origin": origin,
        "mass": float(smoke.density.sum(dtype=np.float64)) * smoke.velocity.voxel_size**3,
        "divergence": largest_divergence(smoke.velocity, solid),
        **further,
        "seconds_density": 0.0,
        "seconds_velocity": time.perf_counter() - started,
    }
    writer.write(number, smoke.density, smoke.velocity.faces, figures, flame=smoke.flame, **options)
    return number, figures
