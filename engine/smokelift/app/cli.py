"""The command line: ``smokelift reconstruct | inspect | render | preview | evaluate | chart | doctor | bench``.

Exit status: 0 done, 2 bad input, 3 device or memory, 130 cancelled (and resumable).
"""

from __future__ import annotations

import argparse
import itertools
import json
import math
import signal
import sys
import time
from collections.abc import Sequence as Many
from dataclasses import asdict, replace
from pathlib import Path
from types import FrameType
from typing import Literal

import numpy as np
from PIL import Image as Pillow

from smokelift.app.doctor import report
from smokelift.app.forecast import forecast
from smokelift.app.memory import require_memory
from smokelift.app.progress import Reporter, reporter
from smokelift.evaluation.evaluate import evaluate
from smokelift.evaluation.speed_accuracy_chart import draw, read_runs
from smokelift.footage.clip import Clip
from smokelift.output.atomic import atomic_path
from smokelift.output.images import eight_bit, write_image
from smokelift.output.layout import CONTACT_SHEET, PREVIEW
from smokelift.output.preview import write_contact_sheet, write_preview
from smokelift.output.sequence import Sequence
from smokelift.output.vdb import VdbUnavailable
from smokelift.output.video import VIDEO_KINDS, write_video
from smokelift.output.viewer import Viewer
from smokelift.pipeline import Frame, reconstruct
from smokelift.render import DeviceError, device, scene_renderer
from smokelift.scene import Camera, ClipSource, CompleteScene, Scene, completed, orbit, scene_to_dict
from smokelift.setup.settings import METHODS, QUALITIES, Settings
from smokelift.setup.shot import Shot, boundaries, prepare_shot

DONE, BAD_INPUT, NO_DEVICE, CANCELLED = 0, 2, 3, 130

SIDE_YAW = 90.0


def main(arguments: Many[str] | None = None) -> int:
    """Run a command and return the exit status."""
    options = _parser().parse_args(arguments)
    say = reporter(getattr(options, "progress", "text"))
    ended: list[int] = []

    def end(number: int, _frame: FrameType | None) -> None:
        ended.append(number)
        raise KeyboardInterrupt

    # a terminal's Ctrl-C and a parent's polite end are the same wish
    signal.signal(signal.SIGTERM, end)
    try:
        try:
            with say:
                _COMMANDS[options.command](options, say)
        except Exception as error:
            if ended:  # a library made an error of its own of the interruption
                raise KeyboardInterrupt from error
            raise
    except KeyboardInterrupt:
        hint = "; finished frames stay, --resume goes on from them" if options.command == "reconstruct" else ""
        say.fail(f"Cancelled{hint}.", CANCELLED)
        return CANCELLED
    except (DeviceError, MemoryError) as error:
        say.fail(str(error) or "Out of memory; choose a lower --resolution.", NO_DEVICE)
        return NO_DEVICE
    except (ValueError, VdbUnavailable, OSError) as error:
        say.fail(str(error), BAD_INPUT)
        return BAD_INPUT
    return DONE


def _reconstruct(options: argparse.Namespace, say: Reporter) -> None:
    began = time.monotonic()
    settings = _settings(options)
    scene = _scene(options.input, options.frames)
    assert scene.clip is not None
    device.start(options.device)
    with Clip.open(scene.clip) as clip:
        shot = prepare_shot(clip, scene, settings)
        assert shot.scene.domain is not None
        require_memory(shot.scene.domain)
        for note in (*shot.notes, *(choice.reason for choice in shot.choices)):
            say.note(note)
        frames = reconstruct(clip, scene, settings, options.out, npz=options.npz, resume=options.resume, shot=shot)
        for first in frames:
            say.start(len(clip), first.number - 1)
            for frame in itertools.chain([first], frames):
                if options.thumbnail:
                    _write_thumbnail(options.thumbnail, clip, shot, frame)
                say.frame(frame.number, frame.figures)
    sequence = Sequence.open(options.out)
    if not any((sequence.figures(number).get("hull_share") or 0) > 0 for number in sequence.frames):
        say.note(
            "No smoke found: in no frame does a patch differ from the background by six times the clip's noise. "
            "Check the clean plate, or give one with [background] in a scene file."
        )
    seconds = time.monotonic() - began
    say.finish(
        f"{len(sequence.frames)} frames in {options.out} ({seconds:.0f} s).",
        {"directory": str(options.out), "frames": len(sequence.frames), "seconds": round(seconds, 1)},
    )


