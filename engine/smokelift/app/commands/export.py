"""``smokelift export``: small OpenVDB files, a proxy and a USD file of a sequence, for other programs."""

import argparse
import time
from typing import get_args

from smokelift.app.options import add_sequence, named_path
from smokelift.app.progress import Reporter, say_frames
from smokelift.checks import counted
from smokelift.output.export import (
    ExportSettings,
    Precision,
    export_sequence,
    export_size,
    require_export,
    require_space,
)
from smokelift.output.sequence import Sequence
from smokelift.output.vdb import HostName


def add_options(parser: argparse.ArgumentParser) -> None:
    """Add the options of the command."""
    add_sequence(parser)
    parser.add_argument("--out", type=named_path, required=True, help="folder for the export")
    parser.add_argument(
        "--precision",
        choices=get_args(Precision),
        default="half",
        help="half (default): floats of 16 bits; quantized: as few bits as a picture of 8 bits needs",
    )
    parser.add_argument("--no-velocity", action="store_true", help="leave out the velocity, which motion blur needs")
    parser.add_argument(
        "--proxy",
        type=int,
        default=1,
        metavar="N",
        help="write a second sequence for viewports, with voxels N times as large (default 1: none)",
    )
    parser.add_argument(
        "--host",
        choices=get_args(HostName),
        default="blender",
        help="the program that reads the files: blender (default), with Z up; houdini, with Y up and the velocity as "
        "vel; unreal, with densities from 0 to 1 and the box's corners in every frame",
    )
    parser.add_argument("--size", action="store_true", help="say the size, and write nothing")


def run(options: argparse.Namespace, say: Reporter) -> None:
    """Say the size, and export unless only that was asked for."""
    began = time.monotonic()
    settings = ExportSettings(options.precision, not options.no_velocity, options.proxy, options.host)
    sequence = Sequence.open(options.directory)
    require_export(sequence, options.out)
    size = export_size(sequence, settings)
    frames = counted(len(sequence.frames), "frame")
    text = f"The export of {frames} takes about {size / 1e6:.1f} MB"
    if options.size:
        say.finish(f"{text}.", {"size": size, "frames": len(sequence.frames)})
        return
    say.note(f"{text}.")
    require_space(options.out, size)
    exported = export_sequence(sequence, options.out, settings)
    written = sum(say_frames(say, exported, len(sequence.frames), "exported"))
    say.finish(
        f"{frames} in {options.out}, {written / 1e6:.1f} MB.",
        {
            "directory": str(options.out),
            "frames": len(sequence.frames),
            "size": written,
            "seconds": round(time.monotonic() - began, 1),
        },
    )
