"""The commands that read a clip: ``reconstruct``, ``extract``, and ``inspect``, which says what a run would do."""

import argparse
import time
from collections.abc import Iterator, Sequence
from dataclasses import asdict, replace
from pathlib import Path

import numpy as np
from PIL import Image

import smokelift.pipeline as pipeline
from smokelift.app.options import (
    add_clip_options,
    add_run_options,
    named_path,
    require_file,
    scene_of,
    settings_of,
    whole_number,
)
from smokelift.app.progress import Reporter, say_frames, seconds_before
from smokelift.checks import Figures, Finding, counted
from smokelift.checks.whole_files import atomic_path
from smokelift.footage.clip import Clip
from smokelift.footage.images import Picture
from smokelift.output.images import VIDEO_KINDS, eight_bit, write_image, write_video
from smokelift.output.index import MAX_START_NUMBER, median_psnr
from smokelift.output.writer import check_directory, count_finished, written_kinds
from smokelift.pipeline.extraction import ELEMENT_KINDS
from smokelift.render import device
from smokelift.report.cost import Workload, estimate_cost, frames_seconds, moment, require_memory
from smokelift.report.facts import (
    boundaries,
    count_empty,
    expected_shortcomings,
    facts,
    forecast_of,
    made_up,
    shortcomings,
)
from smokelift.report.inspection import PAGE_KINDS, inspection_page, write_page
from smokelift.report.sentences import choices, fact, sentence
from smokelift.scene import Background, Domain, Scene, scene_to_dict
from smokelift.setup.first_estimate import what_helps
from smokelift.setup.prepare import prepare_shot
from smokelift.setup.shot import Shot

SQUARES = 24
"""Squares of the checker along the longer side of a preview."""

CHECKER = (0.05, 0.25)
"""Linear radiance of its squares: both darker than most smoke, so that thin smoke shows, and unlike each other."""


def add_reconstruct_options(parser: argparse.ArgumentParser) -> None:
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


def reconstruct(options: argparse.Namespace, say: Reporter) -> None:
    """Reconstruct; say what was assumed, and every frame. ValueError, with empty frames written, if none has smoke."""
    began = moment()
    settings = settings_of(options)
    out, thumbnail = options.out, options.thumbnail
    check_directory(out, resume=options.resume)
    require_file(thumbnail)
    if thumbnail is not None and out.resolve() in thumbnail.resolve().parents:
        raise ValueError(
            f"{thumbnail}: the thumbnail cannot lie in {out}, which is for the sequence alone; choose another folder."
        )
    scene, source = scene_of(options)
    device.start(options.device)
    with Clip.open(source) as clip:
        written_kinds(options.npz)  # before the set-up, which takes minutes
        reconstruction = pipeline.reconstruct(clip, scene, settings)
        shot = reconstruction.shot
        resolution, work = shot.scene.domain.resolution, Workload.of(shot, settings, began)
        require_memory(resolution, work, given=isinstance(scene.domain, Domain))
        for finding in (*shot.findings, *expected_shortcomings(shot), *made_up(shot)):
            say.note(finding)
        finished, new = count_finished(out) if options.resume else 0, set[int]()
        seconds = frames_seconds(resolution, work) * (1 - finished / shot.length)
        say.start(
            shot.length,
            finished,
            seconds,
            lambda: forecast_of(shot, facts(shot, scene, estimate_cost(resolution, work)), work),
        )

        def report(frame: pipeline.Frame) -> None:
            new.add(frame.number)
            if thumbnail:
                _write_thumbnail(thumbnail, shot, frame)
            say.frame(frame.number, frame.figures)

        sequence = reconstruction.write(
            out, npz=options.npz, resume=options.resume, start_number=options.start_number, on_frame=report
        )
    figures = [sequence.figures(number) for number in sequence.frames]
    if count_empty(figures) == len(figures):
        given = scene.background is not None and not scene.background.estimated
        strokes = next((found.figures for found in shot.findings if found.kind == "strokes"), {})
        painted = bool(strokes.get("other") or strokes.get("behind"))
        empty = Finding("no smoke found", {"path": str(out)}, doubt=True)
        raise ValueError(" ".join(map(sentence, (empty, what_helps(shot.clip, given, painted)))))
    for doubt in shortcomings(figures, burns=shot.fire is not None):
        say.note(doubt)
    seconds = time.monotonic() - began[0] + seconds_before(sequence, new)
    fit = median_psnr(figures)
    result: Figures = {"directory": str(out), "frames": len(sequence.frames), "seconds": round(seconds, 1)}
    done = Finding("written", result) if fit is None else Finding("reconstructed", {**result, "psnr": fit})
    say.finish(done, {**result, "psnr": fit})


