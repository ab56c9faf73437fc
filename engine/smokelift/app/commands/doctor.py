"""``smokelift doctor``: versions, devices and what is missing."""

from __future__ import annotations

import argparse
import os
import platform
from importlib import metadata
from typing import Any

import psutil

from smokelift import __version__, _core
from smokelift.app.progress import Reporter
from smokelift.output.vdb import VdbUnavailable, vdb_module
from smokelift.render import device

LIBRARIES = ("numpy", "scipy", "taichi", "av", "OpenEXR", "pillow")


def add_parser(commands: Any, common: argparse.ArgumentParser) -> None:
    """Add the command."""
    parser = commands.add_parser("doctor", parents=[common], help="versions, devices and what is missing")
    parser.set_defaults(run=run)


def run(options: argparse.Namespace, say: Reporter) -> None:
    """Say line by line what is there."""
    for line in _report():
        say.note(line)


def _report() -> list[str]:
    lines = [
        f"smokelift {__version__}, Python {platform.python_version()}, {platform.system()} {platform.machine()}",
        "libraries: " + ", ".join(f"{name} {metadata.version(name)}" for name in LIBRARIES),
        f"core: {_core.__name__}, {os.cpu_count()} processor cores, "
        f"{psutil.virtual_memory().available / 2**30:.1f} of {psutil.virtual_memory().total / 2**30:.1f} GiB free",
    ]
    running = device.start()
    lines.append(
        "GPU: none that Taichi can use well; the renderer runs on the processor"
        if running == "cpu"
        else f"GPU: {running}; the renderer runs on it"
    )
    try:
        module = vdb_module()
        lines.append(f"OpenVDB: {module.__name__} {'.'.join(map(str, module.LIBRARY_VERSION))}")
    except VdbUnavailable as missing:
        lines.append(f"OpenVDB: missing. {missing}")
    return lines
