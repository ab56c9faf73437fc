"""What is installed, what runs here, and what is missing: the answer to most questions before they are asked."""

from __future__ import annotations

import os
import platform
from importlib import metadata

import psutil

from smokelift import __version__, _core
from smokelift.output.vdb import VdbUnavailable, vdb_module
from smokelift.render import device

LIBRARIES = ("numpy", "scipy", "taichi", "av", "OpenEXR", "pillow")


def report() -> list[str]:
    """Lines about versions, devices and what is missing."""
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
