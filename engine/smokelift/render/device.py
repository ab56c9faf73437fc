"""Which device renders: the processor with compiled code, or, if it is asked for, a GPU with Taichi.

Taichi may be missing, and importing it takes longer than all that is estimated before a run.

Beside them OpenBLAS, which comes with NumPy and SciPy, has threads that wait actively for milliseconds after every
product. They keep the cores from the engine's own threads: a frame of 64 x 64 x 96 voxels takes 1.6 times as long
beside them on two cores (docs/experiments/memory-and-time.md). The command ``smokelift`` starts without them.
"""

import ctypes
import sys
from contextlib import AbstractContextManager
from functools import lru_cache
from importlib.util import find_spec
from typing import Any, Literal

import scipy.linalg  # noqa: F401  its OpenBLAS is another than NumPy's, and is limited only if it is loaded
from threadpoolctl import ThreadpoolController

DeviceName = Literal["auto", "cpu", "gpu"]

_DRIVERS = {"linux": ("libcuda.so.1", "libvulkan.so.1"), "win32": ("nvcuda.dll", "vulkan-1.dll")}
"""Libraries of which one is there where Taichi can use a GPU; macOS always has Metal."""

_running: str | None = None  # one device per process

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
    from smokelift.render import taichi_runtime

    return taichi_runtime.supported_gpu()


def has_taichi() -> bool:
    """Whether Taichi is installed; it is not imported."""
    return find_spec("taichi") is not None


def start(device: DeviceName = "auto") -> str:
    """Choose the device of this process, once, and return ``"cpu"``, ``"cuda"``, ``"metal"`` or ``"vulkan"``.

    ``"auto"`` is the device in use, and the CPU at first: no measurement says that a GPU is faster. It raises
    DeviceError if a GPU is asked for and there is none, or if another device is already in use.
    """
    global _running
    if _running is not None:
        if (device == "cpu" and _running != "cpu") or (device == "gpu" and _running == "cpu"):
            raise DeviceError(
                f"The renderer already runs on {_running} in this process; start a new process for {device}."
            )
        return _running
    if device != "gpu":
        _running = "cpu"
        return _running
    if not has_taichi():
        raise DeviceError(f"A GPU cannot be used, as {NO_TAICHI}, or choose cpu as the device.")
    gpu = available_gpu()
    if gpu is None:
        raise DeviceError(
            "No GPU that Taichi can use was found (CUDA, Metal or Vulkan); choose cpu as the device, or update the "
            "driver."
        )
    from smokelift.render import taichi_runtime

    taichi_runtime.start(gpu)
    _running = gpu
    return _running


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


def products_on_one_thread() -> AbstractContextManager[Any]:
    """Within this context products take one thread, and after it as many as before."""
    limit: AbstractContextManager[Any] = _libraries().limit(limits=1, user_api="blas")
    return limit


_libraries = lru_cache(maxsize=1)(ThreadpoolController)
"""The libraries that are loaded; to find them takes as long as a picture."""
