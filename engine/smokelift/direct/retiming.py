"""A sequence at another speed, and one that repeats without a seam."""

import math
import time
from collections.abc import Iterator
from dataclasses import replace
from functools import partial
from pathlib import Path

import numpy as np

from smokelift.checks import Doubles, Finding
from smokelift.direct.state import (
    MIN_FRAMES,
    SmokeState,
    Written,
    directed_writer,
    interpolate,
    read_state,
    write_copy,
    write_simulated,
)
from smokelift.output.sequence import Sequence
from smokelift.scene import Side
from smokelift.scene.domain import open_sides
from smokelift.transport import Array, Velocity
from smokelift.velocity import estimate_velocity

STEPS = 64
"""Steps per frame of the trapezoidal rule that integrates 1 / speed over a ramp."""

MAX_OVERLAP = 24
"""Frames that the start and the end of a loop share, at most, unless said otherwise. In a second the way from the one
to the other is slow beside the smoke's own motion."""

TINY = 1e-20
"""Smallest density, or sum of densities, that is divided by."""

BORDER, BORDER_FACTOR = 0.2, 16.0
"""Fraction of the box's length before an open side where smoke of one end alone goes sooner, and how many times the
usual density is at the side: smoke of that density is gone there after a tenth of the overlap."""

MAX_STEADY_CHANGE = 0.15
"""Fraction of the smoke that may be elsewhere, in profiles along the axes, after a loop that counts as steady."""


def playback(count: int, speeds: tuple[float, ...]) -> tuple[Doubles, Doubles]:
    """Return the times (n,) that are shown, in frames of the clip from 0, and the speed at each.

    A speed of 1 is the clip's own. Several lie evenly from its first frame to its last, and change linearly in between.
    """
    clip_time = np.linspace(0, count - 1, STEPS * (count - 1) + 1)
    speed = np.interp(clip_time, np.linspace(0, count - 1, len(speeds)), speeds)
    durations = np.diff(clip_time) * (1 / speed[1:] + 1 / speed[:-1]) / 2
    shown_time = np.concatenate([[0.0], np.cumsum(durations)])
    frames = np.arange(np.floor(shown_time[-1] + 1e-6) + 1)
    times = np.interp(frames, shown_time, clip_time)
    return times, np.interp(times, clip_time, speed)


def retime_sequence(
    sequence: Sequence, out: str | Path, speeds: tuple[float, ...], *, npz: bool = False, resume: bool = False
) -> Iterator[Written]:
    """Write a sequence at another speed: frames between the clip's own are interpolated from both neighbors.

    Velocities are scaled with the speed: at half the speed they are half of the smoke's. Speeds are those of
    `playback`, further arguments and what it yields those of `smokelift.direct.state.directed_writer`. It is
    a ValueError if a file cannot be read or written.
    """
    times, speeds_shown = playback(len(sequence.frames), speeds)
    first, dt = sequence.frames[0], 1 / sequence.fps
    made = Finding("interpolated frames")
    camera_frames = [first + float(at) for at in times]
    pair: dict[int, SmokeState] = {}
    with directed_writer(
        sequence, out, "retime", {"speeds": speeds}, made, camera_frames, npz=npz, resume=resume
    ) as writer:
        for number, (at, speed) in enumerate(zip(times.tolist(), speeds_shown.tolist(), strict=True), 1):
            if number in writer.finished:
                continue
            started = time.perf_counter()
            low = first + min(int(at), len(sequence.frames) - 2)
            pair = {n: pair[n] if n in pair else read_state(sequence, n) for n in (low, low + 1)}
            before, after = pair[low], pair[low + 1]
            state = interpolate(before, after, after.velocity, dt, at + first - low)
            velocity = state.velocity.with_faces(np.float32(speed) * u for u in state.velocity.faces)
            further = {"place": at, "speed": speed}
            yield write_simulated(
                writer, number, replace(state, velocity=velocity), "retimed", further, started=started
            )


def steady_part(sequence: Sequence, overlap: int | None = None) -> tuple[int, int]:
    """Return the first and the last frame of the longest part in which the smoke is steady.

    Where it is in none, of the parts that are half as long as the sequence or longer, the one in which it is most so.
    Start and end share `overlap` frames, by default those of `default_overlap`.
    """
    whole = len(sequence.frames)
    shortest = max(MIN_FRAMES, math.ceil(whole / 2), 2 * (overlap or 0))
    if shortest >= whole:
        return sequence.frames[0], sequence.frames[-1]
    profiles = [_profile(sequence.density(number)) for number in sequence.frames]
    parts: list[tuple[float, int, int]] = []
    for count in range(whole, shortest - 1, -1):
        shared = default_overlap(count) if overlap is None else max(overlap, 1)
        for first in range(whole - count + 1):
            middle = first + shared // 2
            parts.append((_change(profiles[middle], profiles[middle + count - shared]), first, first + count - 1))
        if min(parts)[0] <= MAX_STEADY_CHANGE:
            break
    _, first, last = min(parts)
    return sequence.frames[first], sequence.frames[last]


