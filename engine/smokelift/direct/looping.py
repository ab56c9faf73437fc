"""A sequence that repeats without a seam."""

from __future__ import annotations

import time
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

from smokelift.direct.interpolation import interpolate
from smokelift.direct.moment import Moment, read_moment
from smokelift.direct.writing import SHORTEST, Written, directed_writer, simulated_figures, write_copy
from smokelift.output.sequence import Sequence
from smokelift.transport import Velocity
from smokelift.velocity import estimate_velocity

LONGEST_OVERLAP = 24
"""Frames that the start and the end of a loop share, at most, unless said otherwise. In a second the way from the one
to the other is slow beside the smoke's own motion."""


def usual_overlap(count: int) -> int:
    """Return the frames that the start and the end share of so many: a third."""
    return min(LONGEST_OVERLAP, count // 3)


def loop_length(sequence: Sequence, first: int, last: int, overlap: int) -> int:
    """Return how many frames a loop has.

    Raises
    ------
    ValueError
        If there are no such frames, or too few.
    """
    there = f"{sequence.directory}: has the frames {sequence.frames[0]} to {sequence.frames[-1]}"
    if not sequence.frames[0] <= first <= last <= sequence.frames[-1]:
        raise ValueError(f"{there}, not {first} to {last}.")
    count = last - first + 1
    if count < SHORTEST or not 1 <= overlap <= count // 2:
        raise ValueError(
            f"{there}; a loop of {count} of them can overlap by {max(count // 2, 1)} at most, not by {overlap}: "
            f"choose another --overlap, or more frames ({SHORTEST} at least)."
        )
    return count - overlap


def loop_sequence(
    sequence: Sequence, out: str | Path, first: int, last: int, overlap: int, *, npz: bool = False, resume: bool = False
) -> Iterator[Written]:
    """Write a part of a sequence so that its last frame leads to its first.

    The part overlaps with its own start. In the overlap the motion from the last density to the first is estimated, the
    last frames are advected along it and the first ones back, and the two are blended. So shapes move to where they
    have to be, and do not fade out in one place and in at another.

    Parameters
    ----------
    sequence
        See `smokelift.direct.writing.open_source`.
    out
        Directory to write to.
    first, last
        Frames of the part.
    overlap
        Frames in which the end becomes the start; the loop is shorter by so many.
    npz, resume
        As in `smokelift.output.writer.SequenceWriter`.

    Yields
    ------
    The number and the figures of every frame, which is written already.

    Raises
    ------
    ValueError
        See `loop_length`, or if a file cannot be read or written.
    """
    length = loop_length(sequence, first, last, overlap)
    settings = {"frames": [first, last], "overlap": overlap}
    how = f"In frames 1 to {overlap} the end of the loop becomes its start: both are carried to a shape between them."
    camera_frames = [float(first + n) for n in range(length)]
    with directed_writer(sequence, out, "loop", settings, how, camera_frames, npz=npz, resume=resume) as writer:
        for index in range(length):
            number, source = index + 1, first + index
            if number in writer.finished:
                continue
            began = time.perf_counter()
            if index < overlap:
                share = number / (overlap + 1)
                start, end = read_moment(sequence, source), read_moment(sequence, source + length)
                moment = seam(end, start, share, (overlap + 1) * (1 / sequence.fps))
                figures = simulated_figures(moment, began, "looped", {"place": source, "share": share})
                writer.write(number, moment.density, moment.velocity.faces, figures, flame=moment.flame)
                yield number, figures
            else:
                yield write_copy(sequence, source, writer, number, {"place": source})


def seam(end: Moment, start: Moment, share: float, duration: float) -> Moment:
    """The smoke on its way from one moment of a clip to another that it is to become.

    Parameters
    ----------
    end, start
        The moment that leaves, and the one that comes.
    share
        Of the way, 0 to 1.
    duration
        Seconds that the whole way takes. The velocity gains what moves the one's shapes to the other's in them.
    """
    if not (end.density.any() and start.density.any()):  # there are no shapes to carry
        way = Velocity.zero(end.velocity.shape, end.velocity.voxel_size, end.velocity.closed)
    else:
        velocity = end.velocity
        way = estimate_velocity(end.density, start.density, duration, velocity.voxel_size, closed=velocity.closed)
    moment = interpolate(end, start, way, duration, share)
    faces = [u + w for u, w in zip(moment.velocity.faces, way.faces, strict=True)]
    return replace(moment, velocity=Velocity((faces[0], faces[1], faces[2]), way.voxel_size, way.closed))
