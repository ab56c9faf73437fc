"""Garbage mattes: pictures that are white where a clip may show smoke, and black where it shows none.

What a mask hides is neither smoke nor anything to learn from: a head, a dog, leaves, a label. There every frame is
continued from around it, so that what looks at whole pictures meets nothing that moves, and no edge that stays. What
counts pixels leaves these out (`Clip.seen`). Once the background is known, it takes their place (`steady.cleared`).

A pixel is hidden or it is not: the mask's value, as it is stored, counts as the nearer of black and white. A frame that
shows a part of its smoke only would be taken for one of thinner smoke, so that soft edges have no meaning here.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import lru_cache
from pathlib import Path

import numpy as np
import numpy.typing as npt
from scipy import ndimage

from smokelift.footage.behind_smoke import push_pull
from smokelift.footage.frame_source import ClipError, FrameSource, Wrapped
from smokelift.footage.image_sequence import ImageSequence, is_pattern, is_video
from smokelift.footage.images import LUMINANCE, Picture, area_average, read_image, reduced_size
from smokelift.footage.stored_picture import StoredPicture
from smokelift.footage.video import Video

HALF = 0.5
"""Value from which on a pixel of a mask is white."""

CONTINUED = 320
"""Pixels along the longer side of the picture that is continued: as smooth as that is, it has no more detail."""

ROOM = 10 / 320
"""Side of a square that has to be white, over the longer side of the picture: blocks of it tell the clip's noise."""

FARTHEST = 0.01
"""Weight of what is seen from which on a pixel is continued from around it, and not from all of the picture."""

REMEMBERED = 16
"""Masks of a size that are kept: two megabytes each of 1080p."""

Seen = npt.NDArray[np.bool_]


class Mask:
    """A mask for all frames of a clip's file, or one for each.

    Parameters
    ----------
    path
        A picture; or a video, or a pattern ``mask_####.png``, whose frame n belongs to the file's frame n. Of a picture
        with an alpha channel it is what is seen of it before black.
    needed
        Frames of the file that need one.
    size
        Width and height of the clip's pictures.

    Attributes
    ----------
    files
        What it is read from.
    count
        Frames of the file that have one; None if they all do.

    Raises
    ------
    ClipError, ImageError
        If it cannot be read, lacks a frame, has another shape than the clip, or leaves next to nothing of it.
    """

    def __init__(self, path: Path, needed: range, size: tuple[int, int]) -> None:
        self._read: Callable[[int], Picture]
        self._video: Video | None = None
        self.count: int | None = None
        self.files: tuple[Path, ...] = (path,)
        if is_video(path):
            self._video = video = Video(path, "linear")
            self.count, self._read = video.count, lambda n: video.read(n).linear()
        elif is_pattern(path):
            self.files = ImageSequence(path, "linear", None).files
            self.count, self._read = len(self.files), lambda n: read_image(self.files[n], "linear")
            missing = [file for file in self.files if not file.is_file()]
            if missing:
                raise ClipError(
                    f"{missing[0]}: this mask is missing; give one for every frame, or one picture for all."
                )
        else:
            still = read_image(path, "linear")
            self._read, needed = lambda _: still, needed[:1]
        if self.count is not None and needed[-1] >= self.count:
            raise ClipError(
                f"{path}: has masks for {self.count} of the frames 0 to {needed[-1]} that are needed; give one for "
                "every frame of the clip, or one picture for all."
            )
        self._at = lru_cache(maxsize=REMEMBERED)(self._seen)
        (width, height), (rows, columns) = size, self._read(needed[0]).shape[:2]
        # either may be a resized copy: each side is right to a pixel
        if abs(columns * height - rows * width) > columns + rows + width + height:
            raise ClipError(
                f"{path}: this mask is {columns} x {rows} pixels, another shape than the clip's {width} x {height}; "
                "paint it over a frame of the clip."
            )
        side = max(1, round(ROOM * max(size)))
        if not any(ndimage.binary_erosion(self.seen(n, *size), np.ones((side, side))).any() for n in needed):
            raise ClipError(
                f"{path}: this mask leaves too little of the picture white (transparent counts as black); paint white "
                f"where smoke may be, a square of {side} x {side} pixels at least."
            )

    def seen(self, n: int, width: int, height: int) -> Seen:
        """Return which pixels of frame ``n`` of the file are not hidden, (height, width), for pictures of any size."""
        return self._at(n if self.count else 0, width, height)

    def _seen(self, n: int, width: int, height: int) -> Seen:
        return area_average(self._read(n) @ LUMINANCE.astype(np.float32), width, height) >= HALF

    def close(self) -> None:
        """Close the file."""
        if self._video is not None:
            self._video.close()


class Masked(Wrapped):
    """The frames of a source, continued where a mask hides them. Those that have no mask are left out."""

    def __init__(self, source: FrameSource, mask: Mask) -> None:
        super().__init__(source)
        self.mask = mask
        self.count = min(source.count, mask.count or source.count)

    def read(self, n: int) -> StoredPicture:
        image = self.source.read(n)
        seen = self.mask.seen(n, *image.size)
        if seen.all():
            return image
        whole = image.linear().copy()
        whole[~seen] = continued(whole, seen)
        return StoredPicture(whole)

    def close(self) -> None:
        super().close()
        self.mask.close()


def continued(picture: Picture, seen: Seen) -> Picture:
    """Return the pixels (n, 3) of a linear picture (rows, columns, 3) that are not seen, smoothly from around them."""
    rows, columns = seen.shape
    size = reduced_size(columns, rows, CONTINUED)
    share = area_average(seen.astype(np.float32), *size)
    mean = area_average(np.where(seen[..., None], picture, 0), *size) / np.maximum(share, 1e-6)[..., None]
    known = (share > 0).astype(np.float32)
    # far from what is seen it fades to black, and so does white
    fading = push_pull(np.ones_like(mean), known)
    usual = mean[share > 0].mean(0)
    smooth = np.where(fading > FARTHEST, push_pull(mean, known) / np.maximum(fading, FARTHEST), usual)
    whole = area_average(smooth, columns, rows)
    return np.asarray(whole[~seen], np.float32)