def _write_thumbnail(path: Path, clip: Clip, shot: Shot, frame: Frame) -> None:
    """Write the part of a frame that the grid is fitted to, beside its reconstruction (or above, if wide), as a PNG."""
    now = shot.at(frame.number - 1)
    if now is None:  # nothing of the domain is in this frame's picture: the picture of the last one stays
        return
    seen = now.working.cut(clip.frame(frame.number - 1))
    scene = completed(replace(now.small_scene, scattering=now.scattering))
    found = scene_renderer(scene, background=now.plate.image).image(frame.density)
    both = np.concatenate([seen, found], 0 if seen.shape[1] > seen.shape[0] else 1)
    with atomic_path(path) as aside:
        Pillow.fromarray(eight_bit(both)).save(aside, format="PNG")


def _inspect(options: argparse.Namespace, say: Reporter) -> None:
    settings = _settings(options)
    scene = _scene(options.input, options.frames)
    assert scene.clip is not None
    with Clip.open(scene.clip) as clip:
        shot = prepare_shot(clip, scene, settings)
        frames = len(clip)
    domain = shot.scene.domain
    assert domain is not None
    for note in (*shot.notes, *boundaries(shot.scene, settings), *(choice.reason for choice in shot.choices)):
        say.note(note)
    cost = forecast(domain, frames, settings.quality, len(shot.views))
    voxels = " x ".join(map(str, domain.resolution))
    say.finish(
        f"{frames} frames of {voxels} voxels: about {cost.seconds:.0f} s, {cost.memory / 2**30:.1f} GiB of memory "
        f"({cost.memory_free / 2**30:.1f} are free), up to {cost.disk / 1e6:.0f} MB on disk.",
        {
            "frames": frames,
            "scene": scene_to_dict(shot.scene),
            "choices": [choice.as_dict() for choice in shot.choices],
            **asdict(cost),
        },
    )


def _render(options: argparse.Namespace, say: Reporter) -> None:
    sequence = Sequence.open(options.directory)
    viewer = Viewer(sequence.scene, _camera(options.camera, sequence.scene))
    suffix = options.out.suffix.lower()
    if suffix not in (".exr", ".png", *VIDEO_KINDS):
        raise ValueError(f"{options.out}: write an image (.exr, .png) or a video ({', '.join(VIDEO_KINDS)}).")
    if not sequence.frames:
        raise ValueError(f"{options.directory}: there are no finished frames to render yet.")
    _require_folder(options.out)
    device.start(options.device)
    if suffix in VIDEO_KINDS:
        numbers = sequence.frames if options.frame is None else (options.frame,)
        fps = sequence.scene.clip.fps if sequence.scene.clip and sequence.scene.clip.fps else 24.0
        write_video(options.out, (viewer.image(n, sequence.density(n)) for n in numbers), fps)
    else:
        number = sequence.frames[0] if options.frame is None else options.frame
        write_image(options.out, viewer.image(number, sequence.density(number)))
    say.finish(f"{options.out} written.", {"file": str(options.out)})


def _preview(options: argparse.Namespace, say: Reporter) -> None:
    sequence = Sequence.open(options.directory)
    if sequence.scene.clip is None or not sequence.frames:
        raise ValueError(f"{options.directory}: there are no finished frames of a clip to show yet.")
    device.start(options.device)
    out = options.out or sequence.directory
    out.mkdir(parents=True, exist_ok=True)
    sheet, video = out / CONTACT_SHEET, out / PREVIEW
    with Clip.open(sequence.scene.clip) as clip:
        write_contact_sheet(sheet, sequence, clip)
        write_preview(video, sequence, clip)
    say.finish(f"{sheet} and {video} written.", {"files": [str(sheet), str(video)]})


