"""``smokelift proxy``: coarse copies of a sequence's frames, for viewports."""

from __future__ import annotations

import argparse
import time

from smokelift.app.options import named_path
from smokelift.app.progress import Reporter
from smokelift.checks import Finding
from smokelift.output.proxy_files import MIN_PROXY_VOXELS, TIMES, write_proxies
from smokelift.output.sequence import Sequence

HELP = f"write coarse copies of a sequence's frames for viewports, with voxels {TIMES} times as large, beside its files"


def add_options(parser: argparse.ArgumentParser) -> None:
    """Add the options of the command."""
    parser.description = f"{HELP.capitalize()}. A run writes them itself from {MIN_PROXY_VOXELS:,} voxels on."
    parser.add_argument("directory", type=named_path, help="directory of the sequence")


def run(options: argparse.Namespace, say: Reporter) -> None:
    """Write a copy of every frame."""
    sequence = Sequence.open(options.directory)
    say.start(len(sequence.frames), 0)
    before = time.monotonic()
    for number in write_proxies(sequence):
        now = time.monotonic()
        say.frame(number, {"origin": "made coarser", "seconds_density": now - before, "seconds_velocity": 0.0})
        before = now
    frames = len(sequence.frames)
    say.finish(Finding("proxy", {"frames": frames, "directory": str(sequence.directory)}), {"frames": frames})
