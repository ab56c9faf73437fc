"""Clips of a camera that turns before a wall, with smoke in front of it."""

from pathlib import Path

import numpy as np
from scipy import ndimage
from scipy.spatial.transform import Rotation

from smokelift.footage.clip import Clip
from smokelift.footage.images import linear_to_srgb, srgb_to_linear
from smokelift.footage.stored_picture import LinearPicture
from smokelift.footage.turning import moved

SIZE, MARGIN, COUNT = (240, 180), 60, 12
LENS = np.array([[300.0, 0, 120], [0, 300, 90], [0, 0, 1]])
"""From directions to pixels."""


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
    pixels = np.column_stack([x.ravel(), y.ravel()])
    random = np.random.default_rng(1)
    boil = ndimage.gaussian_filter(random.standard_normal((len(turns), *plate.shape[:2])), (1, 6, 6))
    boil = np.clip(0.5 + 0.5 * boil / boil.std(), 0, 1)
    boil[:, :, : MARGIN + 82] = boil[:, :, MARGIN + 158 :] = 0
    clear, smoky = [], []
    for n, turn in enumerate(turns):
        place = moved(pixels, between(turn)) + MARGIN - 0.5
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

    def read(self, n: int) -> LinearPicture:
        return LinearPicture(self.frames[n].copy())

    def close(self) -> None:
        pass


def clip_of(frames: np.ndarray) -> Clip:
    return Clip(Path("turning"), Frames(frames), None, None)


def shake(pixels: float) -> Rotation:
    """Return turns by up to so many pixels about each axis, frame to mean pose."""
    turns = np.random.default_rng(2).uniform(-1, 1, (COUNT, 3)) * pixels / LENS[0, 0]
    return centred(Rotation.from_rotvec(turns))


def pan(pixels: float) -> Rotation:
    """Return turns that pan over so many pixels, frame to mean pose."""
    along = np.linspace(-0.5, 0.5, COUNT) * pixels / LENS[0, 0]
    return centred(Rotation.from_rotvec(np.outer(along, [0.1, 1.0, 0.05])))


def centred(turns: Rotation) -> Rotation:
    return turns.mean().inv() * turns


def off(found: Rotation, true: Rotation) -> float:
    """Return how far off a turn shows any corner of the picture, at most, in pixels."""
    width, height = SIZE
    corners = np.array([[0, 0], [width, 0], [0, height], [width, height]], float)
    apart = [moved(corners, between(a)) - moved(corners, between(b)) for a, b in zip(found, true, strict=True)]
    return float(np.abs(apart).max())


def between(turn: Rotation) -> np.ndarray:
    """Return the homography of a picture whose directions turn."""
    return LENS @ turn.as_matrix() @ np.linalg.inv(LENS)


def over_a_plain(pixels: float) -> np.ndarray:
    """Return frames of a camera that goes sideways: what is near, below, moves by so many pixels, the far by none."""
    plate = wall()
    y, x = np.mgrid[: SIZE[1], : SIZE[0]] + float(MARGIN)
    noise = np.random.default_rng(3)
    frames = []
    for along in np.linspace(-0.5, 0.5, COUNT) * pixels:
        at = [y, x + along * (y - MARGIN) / SIZE[1]]
        seen = np.stack([ndimage.map_coordinates(plate[..., c], at, order=3, mode="nearest") for c in range(3)], -1)
        frames.append(linear_to_srgb(seen) + noise.normal(0, 1 / 255, seen.shape))
    return srgb_to_linear(np.clip(np.stack(frames), 0, 1)).astype(np.float32)
