"""``smokelift retime``: slow motion, fast motion and ramps of a sequence."""

from __future__ import annotations

import argparse

from smokelift.app.options import add_directed_options, finite_number, require_new
from smokelift.app.progress import Reporter, say_sequence
from smokelift.direct import open_source, playback, retime_sequence

SPEEDS = 0.01, 100.0
"""Slowest and fastest speed: beyond them nothing moves, or nothing is left."""

HELP = "make slow motion, fast motion and ramps of a sequence"


def add_options(parser: argparse.ArgumentParser) -> None:
    """Add the options of the command."""
    add_directed_options(parser)
    parser.add_argument(
        "--speed",
        type=finite_number,
        nargs="+",
        required=True,
        metavar="S",
        help="speed: 0.5 for half; several speeds are spread evenly over the clip, with ramps in between",
    )


def run(options: argparse.Namespace, say: Reporter) -> None:
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
