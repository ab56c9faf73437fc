"""A camera that turns as one that stands still: one wide picture, of which each frame shows a part."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path

import numpy as np
from PIL import Image
from scipy.spatial.transform import Rotation

from smokelift.checks.array_types import Doubles
from smokelift.footage.clip import Clip, ClipError
from smokelift.footage.images import Picture, area_average
from smokelift.footage.mask import HALF, Seen, continued
from smokelift.footage.noise import lasting_noise
from smokelift.footage.plate import ChangingPlate, Plate, noise_before
from smokelift.footage.proxy import proxy_size
from smokelift.footage.turning import Turns, moved

PADDING = 2
"""Pixels by which a frame is continued beyond its border, so that it is interpolated there as elsewhere."""

MIN_SEEN_SHARE = 0.99
"""Share of a pixel of the panorama that a frame shows at least."""


@dataclass(frozen=True, eq=False)
class Panorama:
    """The picture of a camera that stands still in the mean pose and sees all that any frame shows.

    Attributes
    ----------
    turns
        Of the frames.
    corner
        Left and top of the wide picture, in pixels of the mean pose's.
    size
        Its width and height.
    """

    turns: Turns
    corner: tuple[int, int]
    size: tuple[int, int]

    @staticmethod
    def around(turns: Turns) -> Panorama:
        """Return the one that holds all frames."""
        width, height = turns.size
        corners = np.array([[0, 0], [width, 0], [0, height], [width, height]], np.float64)
        places = np.concatenate([moved(corners, turns.between(turn)) for turn in turns.rotations])
        left, top = (int(v) for v in np.floor(places.min(0)))
        right, bottom = (int(v) for v in np.ceil(places.max(0)))
        return Panorama(turns, (left, top), (right - left, bottom - top))

    def steadied(self, clip: Clip) -> Clip:
        """Return what the camera that stands still sees; what a frame does not show is hidden as by a mask.

        Frames of the file outside of the clip that do not show what it does raise ClipError.
        """
        shown = _Shown(self, clip)

        def change(number: int, picture: Picture) -> Picture:
            wide = shown.wide(clip.first + number, picture)
            seen = shown.seen(clip.first + number, *self.size)
            wide[~seen] = continued(wide, seen)
            return wide

        return clip.changed(change, size=self.size, mask=shown)

    def plates(self, plate: Plate, clip: Clip) -> ChangingPlate:
        """Return the background of every frame of a clip, from that of the camera that stands still."""

        @lru_cache(maxsize=2)
        def part(frame: int) -> Plate:
            matrix = _shift(-self.corner[0], -self.corner[1]) @ self.turns.between(self.turns.rotations[frame])
            image, confidence = (reprojected(of, matrix, clip.size) for of in (plate.image, plate.confidence))
            return Plate(image, np.clip(confidence, 0, 1), plate.noise, plate.errors)

        silent = ChangingPlate(part, lasting_noise(0.0))
        return ChangingPlate(part, noise_before(silent, clip))


class _Shown:
    """Where the frames of a clip's file lie in a panorama: a mask of it."""

    files: tuple[Path, ...] = ()
    count: int | None = None

    def __init__(self, panorama: Panorama, clip: Clip) -> None:
        self._panorama, self._clip, self._whole = panorama, clip, clip.whole()
        self._turn = lru_cache(maxsize=None)(self._found)

    def seen(self, n: int, width: int, height: int) -> Seen:
        """Return which pixels of a wide picture of a size frame ``n`` of the file shows and no mask hides."""
        clip = self._clip
        own = self._whole.seen(n, *clip.size)
        part = np.ones(clip.size[::-1], np.float32) if own is None else own.astype(np.float32)
        return area_average(self.wide(n, part, 0) > MIN_SEEN_SHARE, width, height) >= HALF

    def wide(self, n: int, picture: Picture, padding: int = PADDING) -> Picture:
        """Return a picture (rows, columns, ...) of frame ``n`` of the file where it lies; 0 where it shows nothing."""
        turns, sides = self._panorama.turns, [(padding, padding)] * 2 + [(0, 0)] * (picture.ndim - 2)
        matrix = _shift(padding, padding) @ turns.between(self._turn(n).inv()) @ _shift(*self._panorama.corner)
        return reprojected(np.pad(picture, sides, mode="edge"), matrix, self._panorama.size)

    def close(self) -> None:
        """Nothing is open."""

    def _found(self, n: int) -> Rotation:
        clip, turns = self._clip, self._panorama.turns
        if clip.first <= n < clip.first + len(clip):
            return turns.rotations[n - clip.first]
        turn = turns.of(self._whole.stored(n).averaged(*proxy_size(*clip.size)))
        if turn is None:
            raise ClipError(f"{clip.path}: frame {n} does not show what the frames in use show; choose other frames")
        return turn


def reprojected(picture: Picture, matrix: Doubles, size: tuple[int, int]) -> Picture:
    """Return a picture (rows, columns, ...) as a homography shows it, by cubic interpolation; 0 where it shows nothing.

    Parameters
    ----------
    picture
        None of its values is negative.
    matrix : (3, 3)
        From places in the new picture to places in the old one, in pixels whose centres are at half integers.
    size
        Width and height of the new picture.
    """
    if picture.ndim == 3:
        return np.stack([reprojected(picture[..., channel], matrix, size) for channel in range(picture.shape[2])], -1)
    numbers = (matrix / matrix[2, 2]).ravel()[:8].tolist()
    whole = Image.fromarray(np.ascontiguousarray(picture, np.float32))
    turned = whole.transform(size, Image.Transform.PERSPECTIVE, numbers, Image.Resampling.BICUBIC)
    return np.maximum(np.asarray(turned, np.float32), 0)


def _shift(across: float, down: float) -> Doubles:
    return np.array([[1, 0, across], [0, 1, down], [0, 0, 1.0]])
