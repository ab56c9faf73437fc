"""The commands that read a sequence: ``check``, ``preview``, ``render``, ``proxy``, ``export`` and ``evaluate``."""

import argparse
import json
import math
import time
from dataclasses import replace
from typing import get_args

from smokelift.app.options import add_sequence, named_path, require_file
from smokelift.app.progress import Reporter, say_frames
from smokelift.checks import Finding, counted
from smokelift.checks.whole_files import write_text
from smokelift.evaluation.evaluate import evaluate
from smokelift.footage.clip import Clip
from smokelift.output.export import (
    ExportSettings,
    Precision,
    export_sequence,
    export_size,
    require_export,
    require_space,
    write_proxies,
)
from smokelift.output.images import VIDEO_KINDS, write_image, write_video
from smokelift.output.index import PICTURES
from smokelift.output.preview import write_previews
from smokelift.output.sequence import Sequence, Viewer
from smokelift.output.vdb import HostName
from smokelift.render import device
from smokelift.report.facts import count_empty, shortcomings
from smokelift.scene import Camera, CompleteScene, Scene, orbit


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
    figures = evaluate(sequence, options.truth, options.view, options.picture)
    text = json.dumps(figures, indent=1, allow_nan=False)
    if options.json is not None:
        write_text(options.json, text + "\n")
        text = f"{options.json} written."
    say.finish(text, figures)


def add_render_options(parser: argparse.ArgumentParser) -> None:
    add_sequence(parser)
    parser.add_argument(
        "--frame", type=int, metavar="N", help="the only frame (default: the first for an image, all for a video)"
    )
    parser.add_argument(
        "--camera",
        default="front",
        help="view: front (default), side, YAW,PITCH in degrees to the right of the front and upwards, or camera.toml",
    )
    parser.add_argument(
        "--out", type=named_path, required=True, help="file to write: image.exr, image.png or video.mp4"
    )


def render(options: argparse.Namespace, say: Reporter) -> None:
    """Render one frame, or all into a video."""
    sequence = Sequence.open(options.directory)
    scene = sequence.scene
    camera = _camera(options.camera, scene)
    require_file(options.out, (".exr", ".png", *VIDEO_KINDS))
    if not sequence.frames:
        raise ValueError(f"{options.directory}: there are no finished frames to render yet.")
    device.start(options.device)
    is_video = options.out.suffix.lower() in VIDEO_KINDS
    numbers = (sequence.frames if is_video else sequence.frames[:1]) if options.frame is None else (options.frame,)
    viewer = Viewer(scene, camera)
    pictures = (viewer.image(number, sequence.density(number), sequence.flame(number)) for number in numbers)
    if is_video:
        write_video(options.out, pictures, sequence.fps)
    else:
        write_image(options.out, next(pictures))
    say.finish(f"{options.out} written.", {"file": str(options.out)})


def _camera(name: str, scene: CompleteScene) -> Camera:
    """The camera that a word, two angles or a file says; ValueError if it is none of them."""
    if name == "front":
        return scene.camera
    if name == "side":
        return orbit(scene.camera, scene.domain, 90.0)
    if name.endswith(".toml"):
        camera = Scene.load(name).camera
        if camera is None:
            raise ValueError(f"{name}: has no [camera].")
        return camera
    try:
        yaw, pitch = (float(part) for part in name.split(","))
        if not (math.isfinite(yaw) and math.isfinite(pitch)):
            raise ValueError
    except ValueError:
        raise ValueError(
            f"--camera {name}: expected front, side, two angles YAW,PITCH in degrees, or a camera.toml."
        ) from None
    return orbit(scene.camera, scene.domain, yaw, pitch)


def add_export_options(parser: argparse.ArgumentParser) -> None:
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


def export(options: argparse.Namespace, say: Reporter) -> None:
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
