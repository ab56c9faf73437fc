"""``smokelift bench``: speed and error beside others, measured by the benchmarks of the source."""

from __future__ import annotations

import argparse
import sys
from typing import Any

from smokelift.app.progress import Reporter


def add_parser(commands: Any, common: argparse.ArgumentParser) -> None:
    """Add the command; every word after it, options too, goes to the benchmarks' own parser."""
    parser = commands.add_parser(
        "bench", help="speed and error beside others on the same machine", prefix_chars="+", add_help=False
    )
    parser.add_argument("arguments", nargs="*")
    parser.set_defaults(run=run)


def run(options: argparse.Namespace, say: Reporter) -> None:
    """Run the benchmarks, if they are there."""
    sys.path.append("")  # a console script does not look into the current folder, as `python -m` does
    try:
        from benchmarks import command
    except ModuleNotFoundError as missing:
        if missing.name is None or not missing.name.startswith("benchmarks"):
            raise
        raise ValueError(
            "The benchmarks are in the folder benchmarks of Smokelift's source and in no wheel: "
            "run `python -m benchmarks` (or `smokelift bench`) in the source's folder."
        ) from None
    command.run(options.arguments, say)
