"""How much memory a reconstruction takes, and whether it is there, before it is spent."""

from __future__ import annotations

import math

import psutil

from smokelift.scene import Domain

BYTES_A_VOXEL = 220
"""Peak of a whole run over a tiny one: 110 to 200 were measured from 48x48x72 to 256x256x288, most where smoke fills
much of the box."""

BASE_BYTES = 350 * 2**20
"""Interpreter, libraries, compiled kernels and decoded pictures."""


class NotEnoughMemoryError(MemoryError):
    """The grid does not fit; says which would."""


def needed(resolution: tuple[int, int, int]) -> int:
    """Bytes that a run at a resolution takes at its peak."""
    x, y, z = resolution
    return BASE_BYTES + BYTES_A_VOXEL * x * y * z


def free_memory() -> int:
    """Bytes that programs may still take."""
    return int(psutil.virtual_memory().available)


def require_memory(domain: Domain) -> None:
    """Check that a domain's grid fits into the memory that is free.

    Raises
    ------
    NotEnoughMemoryError
        With the largest resolution of the same shape that fits.
    """
    free = free_memory()
    want = needed(domain.resolution)
    if want <= free:
        return
    shape = " x ".join(map(str, domain.resolution))
    fits = _largest(domain.resolution, free)
    advice = (
        f"the largest that fits is --resolution {','.join(map(str, fits))}"
        if fits
        else "close other programs; no grid of this shape fits"
    )
    raise NotEnoughMemoryError(
        f"{shape} voxels need about {want / 2**30:.1f} GiB of memory and {free / 2**30:.1f} GiB are free; {advice}."
    )


def _largest(resolution: tuple[int, int, int], free: int) -> tuple[int, int, int] | None:
    """The largest resolution of exactly the same proportions, so that voxels stay cubes, that fits."""
    common = math.gcd(*resolution)
    x, y, z = (n // common for n in resolution)
    for times in range(common - 1, 0, -1):
        candidate = (x * times, y * times, z * times)
        if needed(candidate) <= free and min(candidate) >= 8:
            return candidate
    return None
