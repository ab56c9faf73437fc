"""Pictures, sheets of pictures and videos on disk, which appear whole or not at all."""

import errno
import os
from collections.abc import Iterable, Sequence
from fractions import Fraction
from pathlib import Path
from typing import Any

import av
import numpy as np
import numpy.typing as npt
import OpenEXR
from PIL import Image, ImageDraw

from smokelift.checks.whole_files import atomic_path
from smokelift.footage.image_files import ImageError
from smokelift.footage.images import linear_to_srgb
from smokelift.output.index import DISK_FULL

Tile = npt.NDArray[np.uint8]
"""An sRGB picture (rows, columns, 3)."""

GAP = 4
"""Pixels between tiles."""

_LINE = 16
"""Pixels of a line of text."""

VIDEO_KINDS = {
    ".mp4": ("mp4", "libx264"),
    ".mov": ("mov", "libx264"),
    ".mkv": ("matroska", "libx264"),
    ".webm": ("webm", "libvpx-vp9"),
}
"""Container and codec of each suffix."""


def eight_bit(image: npt.ArrayLike) -> npt.NDArray[np.uint8]:
    """Return linear radiance as 8 bit sRGB codes, clipped to 0..1."""
    return np.asarray(np.rint(255 * linear_to_srgb(np.clip(image, 0, 1))), np.uint8)


def write_image(path: str | Path, image: npt.ArrayLike, *, half: bool = True) -> None:
    """Write a linear picture, (height, width, 3) or (height, width), as EXR or as PNG (8 bit sRGB, clipped to 0..1).

    The path ends in ``.exr`` or ``.png``; the file appears whole or not at all. An EXR has 16 bit floats if `half` is
    true, else 32 bit ones. A picture (height, width, 4) has premultiplied alpha; an EXR keeps it so, a PNG has straight
    colors. It raises ImageError if the suffix or the shape is another or a value is not
    finite, and OSError if the file cannot be written.
    """
    path = Path(path)
    values = np.asarray(image, np.float32)
    if values.ndim == 2:
        values = np.repeat(values[..., None], 3, axis=2)
    if values.ndim != 3 or values.shape[2] not in (3, 4) or values.size == 0:
        raise ImageError(f"{path}: a picture must have the shape (height, width, 3 or 4), not {values.shape}")
    if not np.isfinite(values).all():
        raise ImageError(f"{path}: the picture holds values that are not finite; clamp them first")
    suffix = path.suffix.lower()
    if suffix == ".png":
        codes = eight_bit(values[..., :3])
        if values.shape[2] == 4:
            alpha = np.clip(values[..., 3:], 0, 1)
            straight = np.divide(values[..., :3], alpha, out=np.zeros_like(values[..., :3]), where=alpha > 0)
            codes = np.dstack([eight_bit(straight), np.asarray(np.rint(255 * alpha), np.uint8)])
        with atomic_path(path) as temporary:
            Image.fromarray(codes).save(temporary, format="PNG")
    elif suffix == ".exr":
        limit = float(np.finfo(np.float16).max)
        pixels = np.clip(values, -limit, limit).astype(np.float16) if half else values
        header = {"compression": OpenEXR.ZIP_COMPRESSION, "type": OpenEXR.scanlineimage}
        with atomic_path(path) as temporary:
            try:
                OpenEXR.File(header, {"RGBA"[: values.shape[2]]: np.ascontiguousarray(pixels)}).write(str(temporary))
            except RuntimeError as error:
                # OpenEXR tells of the system's errors in words only
                number = next((each for each in DISK_FULL if os.strerror(each) in str(error)), errno.EIO)
                raise OSError(number, os.strerror(number)) from error
    else:
        raise ImageError(f"{path}: can only write .exr and .png")


def write_sheet(path: Path, rows: Sequence[Sequence[Tile]], titles: Sequence[str], labels: Sequence[str]) -> None:
    """Write rows of tiles as a PNG, whatever the file's suffix, with titles above columns and labels above rows.

    Tiles are sRGB (rows, columns, 3), of one height in a row, and as wide as those of the first row or across all
    columns.
    """
    lefts = GAP + np.cumsum([0, *(tile.shape[1] + GAP for tile in rows[0])])
    tops = _LINE + np.cumsum([0, *(tiles[0].shape[0] + _LINE + GAP for tiles in rows)])
    whole = Image.new("RGB", (int(lefts[-1]), int(tops[-1])), (32, 32, 32))
    draw = ImageDraw.Draw(whole)
    for title, left in zip(titles, lefts, strict=False):
        draw.text((left, 2), title, fill=(230, 230, 230))
    for top, tiles, label in zip(tops, rows, labels, strict=False):
        draw.text((GAP, top + 2), label, fill=(170, 170, 170))
        for tile, left in zip(tiles, lefts, strict=False):
            whole.paste(Image.fromarray(tile), (int(left), int(top) + _LINE))
    with atomic_path(path) as temporary:
        whole.save(temporary, format="PNG")


def write_video(path: Path, frames: Iterable[npt.NDArray[np.float32]], fps: float) -> None:
    """Write linear frames (rows, columns, 3) of one size; the suffix says which kind of `VIDEO_KINDS`."""
    container_format, codec = VIDEO_KINDS[path.suffix.lower()]
    with (
        atomic_path(path) as temporary,
        av.open(f"file:{temporary.absolute()}", "w", format=container_format) as container,
    ):
        stream: Any = None
        for frame in frames:
            picture = eight_bit(frame)
            picture = picture[: picture.shape[0] // 2 * 2, : picture.shape[1] // 2 * 2]  # codecs want even sides
            if stream is None:
                stream = container.add_stream(codec, rate=Fraction(fps).limit_denominator(1001))
                stream.height, stream.width = picture.shape[:2]
                stream.pix_fmt = "yuv420p"
                stream.options = {"crf": "18"}
            container.mux(stream.encode(av.VideoFrame.from_ndarray(picture, format="rgb24")))
        if stream is not None:
            container.mux(stream.encode())
