"""``smokelift inspect``: what a run would assume, choose and spend."""

import argparse
from collections.abc import Sequence
from dataclasses import asdict, replace
from pathlib import Path

from smokelift.app.options import add_run_options, named_path, require_file, scene_of, settings_of
from smokelift.app.progress import Reporter
from smokelift.checks import Finding, counted
from smokelift.footage.clip import Clip
from smokelift.output.images import write_image
from smokelift.render import device
from smokelift.report.cost import Workload, estimate_cost, moment
from smokelift.report.facts import boundaries, expected_shortcomings, facts, forecast_of, made_up
from smokelift.report.inspection import PAGE_KINDS, inspection_page, write_page
from smokelift.report.sentences import choices, fact, sentence
from smokelift.scene import Background, Scene, scene_to_dict
from smokelift.setup.prepare import prepare_shot
from smokelift.setup.shot import Shot


def add_options(parser: argparse.ArgumentParser) -> None:
    """Add the options of the command."""
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


def run(options: argparse.Namespace, say: Reporter) -> None:
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
