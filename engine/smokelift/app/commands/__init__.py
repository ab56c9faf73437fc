"""The commands of the command line: a module each, or one for some that are alike."""

import argparse
from collections.abc import Callable, Mapping
from typing import NamedTuple

from smokelift.app.commands import batch, directed, doctor, export, extract, inspect, reconstruct, render, sequences
from smokelift.app.progress import Reporter
from smokelift.output.vdb import PROXY_TIMES


class Command(NamedTuple):
    """What a command is for, what adds its options to its parser, and what runs it and says what happens."""

    help: str
    add_options: Callable[[argparse.ArgumentParser], None]
    run: Callable[[argparse.Namespace, Reporter], None]


COMMANDS: Mapping[str, Command] = {
    "reconstruct": Command("turn a clip or scene file into a VDB sequence", reconstruct.add_options, reconstruct.run),
    "extract": Command(
        "separate smoke from what is behind it, as pictures with alpha", extract.add_options, extract.run
    ),
    "batch": Command("reconstruct a list of shots, as many at a time as memory allows", batch.add_options, batch.run),
    "inspect": Command(
        "say what a run would assume, choose and cost, without running it", inspect.add_options, inspect.run
    ),
    "render": Command("make an image or video of a sequence", render.add_options, render.run),
    "check": Command("check that a sequence is complete and undamaged", sequences.add_sequence, sequences.check),
    "preview": Command(
        "make pictures and a video that show the smoke from all sides",
        sequences.add_preview_options,
        sequences.preview,
    ),
    "proxy": Command(
        f"write copies for viewports, with voxels {PROXY_TIMES} times as large", sequences.add_sequence, sequences.proxy
    ),
    "evaluate": Command(
        "compare the smoke with its front, known volumes and other cameras",
        sequences.add_evaluate_options,
        sequences.compare,
    ),
    "continue": Command(
        "make what the smoke does after its clip, or in wind", directed.add_continue_options, directed.continue_
    ),
    "retime": Command(
        "make slow motion, fast motion and ramps of a sequence", directed.add_retime_options, directed.retime
    ),
    "loop": Command("make a part of a sequence repeat without a seam", directed.add_loop_options, directed.loop),
    "export": Command("write small OpenVDB files, a proxy and a USD file", export.add_options, export.run),
    "doctor": Command("list versions, devices and what is missing", doctor.add_options, doctor.run),
}
