"""How closely a density renders to its clip, at the clip's own pixels.

A fit is judged on the working picture, one pixel per voxel; what is finer than the grid shows here only. So that it
costs little, rays go through every n-th pixel of every n-th row, n odd: the ray through the middle of a block of n x n
pixels is that of its middle pixel, so these pixels are rendered exactly, and the mean over them stands for that over
all.
"""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from smokelift.extraction.matte import matte
from smokelift.footage.images import reduced_size
from smokelift.render import Image, Optics, Volume
from smokelift.setup.shot import Shot, ShotView

OUTLINE_PIXELS = 320
"""Pixels along the longer side of the picture, at most, in which the smoke is found: its outline needs no more
(docs/experiments/clip-pixels.md)."""

RAYS_PER_VOXEL = 2.0
"""Rays along a voxel, about, where it has as many pixels: what interpolation leaves repeats from voxel to voxel, and
two rays per voxel see both its ends and its middle (docs/experiments/clip-pixels.md)."""


@dataclass(frozen=True, eq=False)
class BesideClip:
    """Pixels of a clip's frame where the domain is, and what a density shows there."""

    seen: Image
    shown: Image
    """(rows, columns, 3): the clip's and the density's; linear radiance."""
    inside: NDArray[np.bool_]
    """(rows, columns) bool: which of them show smoke in the clip."""

    @property
    def psnr(self) -> float | None:
        """PSNR of linear radiance inside the smoke (dB, peak 1); None without smoke."""
        left = np.square((self.seen - self.shown)[self.inside], dtype=np.float64)
        return float(-10 * np.log10(max(left.mean(), 1e-12))) if left.size else None


def beside_clip(
    view: ShotView, optics: Optics, frame: int, density: Volume, step: int | None = None
) -> BesideClip | None:
    """Render a density (nx, ny, nz) beside a frame, from 0, of a view's clip, at the clip's own pixels.

    Only every so many pixels along and across are taken, an odd number; by default as many as leave `RAYS_PER_VOXEL`.
    It is None if nothing of the domain is in the frame's picture.
    """
    working = view.working_at(frame, optics.domain)
    if working is None:
        return None
    side = min(working.width, working.height)
    wanted = step or 2 * round((math.sqrt(working.pixels) / RAYS_PER_VOXEL - 1) / 2) + 1
    step = max(1, min(wanted, side - 1 + side % 2))
    columns, rows = working.width // step, working.height // step
    # what is left over of a step is left out on both sides
    left, top = (working.width - columns * step) // 2, (working.height - rows * step) // 2
    camera = view.camera.at(frame).cropped(working.left + left, working.top + top, columns * step, rows * step)
    across = left + step // 2 + step * np.arange(columns)
    down = top + step // 2 + step * np.arange(rows)

    def cut(picture: NDArray[np.float32]) -> NDArray[np.float32]:
        part = working.part(picture)
        return part[down[0] : down[-1] + 1 : step, across[0] : across[-1] + 1 : step]

    plate = view.plate.at(frame)
    behind = cut(plate.image)
    renderer = optics.renderer(camera.resized(columns, rows), behind, density > 0)
    shown = renderer.image(density)
    seen = view.clip.stored(frame).cut(cut).averaged(columns, rows)
    small = working.resized(*reduced_size(working.width, working.height, OUTLINE_PIXELS))
    smoke = matte(small.of(view.clip, frame), plate.through(small.cut, small.pixels)).mask
    inside = smoke[np.ix_(down * smoke.shape[0] // working.height, across * smoke.shape[1] // working.width)]
    return BesideClip(seen, shown, inside)


def clip_psnr(shot: Shot, frame: int, density: Volume) -> dict[str, float]:
    """Return the PSNR of a frame's density (nx, ny, nz) at its clips' own pixels inside the smoke; frames from 0.

    It is ``psnr`` of the input, ``psnr_view_1``, ... of further views, in dB of linear radiance with peak 1; each
    absent where its picture shows no smoke. Smoke alone: fire is left out of the pictures before.
    """
    figures = {}
    for number, view in enumerate(shot.views):
        beside = beside_clip(view, shot.optics, frame, density)
        psnr = None if beside is None else beside.psnr
        if psnr is not None:
            figures[f"psnr_view_{number}" if number else "psnr"] = psnr
    return figures
