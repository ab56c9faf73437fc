"""The command line: the same run without a window.

    blender -b shot.blend --command smokelift reconstruct [options]     where the extension is enabled
    blender -b shot.blend -P addon/batch.py -- [options]                anywhere

Settings come from the .blend; options override them. Exit status: 0 done, 2 bad input, 3 device or memory, 130
cancelled (and resumable).
"""

import argparse
import math
import signal
import sys
import time
from collections.abc import Callable, Sequence
from pathlib import Path

import bpy

from ..core import ShotError
from ..core.contract import BAD_INPUT, CANCELLED, DONE
from ..core.job import Job
from ..scene import volume
from ..scene.clip import number_in_file, unseen_pictures, use_frames
from ..scene.shot_setup import has_denoiser
from ..scene.smoke import activate, active_smoke, new_smoke, smokes
from . import smoke_takes

POLL_SECONDS = 0.05  # seconds between two checks of a run


def main(words: Sequence[str]) -> int:
    """Make a smoke of the scene; returns the exit status."""
    try:
        choices = _parser().parse_args(list(words))
    except SystemExit as leaving:
        return int(leaving.code or 0)
    try:
        if choices.save and not bpy.data.filepath:
            raise ShotError("The file was never saved, so --save has nowhere to write: give blender a .blend to open.")
        scene = bpy.context.scene
        denoises = scene.cycles.use_denoising and scene.render.engine == "CYCLES"
        if choices.render and denoises and not (choices.set_up or has_denoiser()):  # or it would fail after the run
            raise ShotError(
                "This Blender has no denoiser, and --render needs one: switch Denoise off in the render properties."
            )
        smoke = _smoke(choices)
        take = smoke_takes.unfinished(smoke) if choices.resume else None
        if take is not None:
            smoke_takes.update_moved_files(smoke, take)
        take = take or smoke_takes.write_take(smoke)
        job = smoke_takes.engine_job(smoke, take)
    except ShotError as error:
        print(f"smokelift: {error}", file=sys.stderr, flush=True)
        return BAD_INPUT
    _wait(job)
    if job.outcome != "done":
        print(f"smokelift: {job.sentence}", file=sys.stderr, flush=True)
        return CANCELLED if job.outcome == "cancelled" else (job.status or 1)
    is_first = volume.shown_take(smoke) is None
    smoke_takes.present(smoke, take)
    if is_first:
        volume.go_to_smoke(smoke)
    print(job.sentence, flush=True)
    if choices.set_up:
        bpy.ops.smokelift.set_up()
    if choices.save:
        bpy.ops.wm.save_mainfile()
    if choices.render:
        _render(smoke, choices.render)
    return DONE


def _wait(job: Job) -> None:
    """Run a job to its end and print its messages; SIGTERM and Ctrl-C cancel it."""
    printed, done = 0, job.done
    job.start()
    # Not by KeyboardInterrupt, which could end a poll between taking a message and reading it.
    before = {number: signal.signal(number, lambda *_: job.cancel()) for number in (signal.SIGINT, signal.SIGTERM)}
    try:
        while not job.ended:
            time.sleep(POLL_SECONDS)
            if job.poll():
                for note in job.notes[printed:]:
                    print(note, flush=True)
                printed = len(job.notes)
                if job.done > done:
                    done = job.done
                    print(f"frame {done} of {job.total}", flush=True)
    finally:
        job.kill()
        for number, handler in before.items():
            signal.signal(number, handler or signal.SIG_DFL)  # None: it was not Python's


