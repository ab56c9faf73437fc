"""``smokelift chart``: speed against accuracy, from measured runs."""

from __future__ import annotations

import argparse
from typing import Any

from smokelift.app.options import named_path, require_folder
from smokelift.app.progress import Reporter
from smokelift.evaluation.measured_runs import read_runs
from smokelift.evaluation.speed_accuracy_chart import draw


def add_parser(commands: Any, common: argparse.ArgumentParser) -> None:
    """Add the command."""
    parser = commands.add_parser("chart", parents=[common], help="speed against accuracy, from measured runs")
    parser.add_argument("csv", type=named_path, help="written by python -m benchmarks.accuracy")
    parser.add_argument("--out", type=named_path, required=True, metavar="chart.png", help="the picture, .png")
    parser.set_defaults(run=run)


def run(options: argparse.Namespace, say: Reporter) -> None:
    """Draw the chart."""
    require_folder(options.out)
    draw(read_runs(options.csv), options.out)
    say.finish(f"{options.out} written.", {"file": str(options.out)})
