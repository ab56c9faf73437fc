"""``smokelift retime``: slow motion, fast motion and ramps of a sequence."""

from __future__ import annotations

import argparse
import time
from typing import Any

from smokelift.app.options import add_directed_options, finite_number, require_new
from smokelift.app.progress import Reporter, say_frames
from smokelift.checks import Figures, Remark
from smokelift.direct import open_source, playback, retime_sequence

SPEEDS = 0.01, 100.0
"""Slowest and fastest: beyond them nothing moves, or nothing is left."""


def add_parser(commands: Any, common: argparse.ArgumentParser) -> None:
    """Add the command."""
    parser = commands.add_parser(
        "retime", parents=[common], help="make slow motion, fast motion and ramps of a sequence"
    )
    add_directed_options(parser)
    parser.add_argument(
        "--speed",
        type=finite_number,
        nargs="+",
        required=True,
        metavar="S",
        help="speed: 0.5 for half; several speeds are spread evenly over the clip, with ramps in between",
    )
    parser.set_defaults(run=run)


def run(options: argparse.Namespace, say: Reporter) -> None:
    """Retime the sequence, and say every frame."""
    began = time.monotonic()
    for speed in options.speed:
        if not SPEEDS[0] <= speed <= SPEEDS[1]:
            raise ValueError(f"--speed {speed:g}: expected a number from {SPEEDS[0]:g} to {SPEEDS[1]:g}.")
    sequence = open_source(options.directory)
    require_new(options)
    speeds = tuple(options.speed)
    total = len(playback(len(sequence.frames), speeds)[0])
    say_frames(say, retime_sequence(sequence, options.out, speeds, npz=options.npz, resume=options.resume), 1, total)
    seconds = time.monotonic() - began
    result: Figures = {"directory": str(options.out), "frames": total, "seconds": round(seconds, 1)}
    say.finish(Remark("written", result), result)
