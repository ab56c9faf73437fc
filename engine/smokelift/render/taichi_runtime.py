"""The one place that imports and starts Taichi, and that knows where its arrays live.

Taichi compiles the kernels for a GPU; on the processor it runs the paper's baseline, and the GPU's kernels in tests.
There a device array is a NumPy array, which kernels use in place; on a GPU it is a Taichi array.
"""

import os
from pathlib import Path
from typing import Any

import numpy as np

from smokelift.footage.image_files import silenced

os.environ.setdefault("ENABLE_TAICHI_HEADER_PRINT", "0")
import taichi as ti

GPU_BACKENDS = {"cuda": ti.cuda, "metal": ti.metal, "vulkan": ti.vulkan}

_running: str | None = None  # Taichi itself is one per process


def supported_gpu() -> str | None:
    """Name of the first GPU back end that Taichi can use here, or None."""
    with silenced():
        for name, arch in GPU_BACKENDS.items():
            if ti.lang.misc.is_arch_supported(arch):
                return name
    return None


def start(backend: str) -> None:
    """Start Taichi on ``"cpu"`` or one of `GPU_BACKENDS`; on the back end that already runs, do nothing.

    It raises RuntimeError if Taichi already runs on another back end.
    """
    global _running
    if _running is None:
        _initialize(GPU_BACKENDS.get(backend, ti.cpu))
        _running = backend
    elif _running != backend:
        raise RuntimeError(f"Taichi already runs on {_running} in this process; start a new one.")


def _initialize(arch: Any) -> None:
    base = os.environ.get("XDG_CACHE_HOME")
    cache = (Path(base) if base else Path.home() / ".cache") / "smokelift" / "taichi"
    try:
        cache.mkdir(parents=True, exist_ok=True)
        where: dict[str, Any] = {"offline_cache_file_path": str(cache)}
    except OSError:
        where = {"offline_cache": False}  # in a shared folder others could put kernels for us
    with silenced():
        # exact operations: x != x must stay a test for NaN, and CPU and GPU should agree
        ti.init(arch=arch, default_fp=ti.f32, fast_math=False, log_level=ti.ERROR, **where)


def zeros(shape: tuple[int, ...]) -> Any:
    """A float32 array of zeros on the device."""
    if _running == "cpu":
        return np.zeros(shape, np.float32)
    array = ti.ndarray(ti.f32, shape)
    array.fill(0.0)
    return array


def upload(values: np.ndarray[Any, Any]) -> Any:
    """A device array (float32 or int32) with these values; on the CPU the same memory where possible."""
    dtype = np.int32 if np.issubdtype(values.dtype, np.integer) else np.float32
    values = np.ascontiguousarray(values, dtype)
    if _running == "cpu":
        return values
    array = ti.ndarray(ti.i32 if dtype is np.int32 else ti.f32, values.shape)
    array.from_numpy(values)
    return array


def matrix(values: np.ndarray[Any, Any]) -> Any:
    """A small matrix as a kernel argument."""
    return ti.Matrix(values.astype(np.float32).tolist(), dt=ti.f32)


def vector(values: np.ndarray[Any, Any]) -> Any:
    """A small vector as a kernel argument."""
    return ti.Vector(values.astype(np.float32).tolist(), dt=ti.f32)


def download(array: Any) -> np.ndarray[Any, Any]:
    """The values of a device array; on the CPU the array itself, so copy before it is written again."""
    return array if isinstance(array, np.ndarray) else np.asarray(array.to_numpy())
