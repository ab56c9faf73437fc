"""A sequence at another speed."""

import time
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np

from smokelift.checks import Doubles
from smokelift.direct.new_sequence import Written, directed_writer, write_simulated
from smokelift.direct.state import SmokeState, interpolate, read_state
from smokelift.output.sequence import Sequence

STEPS = 64
"""Steps per frame of the trapezoidal rule that integrates 1 / speed over a ramp."""


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
    `playback`, further arguments and what it yields those of `smokelift.direct.new_sequence.directed_writer`. It is
    a ValueError if a file cannot be read or written.
    """
    times, speeds_shown = playback(len(sequence.frames), speeds)
    first, dt = sequence.frames[0], 1 / sequence.fps
    how = "Frames between those of the clip are made of both neighbors, carried there by the velocity."
    camera_frames = [first + float(at) for at in times]
    pair: dict[int, SmokeState] = {}
    with directed_writer(
        sequence, out, "retime", {"speeds": speeds}, how, camera_frames, npz=npz, resume=resume
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
