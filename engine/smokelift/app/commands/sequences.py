"""``smokelift check``, ``preview``, ``proxy`` and ``evaluate``: is a sequence whole, what does it look like, coarse
copies, and how good it is.
"""

import argparse
import json
from dataclasses import replace

from smokelift.app.options import add_sequence, named_path, require_file
from smokelift.app.progress import Reporter, say_frames
from smokelift.checks import Finding, counted
from smokelift.checks.whole_files import write_text
from smokelift.evaluation.evaluate import evaluate
from smokelift.footage.clip import Clip
from smokelift.output.export import write_proxies
from smokelift.output.index import PICTURES
from smokelift.output.preview import write_previews
from smokelift.output.sequence import Sequence
from smokelift.render import device
from smokelift.report.facts import count_empty, shortcomings


def check(options: argparse.Namespace, say: Reporter) -> None:
    """Check every file; ValueError if frames are missing or damaged, or none shows smoke."""
    sequence = Sequence.open(options.directory)
    if not sequence.complete:
        there = counted(len(sequence.frames), "finished frame")
        raise ValueError(f"{options.directory}: has only {there} and is not a complete run; resume it.")
    for number in sequence.frames:
        if not sequence.files(number):
            raise ValueError(
                f"{options.directory}: the file of frame {number} is missing. Copy or make the sequence again."
            )
    figures = [sequence.figures(number) for number in sequence.frames]
    empty = count_empty(figures)
    if empty == len(figures):
        raise ValueError(f"{options.directory}: no frame shows smoke. Make it again with another background.")
    for note in shortcomings(figures):
        say.note(note)
    count = len(sequence.frames)
    text = f"All of {options.directory} is as it was written: {counted(count, 'frame')}."
    say.finish(text, {"frames": count, "empty": empty})


def add_preview_options(parser: argparse.ArgumentParser) -> None:
    """Add the options of ``preview``."""
    add_sequence(parser)
    parser.add_argument("--out", type=named_path, help="directory for these files (default: the sequence's own)")


def preview(options: argparse.Namespace, say: Reporter) -> None:
    """Write three pictures and a video."""
    sequence = Sequence.open(options.directory)
    if sequence.scene.clip is None or not sequence.frames:
        raise ValueError(f"{options.directory}: there are no finished frames of a clip to show yet.")
    device.start(options.device)
    out = options.out or sequence.directory
    out.mkdir(parents=True, exist_ok=True)
    with Clip.open(replace(sequence.scene.clip, mask=None)) as clip:  # as it was filmed
        write_previews(out, sequence, clip)
    files = [str(out / name) for name in PICTURES]
    say.finish(f"{', '.join(files[:-1])} and {files[-1]} written.", {"files": files})


def proxy(options: argparse.Namespace, say: Reporter) -> None:
    """Write a coarse copy of every frame."""
    sequence = Sequence.open(options.directory)
    frames = len(sequence.frames)
    say_frames(say, ((number, number) for number in write_proxies(sequence)), frames, "made coarser")
    say.finish(Finding("proxy", {"frames": frames, "directory": str(sequence.directory)}), {"frames": frames})


def add_evaluate_options(parser: argparse.ArgumentParser) -> None:
    """Add the options of ``evaluate``."""
    add_sequence(parser)
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


def compare(options: argparse.Namespace, say: Reporter) -> None:
    """Compare a sequence with its front and with what is known, and write the figures and a picture."""
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
