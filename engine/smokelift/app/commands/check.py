"""``smokelift check``: whether a sequence is whole."""

from __future__ import annotations

import argparse

from smokelift.app.options import named_path
from smokelift.app.progress import Reporter
from smokelift.checks import counted
from smokelift.output.sequence import Sequence
from smokelift.report.result import count_empty, shortcomings

HELP = "check that a sequence is complete and undamaged"


def add_options(parser: argparse.ArgumentParser) -> None:
    """Add the options of the command."""
    parser.add_argument("directory", type=named_path, help="directory of the sequence")


def run(options: argparse.Namespace, say: Reporter) -> None:
    """Check every file; ValueError if frames are missing or damaged, or none shows smoke."""
    sequence = Sequence.open(options.directory)
    if not sequence.complete:
        there = counted(len(sequence.frames), "finished frame")
        raise ValueError(f"{options.directory}: has only {there} and is not a complete run; resume it.")
    for number in sequence.frames:
        if not sequence.files(number):
            raise ValueError(
                f"{options.directory}: the file of frame {number} is missing. Copy or make the sequence again."
            )
    figures = [sequence.figures(number) for number in sequence.frames]
    empty = count_empty(figures)
    if empty == len(figures):
        raise ValueError(f"{options.directory}: no frame shows smoke. Make it again with another background.")
    for note in shortcomings(figures):
        say.note(note)
    count = len(sequence.frames)
    text = f"All of {options.directory} is as it was written: {counted(count, 'frame')}."
    say.finish(text, {"frames": count, "empty": empty})
