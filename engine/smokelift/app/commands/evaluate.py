"""``smokelift evaluate``: whether a sequence looks like smoke from all around, and how near it is to what is known."""

import argparse
import json

from smokelift.app.options import Command, named_path, require_file
from smokelift.app.progress import Reporter
from smokelift.checks.whole_files import write_text
from smokelift.evaluation.evaluate import evaluate
from smokelift.output.sequence import Sequence
from smokelift.render import device


def add_options(parser: argparse.ArgumentParser) -> None:
    """Add the options of the command."""
    parser.add_argument("directory", type=named_path, help="directory of the sequence")
    parser.add_argument("--truth", type=named_path, metavar="truth.npz", help="known densities and velocities")
    parser.add_argument(
        "--view",
        type=named_path,
        nargs=2,
        action="append",
        default=[],
        metavar=("camera.toml", "clip.mp4"),
        help="another camera and its clip; may be given again",
    )
    parser.add_argument(
        "--json", type=named_path, metavar="FILE", help="write the figures into this file, not on standard output"
    )
    parser.add_argument(
        "--picture", type=named_path, metavar="FILE.png", help="draw the smoke from all around; below --truth if given"
    )


def run(options: argparse.Namespace, say: Reporter) -> None:
    """Compare, and write the figures and a picture."""
    require_file(options.json)
    require_file(options.picture, (".png",))
    if options.truth is not None and options.truth.suffix.lower() != ".npz":
        raise ValueError(
            f"{options.truth}: --truth takes known volumes (truth.npz); the clip of another camera goes with --view."
        )
    sequence = Sequence.open(options.directory)
    device.start(options.device)
    found = evaluate(sequence, options.truth, tuple((camera, clip) for camera, clip in options.view))
    text = json.dumps(found.figures, indent=1, allow_nan=False)
    if options.picture is not None:
        found.write_picture(options.picture)
    if options.json is not None:
        write_text(options.json, text + "\n")
        text = f"{options.json} written."
    say.finish(text, found.figures)


COMMANDS = {"evaluate": Command("compare the smoke with its front, known volumes and other cameras", add_options, run)}
