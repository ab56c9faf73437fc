"""Options that several commands share, and what they say."""

import argparse
import math
import os
from collections.abc import Callable, Collection
from contextlib import suppress
from dataclasses import replace
from pathlib import Path
from typing import Literal

from smokelift.output.writer import check_directory, written_kinds
from smokelift.scene import SCATTERINGS, ClipSource, Scene
from smokelift.scene.checks import LARGEST, SceneError, file_path
from smokelift.setup.settings import METHODS, QUALITIES, Settings


def named_path(text: str) -> Path:
    """Return the path that a word names; it has to be UTF-8, as the libraries need it."""
    try:
        text.encode("utf-8")
    except UnicodeEncodeError:
        raise argparse.ArgumentTypeError("the path is no text in UTF-8: rename the file or the folder") from None
    if not text:
        raise argparse.ArgumentTypeError("the path is empty: give the name of a file or a folder")
    try:
        return file_path(text, "path")
    except SceneError as error:
        raise argparse.ArgumentTypeError(str(error)) from None


def add_device(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "--device",
        choices=("auto", "cpu", "gpu"),
        default="auto",
        help="device that renders; auto (default): the processor; gpu: one that Taichi can use",
    )


def add_clip_options(parser: argparse.ArgumentParser) -> None:
    """Add the clip or scene file, and what of the clip is used."""
    parser.add_argument("input", type=named_path, help="scene.toml, a video, or pictures as frame_####.png")
    parser.add_argument(
        "--frames", type=frame_range, metavar="A:B", help="frames of the clip, from 0 (default: the scene's, else all)"
    )
    parser.add_argument(
        "--mask",
        type=named_path,
        metavar="PATH",
        help="picture that is white where smoke may be and black where none is, or mask_####.png or a video with one "
        "for each frame (default: the scene's, else none)",
    )


def add_run_options(parser: argparse.ArgumentParser) -> None:
    """Add the clip or scene file, and how it is reconstructed."""
    add_clip_options(parser)
    parser.add_argument(
        "--quality",
        choices=QUALITIES,
        default="balanced",
        help="how much of the clip's detail is kept (final: one voxel per pixel), and how long a run takes "
        "(default: balanced)",
    )
    parser.add_argument(
        "--method",
        choices=METHODS,
        default="default",
        help="paper: the published one (needs the extra [gpu])",
    )
    parser.add_argument(
        "--resolution",
        type=_resolution,
        metavar="X,Y,Z",
        help="voxels; auto: measured (default: the scene's, else auto)",
    )
    parser.add_argument(
        "--scattering",
        choices=("auto", *SCATTERINGS),
        default="auto",
        help="how light is scattered; auto (default): what the scene says, else measured on the clip",
    )
    parser.add_argument(
        "--distance",
        type=float,
        metavar="METERS",
        help="level distance in meters from the camera, straight ahead, to the lower end of the smoke; sets the scale "
        "where no box is given (default: estimated)",
    )
    parser.add_argument(
        "--detail",
        type=float,
        metavar="0..1",
        help="how much fine structure in depth is made up, in the texture of the clip: 0 (none: smooth, best for "
        "measuring) to 1 (default; with --method paper 0)",
    )
    parser.add_argument(
        "--seed",
        type=int,
        default=0,
        metavar="N",
        help="which of the plausible smokes, from 0 (default)",
    )


def add_sequence(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("directory", type=named_path, help="directory of the sequence")


def add_directed_options(parser: argparse.ArgumentParser) -> None:
    """Add a sequence, and the output for a new one."""
    add_sequence(parser)
    parser.add_argument("--out", type=named_path, required=True, help="directory for the new sequence")
    parser.add_argument("--npz", action="store_true", help="write NumPy files as well")
    parser.add_argument("--resume", action="store_true", help="go on after the frames that are finished")


def require_new(options: argparse.Namespace) -> None:
    """Check the output of `add_directed_options` before anything is spent.

    It is a ValueError if it cannot be written, or is the sequence itself.
    """
    if options.out.resolve() == options.directory.resolve():
        raise ValueError(f"{options.out}: is the sequence itself; choose another directory for --out.")
    check_directory(options.out, resume=options.resume)
    written_kinds(options.npz)


def whole_number(least: int, most: int) -> Callable[[str], int]:
    """Return what makes a whole number in a range of a word."""

    def read(text: str) -> int:
        number = int(text) if text.isascii() and text.isdigit() else -1
        if not least <= number <= most:
            raise argparse.ArgumentTypeError(f"{text!r}: expected a whole number from {least} to {most}")
        return number

    return read


def finite_number(text: str) -> float:
    """Return a number from a word."""
    try:
        number = float(text)
    except ValueError:
        number = math.nan
    if not abs(number) <= LARGEST:
        raise argparse.ArgumentTypeError(f"{text}: expected a number from {-LARGEST:g} to {LARGEST:g}")
    return number


def settings_of(options: argparse.Namespace) -> Settings:
    """Return the settings from the options of `add_run_options`."""
    preset = Settings.preset(options.quality, options.method, options.resolution)
    detail = preset.detail if options.detail is None else options.detail
    return replace(preset, scattering=options.scattering, distance=options.distance, detail=detail, seed=options.seed)


def scene_of(options: argparse.Namespace) -> tuple[Scene, ClipSource]:
    """Return the scene from the options of `add_run_options`, and its clip; ValueError if one is missing or wrong."""
    path: Path = options.input
    scene = Scene.load(path) if path.suffix.lower() == ".toml" else Scene(clip=ClipSource(path))
    if options.frames is not None and scene.clip is not None:
        scene = scene.with_frames(*options.frames)
    if options.mask is not None and scene.clip is not None:
        scene = replace(scene, clip=replace(scene.clip, mask=options.mask))
    if scene.clip is None:
        raise ValueError(f"{path}: has no [clip]; give the path of the video there.")
    return scene, scene.clip


def require_file(path: Path | None, kinds: Collection[str] = ()) -> None:
    """Check, before anything is spent, that a file can be written, whose suffix is one of ``kinds`` if there are any.

    It is a ValueError if it cannot be: also if its folder is missing or read-only, or the path is a folder itself.
    """
    if path is None:
        return
    if kinds and path.suffix.lower() not in kinds:
        raise ValueError(f"{path}: is written as {' or '.join(kinds)}; give a name that ends with it.")
    if not path.absolute().parent.is_dir():
        raise ValueError(f"{path}: the folder {path.parent} does not exist.")
    if path.is_dir():
        raise ValueError(f"{path}: is a folder; give the name of a file.")
    if not os.access(path.absolute().parent, os.W_OK | os.X_OK):
        raise ValueError(f"{path}: the folder {path.parent} cannot be written to.")


def _resolution(text: str) -> tuple[int, int, int] | Literal["auto"]:
    if text == "auto":
        return "auto"
    x, y, z = _whole_numbers(text, ",", 3, "three whole numbers X,Y,Z, or auto")
    return x, y, z


def frame_range(text: str) -> tuple[int, int]:
    """Return the first and the last frame from a word A:B."""
    first, last = _whole_numbers(text, ":", 2, "the first and last frame A:B")
    return first, last


def _whole_numbers(text: str, between: str, count: int, expected: str) -> list[int]:
    with suppress(ValueError):
        numbers = [int(part) for part in text.split(between)]
        if len(numbers) == count:
            return numbers
    raise argparse.ArgumentTypeError(f"{text!r}: expected {expected}")
