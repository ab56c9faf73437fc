"""The options of ``python -m benchmarks renderer | velocity | pipeline``, and what they run."""

from __future__ import annotations

import argparse
import json
import math
from collections.abc import Callable, Collection, Sequence
from pathlib import Path
from typing import Any

from benchmarks.renderer.peers import PEERS
from benchmarks.tables import size_text
from smokelift.app.progress import Reporter, reporter
from smokelift.evaluation.truth import Truth
from smokelift.output.vdb import VdbUnavailable
from smokelift.render import device
from smokelift.setup.settings import METHODS, QUALITIES
from smokelift_command import BAD_INPUT, CANCELLED, DONE, NO_DEVICE

SMALLEST = 8
"""Voxels a side of the smallest grid for the renderer."""

SMALLEST_SHAPE = 16
"""Voxels a side of the smallest grid for velocities: their solver needs a coarser grid too."""

SHAPES = ((64, 64, 96), (128, 128, 192), (256, 256, 288))
"""The resolutions of the paper's table 2."""

Save = Callable[[dict[str, Any]], None]


def main(arguments: Sequence[str] | None = None) -> int:
    """Run a benchmark and return the exit status, as the command line ``smokelift`` does."""
    options, say = bench_parser().parse_args(arguments), reporter("text")
    try:
        with say:
            run(options, say)
    except KeyboardInterrupt:
        say.fail("Cancelled.", CANCELLED)
        return CANCELLED
    except (device.DeviceError, MemoryError) as error:
        say.fail(str(error) or "Out of memory; choose smaller --sizes.", NO_DEVICE)
        return NO_DEVICE
    except (ValueError, OSError, VdbUnavailable) as error:
        say.fail(str(error), BAD_INPUT)
        return BAD_INPUT
    return DONE


def run(options: argparse.Namespace, say: Reporter) -> None:
    """Run the benchmark that the options ask for; its table is the last thing printed.

    Raises
    ------
    ValueError
        Before anything runs, if a file cannot be written or read.
    DeviceError
        If a GPU is asked for and there is none.
    """
    path: Path | None = options.json
    if path is not None and not path.absolute().parent.is_dir():
        raise ValueError(f"{path}: the folder {path.parent} does not exist.")

    def save(results: dict[str, Any]) -> None:
        if options.json is not None:
            options.json.write_text(json.dumps(results, indent=1) + "\n")

    options.run(options, say, save)


def bench_parser() -> argparse.ArgumentParser:
    """Return the parser of the words after ``python -m benchmarks``."""
    parser = argparse.ArgumentParser(
        prog="python -m benchmarks", description="Measure speed and error, beside others on the same machine."
    )
    subjects = parser.add_subparsers(required=True)

    renderer = subjects.add_parser("renderer", help="one iteration: image and gradient")
    renderer.set_defaults(run=_renderer)
    renderer.add_argument("--sizes", type=_sizes, default=(32, 64, 128, 256), metavar="N,N", help="voxels a side")
    renderer.add_argument(
        "--peers", type=_some_of(PEERS), default=tuple(PEERS), metavar="A,B", help=f"of {', '.join(PEERS)}"
    )
    renderer.add_argument(
        "--device", choices=("cpu", "gpu"), default="cpu", help="for Smokelift; all others use the processor"
    )
    _add_json(renderer)

    velocity = subjects.add_parser("velocity", help="error against time of whole estimates")
    velocity.set_defaults(run=_velocity)
    velocity.add_argument("truths", nargs="*", type=Path, metavar="TRUTH.npz", help="known scenes; one is built in")
    _add_shapes(velocity)
    _add_json(velocity)

    pipeline = subjects.add_parser("pipeline", help="whole runs, from a clip to files on disk")
    pipeline.set_defaults(run=_pipeline)
    pipeline.add_argument("scene", nargs="?", type=Path, metavar="SCENE.toml", help="a clip; one is built in")
    _add_shapes(pipeline)
    pipeline.add_argument("--quality", choices=QUALITIES, default="balanced")
    pipeline.add_argument(
        "--methods", type=_some_of(METHODS), default=("default",), metavar="A,B", help=f"of {', '.join(METHODS)}"
    )
    pipeline.add_argument("--frames", type=_count, default=5, help="frames to time, after two that are not timed")
    _add_json(pipeline)
    return parser


def _add_shapes(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "--sizes", type=read_shapes, default=SHAPES, metavar="XxYxZ,...", help="voxels along x, y and z"
    )


def _add_json(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("--json", type=Path, metavar="FILE", help="write every figure")


def _renderer(options: argparse.Namespace, say: Reporter, save: Save) -> None:
    from benchmarks.renderer import run, table

    if options.device == "gpu" and device.available_gpu() is None:
        raise device.DeviceError("No GPU that Taichi can use was found (CUDA, Metal or Vulkan); leave --device away.")
    results = run.run(options.sizes, options.peers, options.device, say.note, save)
    say.finish(table.text(results), results)


def _velocity(options: argparse.Namespace, say: Reporter, save: Save) -> None:
    from benchmarks.velocity import run, table

    truths = []
    for path in options.truths:
        truth = Truth.load(path)
        if truth.shape not in options.sizes:
            size, sizes = size_text(truth.shape), ",".join(map(size_text, options.sizes))
            raise ValueError(
                f"{path}: has {size} voxels, which are not among --sizes {sizes}; a known scene is not resampled."
            )
        truths.append((path.parent.name if path.name == "truth.npz" else path.stem, truth))
    results = run.run(options.sizes, truths, say.note, save)
    say.finish(table.text(results), results)


def _pipeline(options: argparse.Namespace, say: Reporter, save: Save) -> None:
    from benchmarks.pipeline import run, table

    results = run.run(options.scene, options.sizes, options.methods, options.quality, options.frames, say.note, save)
    say.finish(table.text(results), results)


def _count(text: str) -> int:
    if not text.isdigit() or int(text) == 0:
        raise argparse.ArgumentTypeError(f"{text!r}: expected a number of frames")
    return int(text)


def read_shapes(text: str) -> tuple[tuple[int, ...], ...]:
    """Read sizes of grids from XxYxZ,XxYxZ, the smallest first."""
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
    """Return what reads some of these names, with commas between them."""

    def read(text: str) -> tuple[str, ...]:
        names = tuple(text.split(","))
        for name in names:
            if name not in known:
                raise argparse.ArgumentTypeError(f"{name!r}: expected some of {', '.join(known)}")
        return names

    return read
