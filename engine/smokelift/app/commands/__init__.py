"""The commands of the command line: a module each, or one for some that are alike."""

import argparse
from collections.abc import Callable, Mapping
from typing import NamedTuple

from smokelift.app.commands import batch, clips, directed, doctor, sequences
from smokelift.app.options import add_sequence
from smokelift.app.progress import Reporter
from smokelift.output.vdb import PROXY_TIMES


class Command(NamedTuple):
    """What a command is for, what runs it and says what happens, and what adds its options to its parser, if any."""

    help: str
    run: Callable[[argparse.Namespace, Reporter], None]
    add_options: Callable[[argparse.ArgumentParser], None] = lambda _parser: None


COMMANDS: Mapping[str, Command] = {
    "reconstruct": Command(
        "turn a clip or scene file into a VDB sequence", clips.reconstruct, clips.add_reconstruct_options
    ),
    "extract": Command(
        "separate smoke from what is behind it, as pictures with alpha", clips.extract, clips.add_extract_options
    ),
    "batch": Command("reconstruct a list of shots, as many at a time as memory allows", batch.run, batch.add_options),
    "inspect": Command(
        "say what a run would assume, choose and cost, without running it", clips.inspect, clips.add_inspect_options
    ),
    "render": Command("make an image or video of a sequence", sequences.render, sequences.add_render_options),
    "check": Command("check that a sequence is complete and undamaged", sequences.check, add_sequence),
    "preview": Command(
        "make pictures and a video that show the smoke from all sides",
        sequences.preview,
        sequences.add_preview_options,
    ),
    "proxy": Command(
        f"write copies for viewports, with voxels {PROXY_TIMES} times as large", sequences.proxy, add_sequence
    ),
    "evaluate": Command(
        "compare the smoke with its front, known volumes and other cameras",
        sequences.compare,
        sequences.add_evaluate_options,
    ),
    "continue": Command(
        "make what the smoke does after its clip, or in wind", directed.continue_, directed.add_continue_options
    ),
    "retime": Command(
        "make slow motion, fast motion and ramps of a sequence", directed.retime, directed.add_retime_options
    ),
    "loop": Command("make a part of a sequence repeat without a seam", directed.loop, directed.add_loop_options),
    "export": Command(
        "write small OpenVDB files, a proxy and a USD file", sequences.export, sequences.add_export_options
    ),
    "doctor": Command("list versions, devices and what is missing", doctor.run),
}
