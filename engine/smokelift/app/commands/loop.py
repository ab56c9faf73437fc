"""``smokelift loop``: a part of a sequence that repeats without a seam."""

from __future__ import annotations

import argparse

from smokelift.app.options import add_directed_options, frame_range, require_new
from smokelift.app.progress import Reporter, say_sequence
from smokelift.direct import default_overlap, loop_length, loop_sequence, open_source, steady_part

HELP = "make a part of a sequence repeat without a seam"


def add_options(parser: argparse.ArgumentParser) -> None:
    """Add the options of the command."""
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


def run(options: argparse.Namespace, say: Reporter) -> None:
    """Loop the sequence, and say every frame."""
    sequence = open_source(options.directory)
    first, last = options.frames or steady_part(sequence, options.overlap)
    overlap = default_overlap(last - first + 1) if options.overlap is None else options.overlap
    total = loop_length(sequence, first, last, overlap)
    require_new(options)
    written = loop_sequence(sequence, options.out, first, last, overlap, npz=options.npz, resume=options.resume)
    say_sequence(say, written, kind="looped", directory=options.out, total=total, first=first, last=last)
