"""``smokelift doctor``: versions, devices and what is missing."""

import argparse
import os
import platform
from importlib import metadata

import psutil

from smokelift import __version__, _core
from smokelift.app.progress import Reporter
from smokelift.checks import counted
from smokelift.output.vdb import VdbUnavailable, vdb_module
from smokelift.render import device

LIBRARIES = ("numpy", "scipy", "av", "OpenEXR", "pillow", "taichi")


def run(options: argparse.Namespace, say: Reporter) -> None:
    """Say what is there, line by line."""
    lines = [
        f"smokelift {__version__}, Python {platform.python_version()}, {platform.system()} {platform.machine()}",
        "libraries: " + ", ".join(f"{name} {_version(name)}" for name in LIBRARIES),
        f"core: {_core.__file__}, {counted(os.cpu_count() or 1, 'processor core')}, "
        f"{psutil.virtual_memory().available / 2**30:.1f} of {psutil.virtual_memory().total / 2**30:.1f} GiB free",
        f"GPU: {_gpu(device.start())}",
    ]
    try:
        module = vdb_module()
        lines.append(f"OpenVDB: {module.__name__} {'.'.join(map(str, module.LIBRARY_VERSION))}")
    except VdbUnavailable as missing:
        lines.append(f"OpenVDB: missing. {missing}")
    for line in lines:
        say.note(line)


def _version(name: str) -> str:
    try:
        return metadata.version(name)
    except metadata.PackageNotFoundError:
        return "missing"


def _gpu(running: str) -> str:
    if running != "cpu":
        return f"{running}; the renderer runs on it"
    if device.driver_installed() and not device.has_taichi():
        return f"not used, as {device.NO_TAICHI}; the renderer runs on the processor"
    gpu = device.available_gpu()
    return (
        f"{gpu}, with --device gpu; by itself the renderer runs on the processor" if gpu else "none that Taichi can use"
    )
