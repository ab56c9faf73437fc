"""A sequence at another pace."""

from __future__ import annotations

import time
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np
import numpy.typing as npt

from smokelift.direct.between import between
from smokelift.direct.moment import Moment, read_moment
from smokelift.direct.writing import Written, directed_writer, simulated_figures, time_step
from smokelift.output.sequence import Sequence

Values = npt.NDArray[np.float64]

STEPS = 64
"""Parts into which a frame is divided to add up the time of a ramp."""


def paced(count: int, speeds: tuple[float, ...]) -> tuple[Values, Values]:
    """Return the moments of a clip that a pace shows, and how fast the clip goes there.

    Parameters
    ----------
    count
        Frames of the clip.
    speeds
        1 is the clip's own speed. Several lie evenly from its first frame to its last, and change linearly in between.

    Returns
    -------
    Places in frames from 0, and the speed at each.
    """
    fine = np.linspace(0, count - 1, STEPS * (count - 1) + 1)
    speed = np.interp(fine, np.linspace(0, count - 1, len(speeds)), speeds)
    parts = np.diff(fine) * (1 / speed[1:] + 1 / speed[:-1]) / 2
    shown = np.concatenate([[0.0], np.cumsum(parts)])
    frames = np.arange(np.floor(shown[-1] + 1e-6) + 1)
    places = np.interp(frames, shown, fine)
    return places, np.interp(places, fine, speed)


def retime_sequence(
    sequence: Sequence, out: str | Path, speeds: tuple[float, ...], *, npz: bool = False, resume: bool = False
) -> Iterator[Written]:
    """Write a sequence at another pace: frames between the clip's own are carried there from both sides.

    Velocities are those that are seen: at half the speed half of the smoke's.

    Parameters
    ----------
    sequence
        See `smokelift.direct.writing.open_source`.
    out
        Directory to write to.
    speeds
        See `paced`.
    npz, resume
        As in `smokelift.output.writer.SequenceWriter`.

    Yields
    ------
    The number and the figures of every frame, which is written already.

    Raises
    ------
    ValueError
        If a file cannot be read or written.
    """
    places, pace = paced(len(sequence.frames), speeds)
    first, dt = sequence.frames[0], time_step(sequence)
    how = "Frames between those of the clip are made of both neighbours, carried there by the velocity."
    cameras = [first + float(place) for place in places]
    pair: dict[int, Moment] = {}
    with directed_writer(sequence, out, "retime", {"speeds": speeds}, how, cameras, npz=npz, resume=resume) as writer:
        for number, (place, speed) in enumerate(zip(places.tolist(), pace.tolist(), strict=True), 1):
            if number in writer.finished:
                continue
            began = time.perf_counter()
            low = first + min(int(place), len(sequence.frames) - 2)
            pair = {n: pair[n] if n in pair else read_moment(sequence, n) for n in (low, low + 1)}
            before, after = pair[low], pair[low + 1]
            moment = between(before, after, after.velocity, dt, place + first - low)
            faces = moment.velocity.with_faces(np.float32(speed) * u for u in moment.velocity.faces)
            figures = simulated_figures(
                replace(moment, velocity=faces), began, "retimed", {"place": place, "speed": speed}
            )
            writer.write(number, moment.density, faces.faces, figures, flame=moment.flame)
            yield number, figures