def _evaluate(options: argparse.Namespace, say: Reporter) -> None:
    if options.truth is None and not options.view:
        raise ValueError("Say what to compare with: --truth truth.npz, or --view camera.toml clip.mp4.")
    for path in (options.json, options.picture):
        _require_folder(path)
    if options.picture is not None and options.picture.suffix.lower() != ".png":
        raise ValueError(f"{options.picture}: the picture is written as .png.")
    sequence = Sequence.open(options.directory)
    device.start(options.device)
    found = evaluate(sequence, options.truth, tuple((camera, clip) for camera, clip in options.view))
    text = json.dumps(found.figures, indent=1, allow_nan=False)
    if options.picture is not None:
        found.write_picture(options.picture)
    if options.json is not None:
        with atomic_path(options.json) as aside:
            aside.write_text(text + "\n", encoding="utf-8")
        text = f"{options.json} written."
    say.finish(text, found.figures)


def _chart(options: argparse.Namespace, say: Reporter) -> None:
    _require_folder(options.out)
    draw(read_runs(options.csv), options.out)
    say.finish(f"{options.out} written.", {"file": str(options.out)})


def _bench(options: argparse.Namespace, say: Reporter) -> None:
    sys.path.append("")  # a console script does not look into the current folder, as `python -m` does
    try:
        from benchmarks import command
    except ModuleNotFoundError as missing:
        if missing.name is None or not missing.name.startswith("benchmarks"):
            raise
        raise ValueError(
            "The benchmarks come with Smokelift's source, not with its wheel: "
            "run smokelift bench, or python -m benchmarks, in the folder of the source, which has them in benchmarks/."
        ) from None
    command.run(options.arguments, say)


def _require_folder(path: Path | None) -> None:
    if path is not None and not path.absolute().parent.is_dir():
        raise ValueError(f"{path}: the folder {path.parent} does not exist.")


def _doctor(options: argparse.Namespace, say: Reporter) -> None:
    for line in report():
        say.note(line)


_COMMANDS = {
    "reconstruct": _reconstruct,
    "inspect": _inspect,
    "render": _render,
    "preview": _preview,
    "evaluate": _evaluate,
    "chart": _chart,
    "doctor": _doctor,
    "bench": _bench,
}


def _settings(options: argparse.Namespace) -> Settings:
    preset = Settings.preset(options.quality, options.method, options.resolution)
    density = replace(preset.density, scattering=options.scattering)
    return replace(preset, density=density, axis_depth=options.axis_depth)


def _scene(path: Path, frames: tuple[int, int] | None) -> Scene:
    if path.suffix.lower() == ".toml":
        scene = Scene.load(path)
        if scene.clip is None:
            raise ValueError(f"{path}: has no [clip]; give the path of the video there.")
    else:
        scene = Scene(clip=ClipSource(path))
    assert scene.clip is not None
    return scene if frames is None else scene.with_frames(*frames)


def _camera(name: str, scene: CompleteScene) -> Camera:
    """The camera that a word, two angles or a camera file say."""
    if name == "front":
        return scene.camera
    if name == "side":
        return orbit(scene.camera, scene.domain, SIDE_YAW)
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


def _resolution(text: str) -> tuple[int, int, int] | Literal["auto"]:
    if text == "auto":
        return "auto"
    try:
        x, y, z = (int(part) for part in text.split(","))
    except ValueError:
        raise argparse.ArgumentTypeError(f"{text!r}: expected three whole numbers X,Y,Z, or auto") from None
    return x, y, z


