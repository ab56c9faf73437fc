"""The part of a camera's picture that holds the smoke of all frames, from wherever around the smoke it is seen."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from smokelift.output.sequence import Sequence
from smokelift.scene import Camera, Domain, orbit
from smokelift.scene.camera import project_points

MIN_VISIBLE_DEPTH = 0.01
"""Optical depth from which smoke is seen: it changes what is behind it by as much, which is a step or two of 8 bits."""

MARGIN_FRACTION = 0.05
"""Margin on each side, as a fraction of the smoke's longer side in the picture."""

MIN_ASPECT = 0.5
"""Width over height of the part at least, and the reverse, where the picture has room for it."""

TURN_STEP = 15
"""Degrees between the turns from which the smoke is measured."""

RIM_POINTS = 24
"""Points of the ellipse in which smoke stands that is as deep as its box."""


@dataclass(frozen=True)
class Framing:
    """Where in a camera's picture the smoke is."""

    box: Domain
    """The smoke of all frames; what cameras are turned about."""
    left: int
    top: int
    width: int
    height: int
    """The part of the full picture, in its pixels."""

    def camera(self, camera: Camera, height: int) -> Camera:
        """Return the camera of the part, so many pixels high."""
        part = camera.cropped(self.left, self.top, self.width, self.height)
        return part.resized(max(2, round(self.width * height / self.height)), height)

    def part(self, picture: NDArray[np.float32]) -> NDArray[np.float32]:
        """Return the part of a full picture (rows, columns, ...)."""
        return picture[self.top : self.top + self.height, self.left : self.left + self.width]


def frame_smoke(sequence: Sequence) -> Framing:
    """Find where the smoke of a sequence is, from the scene's camera and from that camera turned about the smoke.

    It reads every frame.
    """
    scene = sequence.scene
    box = _smoke_box(sequence)
    rim = _rim(box)
    seen = [
        pixels
        for matrix in range(len(scene.camera.matrices) or 1)
        for yaw in range(0, 360, TURN_STEP)
        for pixels, depth in [project_points(orbit(scene.camera.at(matrix), box, yaw), rim)]
        if (depth > 0).all()
    ]
    width, height = scene.camera.size
    if not seen:
        return Framing(box, 0, 0, width, height)
    points = np.concatenate(seen)
    low, high = points.min(0), points.max(0)
    low, high = low - MARGIN_FRACTION * (high - low).max(), high + MARGIN_FRACTION * (high - low).max()
    least = MIN_ASPECT * (high - low)[::-1]
    lacking = np.maximum(least - (high - low), 0) / 2
    left, top = np.clip(np.floor(low - lacking), 0, [width - 1, height - 1]).astype(int)
    right, bottom = np.clip(np.ceil(high + lacking), [left + 1, top + 1], [width, height]).astype(int)
    return Framing(box, int(left), int(top), int(right - left), int(bottom - top))


def _smoke_box(sequence: Sequence) -> Domain:
    """The box of the smoke that is seen from the front or from the side in any frame; the whole domain without any."""
    domain = sequence.scene.domain
    opacity = sequence.scene.medium.extinction * domain.voxel_size
    nx, ny, nz = domain.shape
    front, side = np.zeros((nx, nz), np.bool_), np.zeros((ny, nz), np.bool_)
    for number in sequence.frames:
        density = sequence.density(number)
        front |= opacity * density.sum(1) > MIN_VISIBLE_DEPTH
        side |= opacity * density.sum(0) > MIN_VISIBLE_DEPTH
    if not (front.any() and side.any()):
        return domain
    x, y, z = (np.flatnonzero(line) for line in (front.any(1), side.any(1), front.any(0)))
    return domain.part(tuple(slice(int(seen[0]), int(seen[-1]) + 1) for seen in (x, y, z)))


def _rim(box: Domain) -> NDArray[np.float64]:
    """Points (n, 3) of the upright elliptic cylinder in a box: smoke seldom fills a box's edges."""
    turns = 2 * np.pi * np.arange(RIM_POINTS) / RIM_POINTS
    low, high, (x, y, _) = np.array(box.min), np.array(box.max), box.centre
    half = (high - low) / 2
    rim = [np.stack([x + half[0] * np.cos(turns), y + half[1] * np.sin(turns), np.full(RIM_POINTS, z)], -1)
           for z in (low[2], high[2])]  # fmt: skip
    return np.concatenate(rim)
