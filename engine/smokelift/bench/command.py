"""``smokelift bench renderer``: its options, and what it does with them."""

from __future__ import annotations

import argparse
import json
from pathlib import Path
from typing import Any

from smokelift.bench.peers import PEERS
from smokelift.progress import Reporter
from smokelift.render import device

SMALLEST = 8


def add_parser(commands: Any) -> None:
    """Add the command to the command line's parsers."""
    bench = commands.add_parser("bench", help="how fast this is, beside others on the same machine")
    subjects = bench.add_subparsers(dest="subject", required=True)
    renderer = subjects.add_parser("renderer", help="one iteration, image and gradient")
    renderer.add_argument("--sizes", type=_sizes, default=(32, 64, 128, 256), metavar="N,N", help="voxels a side")
    renderer.add_argument("--peers", type=_peers, default=tuple(PEERS), metavar="A,B", help=f"of {', '.join(PEERS)}")
    renderer.add_argument("--device", choices=("cpu", "gpu"), default="cpu", help="for ours; peers use the processor")
    renderer.add_argument("--json", type=Path, metavar="FILE", help="write every figure")
    renderer.add_argument("--chart", type=Path, metavar="FILE", help="draw time against size and against share (.png)")
    renderer.add_argument("--progress", choices=("text", "json"), default="text", help="a table, or JSON objects")


def bench(options: argparse.Namespace, say: Reporter) -> None:
    """Run the benchmark; the table is the last thing that is said.

    Raises
    ------
    ValueError
        If a file cannot be written, or without matplotlib for a chart: before anything runs.
    DeviceError
        If a GPU is asked for and there is none.
    """
    from smokelift.bench import chart, renderer, table  # the other commands do not want these

    for path in (options.json, options.chart):
        if path is not None and not path.absolute().parent.is_dir():
            raise ValueError(f"{path}: the folder {path.parent} does not exist.")
    if options.chart is not None:
        chart.require_matplotlib()
    if options.device == "gpu" and device.available_gpu() is None:
        raise device.DeviceError("No GPU that Taichi can use was found (CUDA, Metal or Vulkan); leave --device away.")

    def save(results: dict[str, Any]) -> None:
        if options.json is not None:
            options.json.write_text(json.dumps(results, indent=1) + "\n")

    results = renderer.run(options.sizes, options.peers, options.device, say.note, save)
    if options.chart is not None:
        chart.draw(results, options.chart)
    say.finish(table.text(results), results)


def _sizes(text: str) -> tuple[int, ...]:
    try:
        sizes = tuple(sorted({int(part) for part in text.split(",")}))
    except ValueError:
        sizes = (0,)
    if sizes[0] < SMALLEST:
        raise argparse.ArgumentTypeError(f"{text!r}: expected numbers of voxels N,N, none below {SMALLEST}")
    return sizes


def _peers(text: str) -> tuple[str, ...]:
    names = tuple(text.split(","))
    for name in names:
        if name not in PEERS:
            raise argparse.ArgumentTypeError(f"{name!r}: expected some of {', '.join(PEERS)}")
    return names