def default_overlap(count: int) -> int:
    """Return the frames that the start and the end share of so many: a third."""
    return min(MAX_OVERLAP, count // 3)


def loop_length(sequence: Sequence, first: int, last: int, overlap: int) -> int:
    """Return how many frames a loop has; ValueError if there are no such frames, or too few."""
    there = f"{sequence.directory}: has the frames {sequence.frames[0]} to {sequence.frames[-1]}"
    if not sequence.frames[0] <= first <= last <= sequence.frames[-1]:
        raise ValueError(f"{there}, not {first} to {last}.")
    count = last - first + 1
    if count < MIN_FRAMES or not 1 <= overlap <= count // 2:
        raise ValueError(
            f"{there}; a loop of {count} of them can overlap by {max(count // 2, 1)} at most, not by {overlap}: "
            f"choose another overlap, or more frames ({MIN_FRAMES} at least)."
        )
    return count - overlap


def loop_sequence(
    sequence: Sequence, out: str | Path, first: int, last: int, overlap: int, *, npz: bool = False, resume: bool = False
) -> Iterator[Written]:
    """Write a part of a sequence so that its last frame leads to its first.

    The part overlaps with its own start by some frames, and the loop is shorter by so many. In the overlap the
    motion from the last density to the first is estimated, the last frames are advected along it and the first ones
    back, and the two are mixed. So shapes move to where they have to be, and do not fade out in one place and in at
    another. Smoke that only one of them has comes and goes by its edges.

    Further arguments and what it yields are those of `smokelift.direct.state.directed_writer`. It is a
    ValueError as by `loop_length`, or if a file cannot be read or written.
    """
    length = loop_length(sequence, first, last, overlap)
    settings = {"frames": [first, last], "overlap": overlap}
    made = Finding("overlap of a loop", {"first": 1, "last": overlap})
    camera_frames = [float(first + n) for n in range(length)]
    with directed_writer(sequence, out, "loop", settings, made, camera_frames, npz=npz, resume=resume) as writer:
        for index in range(length):
            number, source = index + 1, first + index
            if number in writer.finished:
                continue
            started = time.perf_counter()
            if index < overlap:
                fraction = number / (overlap + 1)
                start, end = read_state(sequence, source), read_state(sequence, source + length)
                state = seam(end, start, fraction, (overlap + 1) * (1 / sequence.fps))
                further = {"place": source, "share": fraction}
                yield write_simulated(writer, number, state, "looped", further, started=started)
            else:
                yield write_copy(sequence, source, writer, number, {"place": source})


def seam(end: SmokeState, start: SmokeState, fraction: float, duration: float) -> SmokeState:
    """The smoke on its way from one state of a clip, `end`, to another that it is to become, `start`.

    It has gone a fraction, 0 to 1, of the way, which takes a duration in seconds. The velocity gains what moves the
    one's shapes to the other's in them.
    """
    if not (end.density.any() and start.density.any()):  # there are no shapes to carry
        way = Velocity.zero(end.velocity.shape, end.velocity.voxel_size, end.velocity.closed)
    else:
        velocity = end.velocity
        way = estimate_velocity(end.density, start.density, duration, velocity.voxel_size, closed=velocity.closed)
    mix = partial(mix_by_edges, closed=end.velocity.closed)
    state = interpolate(end, start, way, duration, fraction, mix)
    faces = (u + w for u, w in zip(state.velocity.faces, way.faces, strict=True))
    return replace(state, velocity=state.velocity.with_faces(faces))


def mix_by_edges(end: Array, start: Array, fraction: float, closed: tuple[Side, ...] = ()) -> Array:
    """Mix two densities (nx, ny, nz) so that neither shows through the other; a fraction of 0 gives the first.

    Where both are alike it is a linear mix. Where one alone has smoke, the thin of it goes first and comes last, as air
    dissolves smoke, and no shape becomes a ghost of itself. Each has the weight

        w = (1 - s) a^2 / ((1 - s) a^2 + s (b^2 + (c d)^2)),    d = |a - b| / (a + b),

    of density a beside b of the other, with the usual density c, more near open sides of the box: what rises out of it
    is gone before it shows where the box ends. The mass changes linearly.
    """
    of_end, of_start = (float(values.sum(dtype=np.float64)) for values in (end, start))
    if of_end + of_start == 0:
        return np.zeros_like(end)
    usual = (float(np.vdot(end, end)) + float(np.vdot(start, start))) / (of_end + of_start)
    difference = np.abs(end - start) / np.maximum(end + start, np.float32(TINY))
    lone = np.square(np.float32(usual) * difference * _density_factor(end.shape, closed))

    def weighted(a: Array, b: Array, s: float) -> Array:
        own, other = np.float32(1 - s) * np.square(a), np.float32(s) * (np.square(b) + lone)
        weight: Array = own / np.maximum(own + other, np.float32(TINY))
        return a * weight

    mixed = weighted(end, start, fraction) + weighted(start, end, 1 - fraction)
    mass = (1 - fraction) * of_end + fraction * of_start
    return mixed * np.float32(mass / max(float(mixed.sum(dtype=np.float64)), TINY))


def _density_factor(shape: tuple[int, ...], closed: tuple[Side, ...]) -> Array:
    """How many times as dense smoke counts as the usual, 1 away from the open sides."""
    factor = np.ones((), np.float32)
    for _, axis, is_high in open_sides(closed):
        places = np.arange(shape[axis], dtype=np.float32)
        distance = (places[::-1] if is_high else places) / np.float32(BORDER * shape[axis])
        rise = 1 + np.float32(BORDER_FACTOR - 1) * np.square(np.maximum(1 - distance, 0))
        factor = np.maximum(factor, rise.reshape([-1 if d == axis else 1 for d in range(3)]))
    return factor


def _profile(density: Array) -> Array:
    """The sums of a density over the layers across each axis, one after the other."""
    sums = [density.sum(axis=tuple(d for d in range(3) if d != axis)) for axis in range(3)]
    return np.concatenate(sums)


def _change(before: Array, after: Array) -> float:
    """The fraction of two profiles that differs, from 0 to 1."""
    both = float(before.sum() + after.sum())
    return float(np.abs(before - after).sum()) / both if both > 0 else 0.0
