"""Clips of a camera that turns before a wall, with smoke in front of it."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from scipy import ndimage
from scipy.spatial.transform import Rotation

from smokelift.footage.alignment import Lens
from smokelift.footage.clip import Clip
from smokelift.footage.images import linear_to_srgb, srgb_to_linear

SIZE, MARGIN, COUNT = (160, 120), 40, 12
LENS = Lens(SIZE, (200.0, 200.0), (80.0, 60.0))


def wall(contrast: float = 1.0) -> np.ndarray:
    """Return a textured linear background, wider than a picture by a margin on every side."""
    random = np.random.default_rng(0)
    shape = (SIZE[1] + 2 * MARGIN, SIZE[0] + 2 * MARGIN, 3)
    fine = sum(ndimage.gaussian_filter(random.standard_normal(shape), (s, s, 0)) * s for s in (1.0, 3.0))
    return srgb_to_linear(np.clip(0.4 + 0.12 * contrast * fine, 0.02, 0.98))


def pictures(
    plate: np.ndarray, turns: Rotation, smoke: float = 0.0, noise: float = 1.0
) -> tuple[np.ndarray, np.ndarray]:
    """Return what a camera sees, with and without smoke, linear (frames, rows, columns, 3).

    The smoke, up to so opaque, boils and rises over a third of the picture. Noise is in 8 bit codes.
    """
    y, x = np.mgrid[: SIZE[1], : SIZE[0]] + 0.5
    rays = LENS.rays(np.column_stack([x.ravel(), y.ravel()]))
    random = np.random.default_rng(1)
    boil = ndimage.gaussian_filter(random.standard_normal((len(turns), *plate.shape[:2])), (1, 4, 4))
    boil = np.clip(0.5 + 0.5 * boil / boil.std(), 0, 1)
    boil[:, :, : MARGIN + 55] = boil[:, :, MARGIN + 105 :] = 0
    clear, smoky = [], []
    for n, turn in enumerate(turns):
        place = LENS.pixels(turn.apply(rays)) + MARGIN - 0.5
        at = [place[:, 1].reshape(y.shape), place[:, 0].reshape(y.shape)]
        behind = np.stack([ndimage.map_coordinates(plate[..., c], at, order=3, mode="nearest") for c in range(3)], -1)
        opacity = smoke * ndimage.map_coordinates(boil[n], at, order=1)[..., None]
        clear.append(behind)
        smoky.append(behind * (1 - opacity) + 0.7 * opacity)
    codes = linear_to_srgb(np.stack(smoky)) + random.normal(0, noise / 255, (len(turns), *y.shape, 3))
    return srgb_to_linear(np.clip(codes, 0, 1)).astype(np.float32), np.stack(clear).astype(np.float32)


class Frames:
    """Frames in memory; a `smokelift.footage.frame_source.FrameSource`."""

    fps, warning, files, lens, backdrop = 24.0, None, (), None, None

    def __init__(self, frames: np.ndarray) -> None:
        self.frames, self.count = frames, len(frames)

    def read(self, n: int) -> np.ndarray:
        return self.frames[n].copy()

    def close(self) -> None:
        pass


def clip_of(frames: np.ndarray) -> Clip:
    return Clip(Path("turning"), Frames(frames), None, None)


def shake(pixels: float) -> Rotation:
    """Return turns by up to so many pixels about each axis, frame to mean pose."""
    turns = np.random.default_rng(2).uniform(-1, 1, (COUNT, 3)) * pixels / LENS.focal[0]
    return centred(Rotation.from_rotvec(turns))


def pan(pixels: float) -> Rotation:
    """Return turns that pan over so many pixels, frame to mean pose."""
    along = np.linspace(-0.5, 0.5, COUNT) * pixels / LENS.focal[0]
    return centred(Rotation.from_rotvec(np.outer(along, [0.1, 1.0, 0.05])))


def centred(turns: Rotation) -> Rotation:
    return turns.mean().inv() * turns


def off(found: Rotation, true: Rotation) -> float:
    """Return how far off a turn shows any corner of the picture, at most, in pixels."""
    width, height = SIZE
    corners = LENS.rays(np.array([[0, 0], [width, 0], [0, height], [width, height]], float))
    apart = [LENS.pixels(a.apply(corners)) - LENS.pixels(b.apply(corners)) for a, b in zip(found, true, strict=True)]
    return float(np.abs(apart).max())