def _frame_range(text: str) -> tuple[int, int]:
    try:
        first, last = (int(part) for part in text.split(":"))
    except ValueError:
        raise argparse.ArgumentTypeError(f"{text!r}: expected the first and last frame A:B, from 0") from None
    return first, last


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog="smokelift", description="Turn a video of smoke into an OpenVDB sequence of density and velocity."
    )
    commands = parser.add_subparsers(dest="command", required=True)
    common = argparse.ArgumentParser(add_help=False)
    common.add_argument("--device", choices=("auto", "cpu", "gpu"), default="auto", help="where to render")
    common.add_argument("--progress", choices=("text", "json"), default="text", help="a bar, or one JSON object a line")

    what = argparse.ArgumentParser(add_help=False)
    what.add_argument("input", type=Path, help="scene.toml, or a video, or frame_####.png")
    what.add_argument("--quality", choices=QUALITIES, default="balanced")
    what.add_argument("--method", choices=METHODS, default="default", help="paper: the published loop, for comparison")
    what.add_argument(
        "--resolution", type=_resolution, metavar="X,Y,Z", help="voxels, if not the scene's; auto measures how many"
    )
    what.add_argument(
        "--scattering",
        choices=("auto", "absorption", "unshadowed", "single"),
        default="auto",
        help="how light is scattered; auto measures which is needed",
    )
    what.add_argument("--frames", type=_frame_range, metavar="A:B", help="first and last frame, from 0")
    what.add_argument(
        "--axis-depth",
        type=float,
        metavar="METRES",
        help="how far behind the middle of the box the smoke stands (before it: less than 0), if you know",
    )

    job = commands.add_parser("reconstruct", parents=[common, what], help="a clip or scene file to a VDB sequence")
    job.add_argument("--out", type=Path, required=True, help="directory for the sequence")
    job.add_argument("--npz", action="store_true", help="write NumPy twins as well")
    job.add_argument("--thumbnail", type=Path, metavar="FILE.png", help="keep a small picture of the last frame there")
    job.add_argument("--resume", action="store_true", help="go on from the frames that are there")

    commands.add_parser(
        "inspect", parents=[common, what], help="what would be assumed, chosen and spent, before it is spent"
    )

    picture = commands.add_parser("render", parents=[common], help="an image or video of a sequence")
    picture.add_argument("directory", type=Path)
    picture.add_argument("--frame", type=int, help="one frame; the first for an image, all for a video by default")
    picture.add_argument("--camera", default="front", help="front, side, YAW,PITCH in degrees, or camera.toml")
    picture.add_argument("--out", type=Path, required=True, help="image.exr, image.png or video.mp4")

    look = commands.add_parser("preview", parents=[common], help="a contact sheet and a preview video")
    look.add_argument("directory", type=Path)
    look.add_argument("--out", type=Path, help="directory for them; by default the sequence's own")

    judge = commands.add_parser("evaluate", parents=[common], help="a sequence beside the truth, or beside other views")
    judge.add_argument("directory", type=Path)
    judge.add_argument("--truth", type=Path, metavar="truth.npz", help="known densities and velocities")
    judge.add_argument(
        "--view",
        type=Path,
        nargs=2,
        action="append",
        default=[],
        metavar=("camera.toml", "clip.mp4"),
        help="what another camera saw; may be repeated",
    )
    judge.add_argument("--json", type=Path, metavar="FILE", help="write the figures there, not on standard output")
    judge.add_argument("--picture", type=Path, metavar="FILE.png", help="truth and sequence side by side")

    drawing = commands.add_parser("chart", parents=[common], help="speed against accuracy, from measured runs")
    drawing.add_argument("csv", type=Path, help="written by python -m benchmarks.accuracy")
    drawing.add_argument("--out", type=Path, required=True, metavar="chart.png")

    commands.add_parser("doctor", parents=[common], help="versions, devices and what is missing")
    # every word, options too, goes to the benchmarks' own parser
    bench = commands.add_parser(
        "bench", help="speed and error beside others on the same machine", prefix_chars="+", add_help=False
    )
    bench.add_argument("arguments", nargs="*")
    return parser


if __name__ == "__main__":
    sys.exit(main())