def _write_thumbnail(path: Path, shot: Shot, frame: pipeline.Frame) -> None:
    """Write a PNG of the part of a frame that is fitted, beside its reconstruction, or above it if it is wide."""
    observations = shot.observe(frame.number - 1)
    if not observations:  # the frame shows nothing of the domain: the last picture stays
        return
    seen = observations[0]
    found = shot.optics.renderer(seen.camera, seen.clean_plate.image).image(frame.density)
    rows, columns = seen.image.shape[:2]
    both = np.concatenate([seen.image, found], 0 if columns > rows else 1)
    with atomic_path(path) as temporary:
        Image.fromarray(eight_bit(both)).save(temporary, format="PNG")


def add_extract_options(parser: argparse.ArgumentParser) -> None:
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


def extract(options: argparse.Namespace, say: Reporter) -> None:
    """Write the elements; then, if they are asked for, the plate and the preview."""
    require_file(options.plate, ELEMENT_KINDS)
    require_file(options.preview, (".png", *VIDEO_KINDS))
    if options.out.exists() and not options.out.is_dir():
        raise ValueError(f"{options.out}: is a file; give a pattern such as element_####.exr, or a directory.")
    parent = options.out.absolute().parent
    if parent.exists() and not parent.is_dir():
        raise ValueError(f"{parent}: is a file; give a pattern in a directory.")
    scene, source = scene_of(options)
    with Clip.open(source) as clip:
        extraction = pipeline.extract(clip, scene)
        for finding in extraction.findings:
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


def _write_preview(path: Path, extraction: pipeline.Extraction) -> None:
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


def add_inspect_options(parser: argparse.ArgumentParser) -> None:
    add_run_options(parser)
    parser.add_argument(
        "--page",
        type=named_path,
        action="append",
        default=[],
        metavar="FILE",
        help="write a page with pictures of what was found, .png or .html; may be given again",
    )
    parser.add_argument(
        "--write", type=named_path, metavar="scene.toml", help="write every estimate into a scene file, to be edited"
    )


def inspect(options: argparse.Namespace, say: Reporter) -> None:
    """Prepare the shot; say what is known of it and what a run takes."""
    began = moment()
    settings = settings_of(options)
    require_file(options.write)
    for path in options.page:
        require_file(path, PAGE_KINDS)
    if options.write is not None and options.write.exists():
        raise ValueError(f"{options.write}: is there already; nothing was overwritten, give another name.")
    scene, source = scene_of(options)
    device.start(options.device)
    with Clip.open(source) as clip:
        shot = prepare_shot(clip, scene, settings)
        frames = len(clip)
        domain = shot.scene.domain
        findings = [*shot.findings, *expected_shortcomings(shot), *boundaries(shot.scene), *made_up(shot)]
        for finding in findings:
            say.note(finding)
        work = Workload.of(shot, settings, began)
        cost = estimate_cost(domain.resolution, work)
        known = facts(shot, scene, cost)
        forecast = forecast_of(shot, known, work)
        files = list(options.page)
        if options.page:
            page = inspection_page(shot, scene, known, findings)
            for path in options.page:
                write_page(path, page)
        if options.write is not None:
            files += _write_scene(options.write, shot, known)
    voxels = " x ".join(map(str, domain.resolution))
    written = f" {', '.join(map(str, files))} written." if files else ""
    say.finish(
        f"{counted(frames, 'frame')} of {voxels} voxels: {fact(known[-1])['value']}. {sentence(known[-1])}{written}",
        {
            "frames": frames,
            "scene": scene_to_dict(shot.scene),
            "choices": choices(shot.findings),
            "files": [str(path) for path in files],
            **forecast,
            **asdict(cost),
        },
    )


def _write_scene(path: Path, shot: Shot, known: Sequence[Finding]) -> tuple[Path, ...]:
    """Write all that was found into a scene file, with the facts as comments; return the files.

    An estimated background of one color becomes a color of the file. Any other is left to be found again, because a
    picture does not say which of its parts are unknown or how wrong they may be. It is written beside the file for
    those who want to mend it. A file that is there already is a ValueError.
    """
    scene, given = Scene(**vars(shot.scene)), shot.scene.background
    plate = shot.found_background if given.estimated else None
    picture = path.with_name(f"{path.stem}_background.exr")
    lines = [fact(each) for each in known if each.about != "cost"]
    said = ["{what}: {value} ({origin})".format(**line) for line in lines]
    color = None if plate is None else plate[0, 0]
    one_color = color is not None and bool((plate == color).all())
    files = (path,) if plate is None or one_color else (path, picture)
    for file in files:
        if file.exists():
            raise ValueError(f"{file}: is there already; nothing was overwritten, give another name.")
    if color is not None and one_color:
        red, green, blue = map(float, color)
        scene = replace(scene, background=Background(color=(red, green, blue), strokes=given.strokes))
    elif plate is not None:
        write_image(picture, plate, half=False)
        scene = replace(scene, background=None if given.strokes is None else given)
        said.append(f"A run finds the background again. {picture.name} shows it: once mended, give it as background.")
    scene.save(path, said)
    return files
