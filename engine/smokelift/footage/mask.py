"""Garbage mattes: pictures that are white where a clip may show smoke, and black where it shows none.

A mask hides what is neither smoke nor anything to learn from: a head, a dog, leaves, a label. Every frame is continued
there from around it, so that whole pictures hold nothing that moves, and no edge that stays. Counts of pixels leave it
out (`Clip.seen`). Once the plate is known, it takes that place (`plate.cleared`).

A pixel is hidden or not: the mask's stored value counts as black or white, whichever is nearer. Soft edges have no
meaning: a frame that shows only a part of its smoke would be taken for one of thinner smoke.
"""

from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path

import numpy as np
import numpy.typing as npt
from scipy import ndimage

from smokelift.footage.frame_source import ClipError, StoredPicture, is_pattern, is_video, numbered_files
from smokelift.footage.image_files import read_image
from smokelift.footage.images import LUMINANCE, Picture, area_average, push_pull, reduced_size
from smokelift.footage.video import Video

CONTINUED_SIDE = 320
"""Pixels along the longer side of the continued picture, which is too smooth to need more."""

MIN_SQUARE = 10 / 320
"""Side of a square that must be white, over the picture's longer side: the clip's noise is measured on its blocks."""

MIN_WEIGHT = 0.01
"""Weight of what is seen below which a pixel is continued from all of the picture, not from around it: at this weight
single precision still has five digits."""

MAX_CACHED_MASKS = 16
"""Resized masks that are kept: two megabytes each at 1080p."""

Seen = npt.NDArray[np.bool_]


@dataclass(frozen=True, eq=False)
class Mask:
    """What hides a part of the frames of a clip's file."""

    seen: Callable[[int, int, int], Seen]
    """What returns which pixels (height, width) of the file's frame n are not hidden, by n, width and height."""
    files: tuple[Path, ...] = ()
    """What it is read from."""
    count: int | None = None
    """Number of the file's frames that have a mask, None if one serves all."""
    close: Callable[[], None] = lambda: None
    """What closes its file."""

    @staticmethod
    def open(path: Path, needed: range, size: tuple[int, int]) -> "Mask":
        """Open one mask for all frames of a clip's file, or one for each.

        The path is a picture, or a video or a pattern ``mask_####.png`` whose frame n belongs to the file's frame n. A
        picture with an alpha channel is read over black. ``needed`` are the file's frames that need a mask, ``size`` is
        the width and height of the clip. ClipError or ImageError is raised if the mask cannot be read, lacks a frame,
        has another shape than the clip, or hides nearly all of it.
        """
        video = Video(path, "linear") if is_video(path) else None
        files = numbered_files(path) if is_pattern(path) else (path,)
        count = video.count if video else len(files) if is_pattern(path) else None
        if missing := [file for file in files if count and not file.is_file()]:
            raise ClipError(f"{missing[0]}: this mask is missing; give one for every frame, or one picture for all.")
        if count is None:
            needed = needed[:1]
        elif needed[-1] >= count:
            raise ClipError(
                f"{path}: has masks for {count} of the frames 0 to {needed[-1]} that are needed; give one for every "
                "frame of the clip, or one picture for all."
            )

        def picture(n: int) -> Picture:
            return video.read(n).linear() if video else read_image(files[n], "linear")

        @lru_cache(maxsize=MAX_CACHED_MASKS)
        def resized(n: int, width: int, height: int) -> Seen:
            return area_average(picture(n) @ LUMINANCE.astype(np.float32), width, height) >= 0.5

        def seen(n: int, width: int, height: int) -> Seen:
            return resized(n if count else 0, width, height)

        require_shape(f"{path}: this mask is", picture(needed[0] if count else 0), size, "paint it")
        side = max(1, round(MIN_SQUARE * max(size)))
        if not any(ndimage.binary_erosion(seen(n, *size), np.ones((side, side))).any() for n in needed):
            raise ClipError(
                f"{path}: this mask leaves too little of the picture white (transparent counts as black); paint white "
                f"where smoke may be, a square of {side} x {side} pixels at least."
            )
        return Mask(seen, files, count, video.close if video else lambda: None)

    def applied(self, n: int, image: StoredPicture) -> StoredPicture:
        """Return the picture of the file's frame ``n``, continued where it is hidden."""
        seen = self.seen(n, *image.size)
        if seen.all():
            return image
        whole = image.linear().copy()
        whole[~seen] = continued(whole, seen)
        return StoredPicture(whole)


def require_shape(what: str, picture: Picture, size: tuple[int, int], do: str) -> None:
    """Raise ClipError if a picture (rows, columns, ...) is not of a clip's shape; ``size`` is its width and height."""
    (width, height), (rows, columns) = size, picture.shape[:2]
    # either may be a resized copy, whose sides are right to a pixel
    if abs(columns * height - rows * width) > columns + rows + width + height:
        raise ClipError(
            f"{what} {columns} x {rows} pixels, another shape than the clip's {width} x {height}; {do} over a frame of "
            "the clip."
        )


def continued(picture: Picture, seen: Seen) -> Picture:
    """Return the pixels (n, 3) of a linear picture (rows, columns, 3) that are not seen, continued from around them."""
    rows, columns = seen.shape
    size = reduced_size(columns, rows, CONTINUED_SIDE)
    fraction = area_average(seen, *size)
    mean = area_average(np.where(seen[..., None], picture, 0), *size) / np.maximum(fraction, 1e-6)[..., None]
    known = (fraction > 0).astype(np.float32)
    # far from what is seen it fades to black; so does a white picture, which tells by how much
    fading = push_pull(np.ones_like(mean), known)
    usual = mean[fraction > 0].mean(0)
    smooth = np.where(fading > MIN_WEIGHT, push_pull(mean, known) / np.maximum(fading, MIN_WEIGHT), usual)
    return area_average(smooth, columns, rows)[~seen]
