"""``smokelift preview``: a contact sheet, an orbit, a strip and a video of a sequence."""

from __future__ import annotations

import argparse
from dataclasses import replace

from smokelift.app.options import named_path
from smokelift.app.progress import Reporter
from smokelift.footage.clip import Clip
from smokelift.output.files import PICTURES
from smokelift.output.preview import write_previews
from smokelift.output.sequence import Sequence
from smokelift.render import device

HELP = "make three pictures and a video that show the smoke from all sides"


def add_options(parser: argparse.ArgumentParser) -> None:
    """Add the options of the command."""
    parser.add_argument("directory", type=named_path, help="directory of the sequence")
    parser.add_argument("--out", type=named_path, help="directory for these files (default: the sequence's own)")


def run(options: argparse.Namespace, say: Reporter) -> None:
    """Write all four files."""
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