def _smoke(choices: argparse.Namespace) -> bpy.types.Object:
    """The smoke, with its settings overridden by the options; it is active then."""
    scene = bpy.context.scene
    smoke, known = active_smoke(scene), {obj.name: obj for obj in smokes(scene)}
    if choices.smoke and choices.smoke not in known:
        names = ", ".join(known) or "none"
        raise ShotError(f"The scene has no smoke of the name {choices.smoke}: it has {names}.")
    if smoke is None and not choices.clip:
        raise ShotError("The scene has no clip for Smokelift: give one with --clip.")
    smoke = known.get(choices.smoke) or smoke or new_smoke(scene)
    activate(smoke, scene)
    settings = smoke.smokelift
    if choices.clip:
        try:
            settings.clip = bpy.data.movieclips.load(str(choices.clip.absolute()))
        except RuntimeError:
            raise ShotError(f"The clip {choices.clip} cannot be opened.") from None
    for name in ("quality", "detail", "seed", "distance"):
        value = getattr(choices, name)
        if value is not None:
            setattr(settings, name, value)
    if choices.output:
        settings.output = str(choices.output.absolute())
    if settings.clip is None:
        raise ShotError("The scene has no clip for Smokelift: give one with --clip.")
    if choices.frames:
        use_frames(smoke, *choices.frames)
    found = unseen_pictures(settings)
    if found is not None and settings.last < found.count:
        why = f" ({found.missing_names()} missing)" if found.missing else ""
        last = number_in_file(settings.clip, settings.last)
        print(f"The clip is used up to its frame {last} of {found.count - 1}{why}; --frames takes more.", flush=True)
    return smoke


def _render(smoke: bpy.types.Object, path: Path) -> None:
    """Render all frames of the smoke if the name has #### for their numbers, else the current frame."""
    scene = bpy.context.scene
    scene.render.filepath = str(path.absolute())
    if "#" not in path.name:
        bpy.ops.render.render(write_still=True)
        return
    scene.frame_start, scene.frame_end = volume.shown_range(smoke)
    bpy.ops.render.render(animation=True)


def _parser() -> argparse.ArgumentParser:
    known = bpy.types.Object.bl_rna.properties["smokelift"].fixed_type.properties
    parser = argparse.ArgumentParser(prog="smokelift", description="Turn the scene's clip into a volume of smoke.")
    add = parser.add_argument
    add("--smoke", metavar="NAME", help="smoke to make, if the scene has several (default: the active)")
    add("--clip", type=Path, help="clip to use in place of the smoke's")
    add("--frames", type=_frames, metavar="A:B", help="first and last frame of the clip to use, counted from 0")
    add("--quality", choices=known["quality"].enum_items.keys(), help="how much of the clip's detail is kept")
    add("--detail", type=_within(known["detail"], float), metavar="0..1", help="Depth Detail: 0 (smooth) to 1")
    add(
        "--seed", type=_within(known["seed"], int), metavar="N", help="Variation: number of the plausible smoke, from 0"
    )
    add(
        "--distance",
        type=_within(known["distance"], float),
        metavar="METERS",
        help="Distance: from the camera to the lower end of the smoke, level and straight ahead; 0: estimated",
    )
    add("--output", type=Path, help="folder for the results")
    add("--resume", action="store_true", help="resume the last unfinished run")
    add("--set-up", action="store_true", help="make renders match the clip, as Set Up Shot does")
    add("--save", action="store_true", help="save the .blend with the result")
    add("--render", type=Path, metavar="PICTURE", help="render the current frame, or all if the name has ####")
    return parser


def _within(setting: bpy.types.Property, kind: type[float]) -> Callable[[str], float]:
    """Read a number that a setting can hold; Blender itself would take the nearest without a word."""

    def read(text: str) -> float:
        low, high = setting.hard_min, setting.hard_max
        try:
            value = kind(text)
        except ValueError:
            value = math.nan
        if not low <= value <= high:
            what = "whole number" if kind is int else "number"
            raise argparse.ArgumentTypeError(f"{text!r}: expected a {what} from {low} to {high}")
        return value

    return read


def _frames(text: str) -> tuple[int, int]:
    try:
        first, last = (int(part) for part in text.split(":"))
    except ValueError:
        raise argparse.ArgumentTypeError(f"{text!r}: expected the first and last frame A:B, from 0") from None
    return first, last


def command(words: list[str]) -> int:
    """``blender --command smokelift reconstruct ...``"""
    if not words or words[0] != "reconstruct":
        print("usage: blender -b shot.blend --command smokelift reconstruct [options]", file=sys.stderr)
        return BAD_INPUT
    return main(words[1:])


def register() -> None:
    register.handles = [bpy.utils.register_cli_command("smokelift", command)]


def unregister() -> None:
    """Remove the command and its handle, which would crash Blender at its end."""
    bpy.utils.unregister_cli_command(register.handles.pop())
