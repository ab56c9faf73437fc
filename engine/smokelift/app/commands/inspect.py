"""``smokelift inspect``: what would be assumed, chosen and spent, before it is spent."""

from __future__ import annotations

import argparse
from dataclasses import asdict
from typing import Any

from smokelift.app.cost import estimate_cost
from smokelift.app.options import add_run_options, scene_of, settings_of
from smokelift.app.progress import Reporter
from smokelift.footage.clip import Clip
from smokelift.render import device
from smokelift.scene import scene_to_dict
from smokelift.setup.prepare import boundaries, prepare_shot
from smokelift.setup.provenance import made_up


def add_parser(commands: Any, common: argparse.ArgumentParser) -> None:
    """Add the command."""
    parser = commands.add_parser(
        "inspect", parents=[common], help="what would be assumed, chosen and spent, before it is spent"
    )
    add_run_options(parser)
    parser.set_defaults(run=run)


def run(options: argparse.Namespace, say: Reporter) -> None:
    """Prepare the shot and say what it takes."""
    settings = settings_of(options)
    scene, source = scene_of(options)
    device.start(options.device)
    with Clip.open(source) as clip:
        shot = prepare_shot(clip, scene, settings)
        frames = len(clip)
    domain = shot.scene.domain
    for note in (
        *shot.notes,
        *boundaries(shot.scene, settings),
        *(choice.reason for choice in shot.choices),
        *made_up(shot),
    ):
        say.note(note)
    cost = estimate_cost(domain, frames, settings, len(shot.views) - 1)
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
