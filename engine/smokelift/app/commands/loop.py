"""``smokelift loop``: a part of a sequence that repeats without a seam."""

from __future__ import annotations

import argparse
import time
from typing import Any

from smokelift.app.options import add_directed_options, frame_range, require_new
from smokelift.app.progress import Reporter, say_frames
from smokelift.checks import Figures, Remark
from smokelift.direct import loop_length, loop_sequence, open_source, steady_part, usual_overlap


def add_parser(commands: Any, common: argparse.ArgumentParser) -> None:
    """Add the command."""
    parser = commands.add_parser("loop", parents=[common], help="make a part of a sequence repeat without a seam")
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
        help="frames in which the end becomes the start (default: a third of the part, 24 at most)",
    )
    parser.set_defaults(run=run)


def run(options: argparse.Namespace, say: Reporter) -> None:
    """Loop the sequence, and say every frame."""
    began = time.monotonic()
    sequence = open_source(options.directory)
    first, last = options.frames or steady_part(sequence, options.overlap)
    overlap = usual_overlap(last - first + 1) if options.overlap is None else options.overlap
    total = loop_length(sequence, first, last, overlap)
    require_new(options)
    written = loop_sequence(sequence, options.out, first, last, overlap, npz=options.npz, resume=options.resume)
    say_frames(say, written, 1, total)
    seconds = time.monotonic() - began
    result: Figures = {"directory": str(options.out), "frames": total, "seconds": round(seconds, 1)}
    say.finish(Remark("looped", {**result, "first": first, "last": last}), result)
