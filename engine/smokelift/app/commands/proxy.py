"""``smokelift proxy``: coarse copies of a sequence's frames, for viewports."""

from __future__ import annotations

import argparse

from smokelift.app.options import named_path
from smokelift.app.progress import Reporter, say_made
from smokelift.checks import Finding
from smokelift.output.export import write_proxies
from smokelift.output.sequence import Sequence
from smokelift.output.vdb import MIN_PROXY_VOXELS, PROXY_TIMES

HELP = (
    f"write coarse copies of a sequence's frames for viewports, with voxels {PROXY_TIMES} times as large, beside its "
    "files"
)


def add_options(parser: argparse.ArgumentParser) -> None:
    """Add the options of the command."""
    parser.description = f"{HELP.capitalize()}. A run writes them itself from {MIN_PROXY_VOXELS:,} voxels on."
    parser.add_argument("directory", type=named_path, help="directory of the sequence")


def run(options: argparse.Namespace, say: Reporter) -> None:
    """Write a copy of every frame."""
    sequence = Sequence.open(options.directory)
    frames = len(sequence.frames)
    say_made(say, ((number, number) for number in write_proxies(sequence)), frames, "made coarser")
    say.finish(Finding("proxy", {"frames": frames, "directory": str(sequence.directory)}), {"frames": frames})
