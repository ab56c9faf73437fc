"""``smokelift preview``: a contact sheet, an orbit, a strip and a video of a sequence."""

from __future__ import annotations

import argparse
from dataclasses import replace

from smokelift.app.options import named_path
from smokelift.app.progress import Reporter
from smokelift.footage.clip import Clip
from smokelift.output.files import CONTACT_SHEET, ORBIT, PICTURES, PREVIEW, STRIP
from smokelift.output.framing import frame_smoke
from smokelift.output.preview import write_contact_sheet, write_orbit, write_preview, write_strip
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
    framing = frame_smoke(sequence)
    with Clip.open(replace(sequence.scene.clip, mask=None)) as clip:  # as it was filmed
        write_contact_sheet(out / CONTACT_SHEET, sequence, clip, framing)
        write_orbit(out / ORBIT, sequence, clip, framing)
        write_strip(out / STRIP, sequence, clip, framing)
        write_preview(out / PREVIEW, sequence, clip, framing)
    files = [str(out / name) for name in PICTURES]
    say.finish(f"{', '.join(files[:-1])} and {files[-1]} written.", {"files": files})
