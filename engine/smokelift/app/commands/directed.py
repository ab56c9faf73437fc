"""``smokelift continue``, ``retime`` and ``loop``: what is made of a sequence after its clip."""

import argparse
import math
from collections.abc import Iterable, Iterator
from dataclasses import replace

from smokelift.app.options import add_directed_options, finite_number, frame_range, named_path, require_new
from smokelift.app.progress import Reporter, say_sequence
from smokelift.checks import Finding
from smokelift.direct.continuation import CONTRADICTED, DISSOLVED, ROOM, Continuation, continue_sequence
from smokelift.direct.mesh import Mesh
from smokelift.direct.retiming import (
    default_overlap,
    loop_length,
    loop_sequence,
    playback,
    retime_sequence,
    steady_part,
)
from smokelift.direct.state import Written, open_source
from smokelift.direct.surroundings import Fan, Turbulence
from smokelift.output.index import INDEX, Index
from smokelift.output.sequence import Sequence
from smokelift.report.cost import affordable_room
from smokelift.scene import SIDES

MIN_DISSOLVED_FRACTION = 1e-3
"""Fraction of a frame's smoke that dissolves before its box's end, from which on it is said."""

SPEEDS = 0.01, 100.0
"""Slowest and fastest speed: beyond them nothing moves, or nothing is left."""


def add_continue_options(parser: argparse.ArgumentParser) -> None:
    add_directed_options(parser)
    parser.add_argument("--frames", type=int, required=True, metavar="N", help="number of frames to add")
    parser.add_argument(
        "--start", type=int, metavar="FRAME", help="the last frame that stays as it is (default: the sequence's last)"
    )
    parser.add_argument(
        "--fade", type=int, default=0, metavar="N", help="let the smoke fade to nothing in the last N frames"
    )
    wind = "velocity in m/s that all air gains"
    parser.add_argument("--wind", type=finite_number, nargs=3, default=(0, 0, 0), metavar=("X", "Y", "Z"), help=wind)
    _add_repeatable(
        parser,
        "--turbulence",
        ("SPEED", "SIZE", "SEED"),
        "eddies in all air: their speed in m/s, their size in meters, and a whole number (each makes others)",
    )
    _add_repeatable(
        parser,
        "--fan",
        ("X", "Y", "Z", "RADIUS", "VX", "VY", "VZ"),
        "a ball in which air is blown: center and radius in meters, velocity in m/s",
    )
    parser.add_argument(
        "--mesh",
        type=named_path,
        action="append",
        default=[],
        metavar="FILE",
        help="an obstacle of any shape: a closed mesh in a binary STL file, in meters, Z up; mesh_####.stl for one "
        "that moves, with a file for the last frame that stays and for each after it; may be given again",
    )
    parser.add_argument(
        "--closed",
        nargs="+",
        choices=SIDES,
        default=[],
        metavar="SIDE",
        help=f"sides of the box that become walls, of {', '.join(SIDES)}; those of the clip stay walls",
    )
    parser.add_argument(
        "--room",
        type=finite_number,
        default=ROOM,
        metavar="TIMES",
        help="let the box grow with the smoke to at most so many times the clip's size; 1 keeps it",
    )
    parser.add_argument(
        "--buoyancy",
        type=finite_number,
        metavar="ACCELERATION",
        help="upward acceleration of smoke of density 1, in m/s2; smoke sinks below 0 (default: the clip's)",
    )
    parser.add_argument(
        "--dissipation",
        type=finite_number,
        metavar="RATE",
        help="part of the smoke that dissolves in a second, as a rate in 1/s, at least 0 (default: the clip's)",
    )


def _add_repeatable(parser: argparse.ArgumentParser, option: str, values: tuple[str, ...], what: str) -> None:
    parser.add_argument(
        option,
        type=finite_number,
        nargs=len(values),
        action="append",
        default=[],
        metavar=values,
        help=f"{what}; may be given again",
    )


def continue_(options: argparse.Namespace, say: Reporter) -> None:
    """Continue the sequence, and say every frame."""
    continuation = _continuation(options)
    sequence = open_source(options.directory)
    require_new(options)
    continuation = replace(continuation, room=_room(options, sequence, say))
    start = sequence.frames[-1] if continuation.start is None else continuation.start
    written = continue_sequence(sequence, options.out, continuation, npz=options.npz, resume=options.resume)
    written = _with_note(written, continuation.room, say)
    total = start - sequence.frames[0] + 1 + continuation.frames
    first, simulated = sequence.frames[0], continuation.frames
    say_sequence(say, written, kind="continued", directory=options.out, start=first, total=total, simulated=simulated)


def _room(options: argparse.Namespace, sequence: Sequence, say: Reporter) -> float:
    """The room that is asked for, as far as memory allows; a resumed run keeps its own."""
    room: float = options.room
    if options.resume and (options.out / INDEX).is_file():
        return min(room, float(Index.read(options.out).settings.get("direct", {}).get("room", room)))
    affordable = affordable_room(sequence.scene.domain.resolution)
    if room > max(affordable, 1.0):
        room = max(1.0, math.floor(10 * affordable) / 10)
        say.note(
            f"Memory limits the smoke's room: its box grows to {room:g} times the clip's at most, not to "
            f"{options.room:g} times; close other programs, or continue a result with fewer voxels."
        )
    return room


