"""Which device renders: the processor with compiled code, or a GPU with Taichi.

Taichi may be missing. It is only imported where a GPU driver is installed, and, unless a GPU is asked for, where a GPU
is: that alone takes longer than all that is estimated before a run.
"""

from __future__ import annotations

import ctypes
import sys
from importlib import import_module
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

from smokelift.render.cpu_backend import CpuBackend, RaySupport
from smokelift.render.plan import RenderPlan

if TYPE_CHECKING:
    from smokelift.render.gpu.backend import GpuBackend

DeviceName = Literal["auto", "cpu", "gpu"]

_SOFTWARE = ("llvmpipe", "lavapipe", "swiftshader")
"""Vulkan devices that are programs on the processor, where the compiled code is much faster."""

_DRIVERS = {
    "linux": ("libcuda.so.1", "libvulkan.so.1"),
    "win32": ("nvcuda.dll", "vulkan-1.dll"),
}
"""Libraries of which one is there where Taichi can use a GPU; macOS always has Metal."""

_NODES = ("dri/renderD*", "nvidia[0-9]*", "dxg")
"""Files in /dev of which Linux has one for every GPU: by its own drivers, by NVIDIA's, and under Windows."""

_running: str | None = None  # one device a process

NO_TAICHI = (
    "Taichi is not installed: install it (pip install 'smokelift[gpu]'; in Blender the extension's zip smokelift_gpu)"
)
"""What a sentence says where it is needed."""


class DeviceError(RuntimeError):
    """The device that was asked for is not there."""


def available_gpu() -> str | None:
    """Name of the first GPU back end that Taichi can use here, or None."""
    if not (driver_installed() and has_taichi()):
        return None
    name: str | None = _taichi().supported_gpu()
    return name


def has_taichi() -> bool:
    """Whether Taichi is installed; it is not imported."""
    return find_spec("taichi") is not None


def start(device: DeviceName = "auto") -> str:
    """Choose the device of this process, once, and return ``"cpu"``, ``"cuda"``, ``"metal"`` or ``"vulkan"``.

    ``"auto"`` takes a GPU if there is one, else the CPU; a Vulkan device in software is taken for ``"gpu"`` only. It
    raises DeviceError if a GPU is asked for and there is none, or if another device is already in use.
    """
    global _running
    if _running is not None:
        if (device == "cpu" and _running != "cpu") or (device == "gpu" and _running == "cpu"):
            raise DeviceError(
                f"The renderer already runs on {_running} in this process; start a new process for {device}."
            )
        return _running
    wanted = device == "gpu" or (device == "auto" and gpu_present())
    gpu = available_gpu() if wanted else None
    if device == "gpu" and not has_taichi():
        raise DeviceError(f"A GPU cannot be used, as {NO_TAICHI}, or choose cpu as the device.")
    if device == "gpu" and gpu is None:
        raise DeviceError(
            "No GPU that Taichi can use was found (CUDA, Metal or Vulkan); choose cpu as the device, or update the "
            "driver."
        )
    if gpu is not None:
        chip = _taichi().start(gpu)
        if device == "auto" and any(name in chip.lower() for name in _SOFTWARE):
            _taichi().stop()
            gpu = None
    _running = gpu or "cpu"
    return _running


def backend(plan: RenderPlan, ray_support: RaySupport | None = None) -> CpuBackend | GpuBackend:
    """What renders a plan on the device of this process; a GPU needs no `RaySupport`."""
    if start() == "cpu":
        return CpuBackend(plan, ray_support)
    on_gpu: GpuBackend = import_module("smokelift.render.gpu.backend").GpuBackend(plan)
    return on_gpu


def _taichi() -> Any:
    return import_module("smokelift.render.gpu.taichi_runtime")


def gpu_present() -> bool:
    """Whether the system lists a GPU, whatever can be done with it; without that list, it is taken to have one."""
    return sys.platform != "linux" or any(True for nodes in _NODES for _ in Path("/dev").glob(nodes))


def driver_installed() -> bool:
    """Whether a driver is there that Taichi could use."""
    if sys.platform not in _DRIVERS:
        return True
    for library in _DRIVERS[sys.platform]:
        try:
            ctypes.CDLL(library)
        except OSError:
            continue
        return True
    return False
