"""``smokelift proxy``: coarse copies of a sequence's frames, for viewports."""

from __future__ import annotations

import argparse
import time
from typing import Any

from smokelift.app.options import named_path
from smokelift.app.progress import Reporter
from smokelift.checks import Remark
from smokelift.output.proxy_files import MIN_PROXY_VOXELS, TIMES, write_proxies
from smokelift.output.sequence import Sequence


def add_parser(commands: Any, common: argparse.ArgumentParser) -> None:
    """Add the command."""
    text = f"coarse copies of a sequence's frames for viewports, with voxels {TIMES} times as large, beside its files"
    parser = commands.add_parser(
        "proxy",
        parents=[common],
        help=f"write {text}",
        description=f"Write {text}. A run writes them itself from {MIN_PROXY_VOXELS:,} voxels on.",
    )
    parser.add_argument("directory", type=named_path, help="directory of the sequence")
    parser.set_defaults(run=run)


def run(options: argparse.Namespace, say: Reporter) -> None:
    """Write the copies of all frames."""
    sequence = Sequence.open(options.directory)
    say.start(len(sequence.frames), 0)
    before = time.monotonic()
    for number in write_proxies(sequence):
        now = time.monotonic()
        say.frame(number, {"origin": "made coarser", "seconds_density": now - before, "seconds_velocity": 0.0})
        before = now
    frames = len(sequence.frames)
    say.finish(Remark("proxy", {"frames": frames, "directory": str(sequence.directory)}), {"frames": frames})