def _with_note(written: Iterable[Written], room: float, say: Reporter) -> Iterator[Written]:
    """The frames, with a note on a buoyancy that is not taken, and one when smoke first dissolves for want of room."""
    said = contradicted = False
    for number, figures in written:
        yield number, figures
        if not contradicted and (buoyancy := figures.get(CONTRADICTED, 0.0)):
            contradicted = True
            motion = "rises" if buoyancy < 0 else "sinks"
            say.note(Finding("contradicted buoyancy", {"buoyancy": buoyancy, "motion": motion}, doubt=True))
        if not said and figures.get(DISSOLVED, 0.0) > MIN_DISSOLVED_FRACTION:
            said = True
            say.note(Finding("dissolving smoke", {"frame": number, "room": room}, doubt=True))


def _continuation(options: argparse.Namespace) -> Continuation:
    """The continuation that the options say; ValueError for wrong values."""
    if options.frames < 1:
        raise ValueError(f"--frames {options.frames}: expected 1 or more.")
    if not 0 <= options.fade <= options.frames:
        raise ValueError(f"--fade {options.fade}: expected 0 to {options.frames}, as many frames as are added.")
    if options.dissipation is not None and options.dissipation < 0:
        raise ValueError(f"--dissipation {options.dissipation:g}: expected 0 or more, in 1/s.")
    if options.room < 1:
        raise ValueError(f"--room {options.room:g}: expected 1 or more, in boxes of the clip.")
    return Continuation(
        frames=options.frames,
        start=options.start,
        fade=options.fade,
        wind=tuple(options.wind),
        turbulences=tuple(_turbulence(*values) for values in options.turbulence),
        fans=tuple(_fan(*values) for values in options.fan),
        obstacles=tuple(map(Mesh.read, options.mesh)),
        closed=tuple(side for side in SIDES if side in options.closed),
        room=options.room,
        buoyancy=options.buoyancy,
        dissipation=options.dissipation,
    )


def _turbulence(speed: float, size: float, seed: float) -> Turbulence:
    if speed < 0 or size <= 0 or seed < 0 or seed != int(seed):
        raise ValueError(
            f"--turbulence {speed:g} {size:g} {seed:g}: expected a speed of 0 m/s or more, a size above 0 m, and "
            "a whole number from 0."
        )
    return Turbulence(speed, size, int(seed))


def _fan(x: float, y: float, z: float, radius: float, *velocity: float) -> Fan:
    if radius <= 0:
        raise ValueError(f"--fan: the radius must be above 0 m, not {radius:g}.")
    return Fan((x, y, z), radius, (velocity[0], velocity[1], velocity[2]))


def add_retime_options(parser: argparse.ArgumentParser) -> None:
    add_directed_options(parser)
    parser.add_argument(
        "--speed",
        type=finite_number,
        nargs="+",
        required=True,
        metavar="S",
        help="speed: 0.5 for half; several speeds are spread evenly over the clip, with ramps in between",
    )


def retime(options: argparse.Namespace, say: Reporter) -> None:
    """Retime the sequence, and say every frame."""
    for speed in options.speed:
        if not SPEEDS[0] <= speed <= SPEEDS[1]:
            raise ValueError(f"--speed {speed:g}: expected a number from {SPEEDS[0]:g} to {SPEEDS[1]:g}.")
    sequence = open_source(options.directory)
    require_new(options)
    speeds = tuple(options.speed)
    total = len(playback(len(sequence.frames), speeds)[0])
    written = retime_sequence(sequence, options.out, speeds, npz=options.npz, resume=options.resume)
    say_sequence(say, written, kind="written", directory=options.out, total=total)


def add_loop_options(parser: argparse.ArgumentParser) -> None:
    add_directed_options(parser)
    parser.add_argument(
        "--frames",
        type=frame_range,
        metavar="A:B",
        help="first and last frame of the part, counted from 1 (default: where the smoke is steady)",
    )
    parser.add_argument(
        "--overlap",
        type=int,
        metavar="N",
        help="frames in which the end becomes the start (default: a third, up to 24)",
    )


def loop(options: argparse.Namespace, say: Reporter) -> None:
    """Loop the sequence, and say every frame."""
    sequence = open_source(options.directory)
    first, last = options.frames or steady_part(sequence, options.overlap)
    overlap = default_overlap(last - first + 1) if options.overlap is None else options.overlap
    total = loop_length(sequence, first, last, overlap)
    require_new(options)
    written = loop_sequence(sequence, options.out, first, last, overlap, npz=options.npz, resume=options.resume)
    say_sequence(say, written, kind="looped", directory=options.out, total=total, first=first, last=last)
