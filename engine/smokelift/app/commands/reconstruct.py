"""``smokelift reconstruct``: a clip or scene file to a VDB sequence."""

import argparse
import time
from pathlib import Path

import numpy as np
from PIL import Image

from smokelift.app.options import (
    add_run_options,
    named_path,
    require_file,
    scene_of,
    settings_of,
    whole_number,
)
from smokelift.app.progress import Reporter, seconds_before
from smokelift.checks import Figures, Finding
from smokelift.checks.whole_files import atomic_path
from smokelift.footage.clip import Clip
from smokelift.output.images import eight_bit
from smokelift.output.index import MAX_START_NUMBER, median_psnr
from smokelift.output.writer import check_directory, count_finished, written_kinds
from smokelift.pipeline import Frame, reconstruct
from smokelift.render import device
from smokelift.report.cost import Workload, estimate_cost, frames_seconds, moment, require_memory
from smokelift.report.facts import count_empty, expected_shortcomings, facts, forecast_of, made_up, shortcomings
from smokelift.report.sentences import sentence
from smokelift.scene import Domain
from smokelift.setup.first_estimate import what_helps
from smokelift.setup.shot import Shot


def add_options(parser: argparse.ArgumentParser) -> None:
    """Add the options of the command."""
    add_run_options(parser)
    parser.add_argument("--out", type=named_path, required=True, help="directory for the sequence")
    parser.add_argument("--npz", action="store_true", help="write NumPy files as well")
    parser.add_argument(
        "--thumbnail", type=named_path, metavar="FILE.png", help="picture of the newest frame beside the clip's"
    )
    parser.add_argument(
        "--start-number",
        type=whole_number(0, MAX_START_NUMBER),
        default=1,
        metavar="N",
        help="number in the name of the first file, 1001 for example (default: 1); frames themselves count from 1",
    )
    parser.add_argument("--resume", action="store_true", help="go on after the frames that are finished")


def run(options: argparse.Namespace, say: Reporter) -> None:
    """Reconstruct; say what was assumed, and every frame. ValueError, with empty frames written, if none has smoke."""
    began = moment()
    settings = settings_of(options)
    _check_outputs(options)
    scene, source = scene_of(options)
    device.start(options.device)
    with Clip.open(source) as clip:
        written_kinds(options.npz)  # before the set-up, which takes minutes
        reconstruction = reconstruct(clip, scene, settings)
        shot = reconstruction.shot
        resolution, work = shot.scene.domain.resolution, Workload.of(shot, settings, began)
        require_memory(resolution, work, given=isinstance(scene.domain, Domain))
        for finding in (*shot.findings, *expected_shortcomings(shot), *made_up(shot)):
            say.note(finding)
        finished, new = count_finished(options.out) if options.resume else 0, set[int]()
        seconds = frames_seconds(resolution, work) * (1 - finished / shot.length)
        say.start(
            shot.length,
            finished,
            seconds,
            lambda: forecast_of(shot, facts(shot, scene, estimate_cost(resolution, work)), work),
        )

        def report(frame: Frame) -> None:
            new.add(frame.number)
            if options.thumbnail:
                _write_thumbnail(options.thumbnail, shot, frame)
            say.frame(frame.number, frame.figures)

        sequence = reconstruction.write(
            options.out, npz=options.npz, resume=options.resume, start_number=options.start_number, on_frame=report
        )
    figures = [sequence.figures(number) for number in sequence.frames]
    if count_empty(figures) == len(figures):
        given = scene.background is not None and not scene.background.estimated
        raise ValueError(
            f"No smoke found: nothing differs from the background by more than the clip's noise does, so all frames "
            f"in {options.out} are empty. "
            f"{sentence(what_helps(shot.clip, given))}"
        )
    for doubt in shortcomings(figures, burns=shot.fire is not None):
        say.note(doubt)
    seconds = time.monotonic() - began[0] + seconds_before(sequence, new)
    fit = median_psnr(figures)
    result: Figures = {"directory": str(options.out), "frames": len(sequence.frames), "seconds": round(seconds, 1)}
    done = Finding("written", result) if fit is None else Finding("reconstructed", {**result, "psnr": fit})
    say.finish(done, {**result, "psnr": fit})


def _check_outputs(options: argparse.Namespace) -> None:
    """Refuse what cannot be written to."""
    out, thumbnail = options.out, options.thumbnail
    check_directory(out, resume=options.resume)
    require_file(thumbnail)
    if thumbnail is not None and out.resolve() in thumbnail.resolve().parents:
        raise ValueError(
            f"{thumbnail}: the thumbnail cannot lie in {out}, which is for the sequence alone; choose another folder."
        )


def _write_thumbnail(path: Path, shot: Shot, frame: Frame) -> None:
    """Write a PNG of the part of a frame that is fitted, beside its reconstruction, or above it if it is wide."""
    observations = shot.observe(frame.number - 1)
    if not observations:  # the frame shows nothing of the domain: the last picture stays
        return
    seen = observations[0]
    found = shot.optics.renderer(seen.camera, seen.clean_plate.image).image(frame.density)
    rows, columns = seen.image.shape[:2]
    both = np.concatenate([seen.image, found], 0 if columns > rows else 1)
    with atomic_path(path) as aside:
        Image.fromarray(eight_bit(both)).save(aside, format="PNG")
