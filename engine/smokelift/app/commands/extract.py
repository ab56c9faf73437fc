"""``smokelift extract``: the smoke of a clip as an element, with alpha, for a compositor."""

import argparse
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from smokelift.app.options import add_clip_options, named_path, require_file, scene_of
from smokelift.app.progress import Reporter, say_frames
from smokelift.checks import counted
from smokelift.footage.clip import Clip
from smokelift.footage.images import Picture
from smokelift.output.images import VIDEO_KINDS, write_image, write_video
from smokelift.pipeline.extraction import ELEMENT_KINDS, Extraction, extract

SQUARES = 24
"""Squares of the checker along the longer side of a preview."""

CHECKER = (0.05, 0.25)
"""Linear radiance of its squares: both darker than most smoke, so that thin smoke shows, and unlike each other."""


def add_options(parser: argparse.ArgumentParser) -> None:
    """Add the options of the command."""
    add_clip_options(parser)
    parser.add_argument(
        "--out",
        type=named_path,
        required=True,
        metavar="element_####.exr",
        help="pictures to write, numbered as the frames of the clip's file: .exr is premultiplied and linear, .png "
        "straight and sRGB; or a directory",
    )
    parser.add_argument("--plate", type=named_path, metavar="FILE.exr", help="write the clean plate, .exr or .png")
    parser.add_argument(
        "--preview",
        type=named_path,
        metavar="FILE",
        help="write the clip beside its element over a checker: a video (.mp4), or the middle frame (.png)",
    )


def run(options: argparse.Namespace, say: Reporter) -> None:
    """Write the elements; then, if they are asked for, the plate and the preview."""
    _check_outputs(options)
    scene, source = scene_of(options)
    with Clip.open(source) as clip:
        extraction = extract(clip, scene)
        for finding in clip.findings():
            say.note(finding)
        elements = enumerate(extraction.write(options.out), 1)
        files = list(map(str, say_frames(say, elements, len(extraction), "extracted")))
        if options.plate is not None:
            write_image(options.plate, extraction.plate)
        if options.preview is not None:
            _write_preview(options.preview, extraction)
    further = [str(path) for path in (options.plate, options.preview) if path is not None]
    what = counted(len(files), "element")
    words = f"{what} written, {files[0]} to {files[-1]}." if len(files) > 1 else f"{files[0]} written."
    say.finish(words, {"frames": len(files), "files": files + further})


def _check_outputs(options: argparse.Namespace) -> None:
    require_file(options.plate, ELEMENT_KINDS)
    require_file(options.preview, (".png", *VIDEO_KINDS))
    existing = options.out if options.out.is_dir() else options.out.absolute().parent
    if options.out.exists() and not options.out.is_dir():
        raise ValueError(f"{options.out}: is a file; give a pattern such as element_####.exr, or a directory.")
    if existing.exists() and not existing.is_dir():
        raise ValueError(f"{existing}: is a file; give a pattern in a directory.")


def _write_preview(path: Path, extraction: Extraction) -> None:
    """Write the clip beside its element over a checker."""
    width, height = extraction.clip.size
    side = max(1, -(-max(width, height) // SQUARES))
    rows, columns = np.mgrid[:height, :width] // side
    checker = np.where((rows + columns) % 2, *CHECKER).astype(np.float32)[..., None]

    def pairs(frames: range) -> Iterator[Picture]:
        for frame in frames:
            yield np.hstack([extraction.clip.frame(frame), extraction.element(frame).over(checker)])

    if path.suffix.lower() == ".png":
        middle = len(extraction) // 2
        write_image(path, next(pairs(range(middle, middle + 1))))
    else:
        write_video(path, pairs(range(len(extraction))), extraction.clip.fps)
