"""The one place that imports and starts Taichi, and that knows where its arrays live.

On the CPU a device array is a NumPy array, which kernels use in place; on a GPU it is a Taichi array.
"""

from __future__ import annotations

import io
import os
import re
import sys
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager, redirect_stderr, redirect_stdout
from pathlib import Path
from typing import IO, Any, Literal

import numpy as np

os.environ.setdefault("ENABLE_TAICHI_HEADER_PRINT", "0")
import taichi as ti

DeviceName = Literal["auto", "cpu", "gpu"]

_GPU_BACKENDS = {"cuda": ti.cuda, "metal": ti.metal, "vulkan": ti.vulkan}


_SOFTWARE = ("llvmpipe", "lavapipe", "swiftshader")
"""Vulkan devices that are programs on the processor, where Taichi's own CPU code is much faster."""

_running: str | None = None  # Taichi itself is one per process


class DeviceError(RuntimeError):
    """The device that was asked for is not there."""


def _cache_directory() -> Path:
    base = os.environ.get("XDG_CACHE_HOME")
    return (Path(base) if base else Path.home() / ".cache") / "smokelift" / "taichi"


def available_gpu() -> str | None:
    """Name of the first GPU back end that Taichi can use here, or None."""
    with Path(os.devnull).open("wb") as nowhere, _diverted(nowhere):
        for name, arch in _GPU_BACKENDS.items():
            if ti.lang.misc.is_arch_supported(arch):
                return name
    return None


def start(device: DeviceName = "auto") -> str:
    """Start Taichi once for this process and say which back end runs.

    Parameters
    ----------
    device
        ``"auto"`` takes a GPU if there is one, else the CPU. A Vulkan device in software is taken for
        ``"gpu"`` only.

    Returns
    -------
    str
        ``"cpu"``, ``"cuda"``, ``"metal"`` or ``"vulkan"``.

    Raises
    ------
    DeviceError
        If a GPU is asked for and there is none, or if another back end is already running.
    """
    global _running
    if _running is not None:
        if (device == "cpu" and _running != "cpu") or (device == "gpu" and _running == "cpu"):
            raise DeviceError(
                f"The renderer already runs on {_running} in this process; start a new process for {device}."
            )
        return _running
    gpu = None if device == "cpu" else available_gpu()
    if device == "gpu" and gpu is None:
        raise DeviceError(
            "No GPU that Taichi can use was found (CUDA, Metal or Vulkan); use --device cpu or update the driver."
        )
    if gpu is not None:
        chip = _initialise(_GPU_BACKENDS[gpu])
        if device == "auto" and any(name in chip.lower() for name in _SOFTWARE):
            ti.reset()
            gpu = None
    if gpu is None:
        _initialise(ti.cpu)
    _running = gpu or "cpu"
    return _running


def _initialise(arch: Any) -> str:
    """Start Taichi on a back end; the name of its Vulkan device, if it has one."""
    cache = _cache_directory()
    try:
        cache.mkdir(parents=True, exist_ok=True)
    except OSError:
        cache = Path(tempfile.gettempdir()) / "smokelift-taichi"
    with tempfile.TemporaryFile() as log:
        with _diverted(log):
            ti.init(
                arch=arch,
                default_fp=ti.f32,
                # exact operations: x != x must stay a test for NaN, and CPU and GPU should agree
                fast_math=False,
                offline_cache_file_path=str(cache),
                log_level=ti.TRACE,  # nothing else tells the device's name
            )
            ti.set_logging_level(ti.ERROR)
        log.seek(0)
        found = re.search(rb'Vulkan Device "([^"]*)"', log.read())
    return found.group(1).decode(errors="replace") if found else ""


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


@contextmanager
def _diverted(file: IO[bytes]) -> Iterator[None]:
    """Taichi's greeting and its drivers' complaints go to a file: output may carry JSON, errors are exceptions."""
    for stream in (sys.stdout, sys.stderr):
        stream.flush()
    saved = [os.dup(number) for number in (1, 2)]
    try:
        for number in (1, 2):
            os.dup2(file.fileno(), number)
        # Python's streams need not be those two: a notebook or a test has put others in their place
        with redirect_stdout(io.StringIO()), redirect_stderr(io.StringIO()):
            yield
    finally:
        for number, copy in zip((1, 2), saved, strict=True):
            os.dup2(copy, number)
            os.close(copy)
