"""``smokelift bench renderer | velocity | pipeline``: their options, and what they do with them."""

from __future__ import annotations

import argparse
import json
import math
from collections.abc import Callable, Collection
from pathlib import Path
from typing import Any

from smokelift.app.progress import Reporter
from smokelift.bench.peers import PEERS
from smokelift.evaluation.truth import Truth
from smokelift.render import device
from smokelift.setup.settings import METHODS, QUALITIES

SMALLEST = 8
"""Voxels a side for the renderer."""

SMALLEST_SHAPE = 16
"""Voxels a side for velocities, which want a coarser grid too."""

SHAPES = ((64, 64, 96), (128, 128, 192), (256, 256, 288))
"""The paper's."""


def add_parser(commands: Any) -> None:
    """Add the command to the command line's parsers."""
    bench = commands.add_parser("bench", help="how fast this is, beside others on the same machine")
    subjects = bench.add_subparsers(dest="subject", required=True)
    renderer = subjects.add_parser("renderer", help="one iteration, image and gradient")
    renderer.add_argument("--sizes", type=_sizes, default=(32, 64, 128, 256), metavar="N,N", help="voxels a side")
    renderer.add_argument(
        "--peers", type=_some_of(PEERS), default=tuple(PEERS), metavar="A,B", help=f"of {', '.join(PEERS)}"
    )
    renderer.add_argument("--device", choices=("cpu", "gpu"), default="cpu", help="for ours; peers use the processor")
    _add_outputs(renderer, "draw time against size and against share (.png)")
    velocity = subjects.add_parser("velocity", help="error against time, of both solvers and of whole estimates")
    velocity.add_argument("truths", nargs="*", type=Path, metavar="TRUTH.npz", help="known scenes; one is built in")
    velocity.add_argument("--sizes", type=_shapes, default=SHAPES, metavar="XxYxZ,...", help="voxels along x, y and z")
    _add_outputs(velocity, "draw error against time (.png)")
    pipeline = subjects.add_parser("pipeline", help="whole runs, from a clip to files on disk")
    pipeline.add_argument("scene", nargs="?", type=Path, metavar="SCENE.toml", help="a clip; one is built in")
    pipeline.add_argument("--sizes", type=_shapes, default=SHAPES, metavar="XxYxZ,...", help="voxels along x, y and z")
    pipeline.add_argument("--quality", choices=QUALITIES, default="balanced")
    pipeline.add_argument(
        "--methods", type=_some_of(METHODS), default=("default",), metavar="A,B", help="default, paper"
    )
    pipeline.add_argument("--frames", type=_count, default=5, help="that are clocked, after two")
    _add_json(pipeline)


def _add_outputs(parser: argparse.ArgumentParser, chart: str) -> None:
    _add_json(parser)
    parser.add_argument("--chart", type=Path, metavar="FILE", help=chart)


def _add_json(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("--json", type=Path, metavar="FILE", help="write every figure")
    parser.add_argument("--progress", choices=("text", "json"), default="text", help="a table, or JSON objects")


def bench(options: argparse.Namespace, say: Reporter) -> None:
    """Run a benchmark; the table is the last thing that is said.

    Raises
    ------
    ValueError
        If a file cannot be written or read, or without matplotlib for a chart: before anything runs.
    DeviceError
        If a GPU is asked for and there is none.
    """
    from smokelift.bench import chart  # the other commands do not want this

    drawn: Path | None = getattr(options, "chart", None)
    for path in (options.json, drawn):
        if path is not None and not path.absolute().parent.is_dir():
            raise ValueError(f"{path}: the folder {path.parent} does not exist.")
    if drawn is not None:
        chart.require_matplotlib()

    def save(results: dict[str, Any]) -> None:
        if options.json is not None:
            options.json.write_text(json.dumps(results, indent=1) + "\n")

    {"renderer": _renderer, "velocity": _velocity, "pipeline": _pipeline}[options.subject](options, say, save)


def _renderer(options: argparse.Namespace, say: Reporter, save: Callable[[dict[str, Any]], None]) -> None:
    from smokelift.bench import chart, renderer, table

    if options.device == "gpu" and device.available_gpu() is None:
        raise device.DeviceError("No GPU that Taichi can use was found (CUDA, Metal or Vulkan); leave --device away.")
    results = renderer.run(options.sizes, options.peers, options.device, say.note, save)
    if options.chart is not None:
        chart.draw(results, options.chart)
    say.finish(table.text(results), results)


def _velocity(options: argparse.Namespace, say: Reporter, save: Callable[[dict[str, Any]], None]) -> None:
    from smokelift.bench.velocity import chart, run, table

    truths = []
    for path in options.truths:
        truth = Truth.load(path)
        if truth.shape not in options.sizes:
            size, sizes = run.size_text(truth.shape), ",".join(map(run.size_text, options.sizes))
            raise ValueError(f"{path}: is of {size} voxels and none of --sizes {sizes}; scenes are not resampled.")
        truths.append((path.parent.name if path.name == "truth.npz" else path.stem, truth))
    results = run.run(options.sizes, truths, say.note, save)
    if options.chart is not None:
        chart.draw(results, options.chart)
    say.finish(table.text(results), results)


def _pipeline(options: argparse.Namespace, say: Reporter, save: Callable[[dict[str, Any]], None]) -> None:
    from smokelift.bench.pipeline import run, table

    results = run.run(options.scene, options.sizes, options.methods, options.quality, options.frames, say.note, save)
    say.finish(table.text(results), results)


def _count(text: str) -> int:
    if not text.isdigit() or int(text) == 0:
        raise argparse.ArgumentTypeError(f"{text!r}: expected a number of frames")
    return int(text)


def _shapes(text: str) -> tuple[tuple[int, ...], ...]:
    try:
        shapes = {tuple(int(count) for count in part.split("x")) for part in text.split(",")}
    except ValueError:
        shapes = {()}
    if any(len(shape) != 3 or min(shape) < SMALLEST_SHAPE for shape in shapes):
        raise argparse.ArgumentTypeError(
            f"{text!r}: expected numbers of voxels XxYxZ,XxYxZ, none below {SMALLEST_SHAPE}"
        )
    return tuple(sorted(shapes, key=math.prod))


def _sizes(text: str) -> tuple[int, ...]:
    try:
        sizes = tuple(sorted({int(part) for part in text.split(",")}))
    except ValueError:
        sizes = (0,)
    if sizes[0] < SMALLEST:
        raise argparse.ArgumentTypeError(f"{text!r}: expected numbers of voxels N,N, none below {SMALLEST}")
    return sizes


def _some_of(known: Collection[str]) -> Callable[[str], tuple[str, ...]]:
    """What reads names of these, with commas between them."""

    def read(text: str) -> tuple[str, ...]:
        names = tuple(text.split(","))
        for name in names:
            if name not in known:
                raise argparse.ArgumentTypeError(f"{name!r}: expected some of {', '.join(known)}")
        return names

    return read
