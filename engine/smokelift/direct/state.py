"""The state of moving smoke: read from a sequence, interpolated between two, and written as a sequence's frame.

What becomes of a sequence is written as another one, which opens in Blender as any other.
"""

import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from smokelift.checks import Finding, Mask, counted
from smokelift.output.index import INDEX, checksum
from smokelift.output.sequence import Sequence
from smokelift.output.writer import SequenceWriter
from smokelift.report.sentences import part
from smokelift.transport import Array, Velocity, advect, divergence, faces_in, on_faces, project
from smokelift.transport.pressure import project_with_given_faces

Mix = Callable[[Array, Array, float], Array]
"""Mixes two densities or emissions by a fraction: 0 gives the first."""

DIVERGENCE_TOLERANCE = 1e-3
"""Divergence times voxel size over the largest speed, below which a velocity counts as free of divergence."""

COMPLETION_ITERATIONS = 30
"""Iterations in which a velocity that is known near smoke alone is completed."""

RESOLVED = 1e-6
"""Nearer than this to 0 or 1 the result is one of the two states itself."""

MIN_FRAMES = 4
"""Frames that a sequence needs to be continued, retimed or looped."""

Written = tuple[int, Mapping[str, Any]]
"""Number and figures of a frame."""


@dataclass(frozen=True, eq=False)
class SmokeState:
    """Smoke at one time, and how it moves."""

    density: Array
    """(nx, ny, nz) float32: at voxel centers."""
    velocity: Velocity
    """Without divergence, in m/s; it has carried the frame before to this one."""
    flame: Array | None = None
    """(nx, ny, nz) float32: emission of fire; None without any."""

    def scaled(self, factor: Array | np.float32) -> "SmokeState":
        """The state with its smoke and fire times a factor, (nx, ny, nz) or one number."""
        flame = None if self.flame is None else self.flame * factor
        return replace(self, density=self.density * factor, flame=flame)


def read_state(sequence: Sequence, number: int) -> SmokeState:
    velocity = sequence.velocity(number)
    return SmokeState(sequence.density(number), complete_velocity(velocity), sequence.flame(number))


def complete_velocity(velocity: Velocity) -> Velocity:
    """The velocity without divergence that is nearest to one that is known near smoke alone, and zero elsewhere.

    Files keep the velocity near smoke. Cut off there it has divergence, and projecting that would slow the smoke down;
    so the air around is set in motion instead, and faces both of whose voxels have a velocity keep theirs. A velocity
    without divergence stays as it is.
    """
    if largest_divergence(velocity) <= DIVERGENCE_TOLERANCE:
        return velocity
    known = velocity.centres().any(axis=-1, keepdims=True).astype(np.float32)
    x, y, z = (both == 1 for both in on_faces(np.broadcast_to(known, (*velocity.shape, 3))))
    found = project_with_given_faces(velocity, (x, y, z), velocity.faces, limit=COMPLETION_ITERATIONS)
    return velocity.with_faces(found.faces)


def largest_divergence(velocity: Velocity, solid: Mask | None = None) -> float:
    """The largest |div u| outside obstacles (nx, ny, nz) times voxel size over the largest |u|."""
    largest = max(float(np.abs(component).max()) for component in velocity.faces)
    left = np.abs(divergence(velocity))
    if solid is not None:
        left = left[~solid]
    return float(left.max()) * velocity.voxel_size / largest if largest > 0 else 0.0


def blend(a: Array, b: Array, fraction: float) -> Array:
    """Mix two densities linearly: a fraction of 0 gives the first."""
    return (1 - np.float32(fraction)) * a + np.float32(fraction) * b


def interpolate(
    before: SmokeState, after: SmokeState, motion: Velocity, dt: float, fraction: float, mix: Mix = blend
) -> SmokeState:
    """Return the smoke at a fraction of the time from one state, 0, to another, 1.

    The first state is advected forwards by its part of the time, the second backwards by the rest, and the two are
    blended by the fraction. So nothing shows twice where the motion is right, and the mass changes linearly from
    that of the first to that of the second.

    The motion, a velocity in m/s at the points of arrival, carries the first to the second in `dt` seconds. What of
    density and of emission is carried from both is mixed by ``mix``, linearly by default.
    """
    if fraction < RESOLVED:
        return before
    if fraction > 1 - RESOLVED:
        return after
    done, rest = fraction * dt, (1 - fraction) * dt
    midway = advect(motion, motion.with_faces(-component for component in motion.faces), rest)
    back = midway.with_faces(-component for component in midway.faces)

    def blended(first: Array, second: Array) -> Array:
        return mix(advect(first, midway, done, conserve=True), advect(second, back, rest, conserve=True), fraction)

    density = blended(before.density, after.density)
    flame = None if before.flame is None or after.flame is None else blended(before.flame, after.flame)
    velocities = advect(before.velocity, midway, done), advect(after.velocity, back, rest)
    faces = (blend(a, b, fraction) for a, b in zip(velocities[0].faces, velocities[1].faces, strict=True))
    return SmokeState(density, project(before.velocity.with_faces(faces)), flame)


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
    made: Finding,
    camera_frames: list[float],
    *,
    npz: bool,
    resume: bool,
) -> SequenceWriter:
    """The writer of a sequence that is made from another, of which `open_source` knows that it has enough frames.

    The job and its settings are kept in the settings under ``direct``; what it has ``made`` of the smoke is said in
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
        provenance=[*sequence.provenance, part(replace(made, about=job, source="made up"))],
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
