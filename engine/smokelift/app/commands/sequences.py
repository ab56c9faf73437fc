"""``smokelift check``, ``preview`` and ``proxy``: is a sequence whole, what does it look like, and coarse copies."""

import argparse
from dataclasses import replace

from smokelift.app.options import Command, named_path
from smokelift.app.progress import Reporter, say_frames
from smokelift.checks import Finding, counted
from smokelift.footage.clip import Clip
from smokelift.output.export import write_proxies
from smokelift.output.files import PICTURES
from smokelift.output.preview import write_previews
from smokelift.output.sequence import Sequence
from smokelift.output.vdb import PROXY_TIMES
from smokelift.render import device
from smokelift.report.result import count_empty, shortcomings


def add_sequence(parser: argparse.ArgumentParser) -> None:
    """Add the sequence."""
    parser.add_argument("directory", type=named_path, help="directory of the sequence")


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


COMMANDS = {
    "check": Command("check that a sequence is complete and undamaged", add_sequence, check),
    "preview": Command("make pictures and a video that show the smoke from all sides", add_preview_options, preview),
    "proxy": Command(f"write copies for viewports, with voxels {PROXY_TIMES} times as large", add_sequence, proxy),
}
