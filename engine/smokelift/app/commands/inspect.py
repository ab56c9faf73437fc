"""``smokelift inspect``: what would be assumed, chosen and spent, before it is spent."""

from __future__ import annotations

import argparse
from dataclasses import asdict
from typing import Any

from smokelift.app.cost import estimate_cost
from smokelift.app.inspection import facts, inspection, write_scene
from smokelift.app.options import add_run_options, named_path, require_folder, scene_of, settings_of
from smokelift.app.page import PAGE_KINDS, write_page
from smokelift.app.progress import Reporter
from smokelift.footage.clip import Clip
from smokelift.render import device
from smokelift.scene import scene_to_dict
from smokelift.scene.checks import counted
from smokelift.setup.prepare import boundaries, prepare_shot
from smokelift.setup.provenance import made_up


def add_parser(commands: Any, common: argparse.ArgumentParser) -> None:
    """Add the command."""
    parser = commands.add_parser(
        "inspect",
        parents=[common],
        help="what a run would assume and choose, and what it would cost, without running it",
    )
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
        "--write",
        type=named_path,
        metavar="scene.toml",
        help="write every estimate into a scene file that you can edit",
    )
    parser.set_defaults(run=run)


def run(options: argparse.Namespace, say: Reporter) -> None:
    """Prepare the shot and say what it takes."""
    settings = settings_of(options)
    for path in (*options.page, options.write):
        require_folder(path)
    for path in options.page:
        if path.suffix.lower() not in PAGE_KINDS:
            raise ValueError(f"{path}: the page is written as {' or '.join(PAGE_KINDS)}.")
    if options.write is not None and options.write.exists():
        raise ValueError(f"{options.write}: is there already; nothing was overwritten, give another name.")
    scene, source = scene_of(options)
    device.start(options.device)
    with Clip.open(source) as clip:
        shot = prepare_shot(clip, scene, settings)
        frames = len(clip)
        domain = shot.scene.domain
        choices = [choice.reason for choice in shot.choices]
        notes = [*shot.notes, *boundaries(shot.scene, settings), *choices, *made_up(shot)]
        for note in notes:
            say.note(note)
        cost = estimate_cost(domain, frames, settings, len(shot.views) - 1)
        known = facts(shot, scene, cost)
        files = list(options.page)
        if options.page:
            said = {fact.how for fact in known}
            page = inspection(shot, scene, known, [note for note in notes if note not in said])
            for path in options.page:
                write_page(path, page)
        if options.write is not None:
            files += write_scene(options.write, shot, scene, known)
    voxels = " x ".join(map(str, domain.resolution))
    written = f" {', '.join(map(str, files))} written." if files else ""
    say.finish(
        f"{counted(frames, 'frame')} of {voxels} voxels: about {cost.seconds:.0f} s, {cost.memory / 2**30:.1f} GiB of "
        f"memory ({cost.memory_free / 2**30:.1f} are free), up to {cost.disk / 1e6:.0f} MB on disk.{written}",
        {
            "frames": frames,
            "scene": scene_to_dict(shot.scene),
            "choices": [choice.as_dict() for choice in shot.choices],
            "facts": [fact.as_dict() for fact in known],
            "files": [str(path) for path in files],
            **asdict(cost),
        },
    )
