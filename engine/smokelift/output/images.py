"""Pictures on disk that appear whole or not at all."""

from __future__ import annotations

import errno
import os
from pathlib import Path

import numpy as np
import numpy.typing as npt
import OpenEXR
from PIL import Image

from smokelift.footage.images import ImageError, linear_to_srgb
from smokelift.output.atomic import DISK_FULL, atomic_path


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
        with atomic_path(path) as aside:
            Image.fromarray(codes).save(aside, format="PNG")
    elif suffix == ".exr":
        limit = float(np.finfo(np.float16).max)
        pixels = np.clip(values, -limit, limit).astype(np.float16) if half else values
        header = {"compression": OpenEXR.ZIP_COMPRESSION, "type": OpenEXR.scanlineimage}
        with atomic_path(path) as aside:
            try:
                OpenEXR.File(header, {"RGBA"[: values.shape[2]]: np.ascontiguousarray(pixels)}).write(str(aside))
            except RuntimeError as error:
                raise _of_system(error) from error
    else:
        raise ImageError(f"{path}: can only write .exr and .png")


def _of_system(error: RuntimeError) -> OSError:
    """The error of the system that OpenEXR tells of in words only."""
    known = (number for number in DISK_FULL if os.strerror(number) in str(error))
    number = next(known, errno.EIO)
    return OSError(number, os.strerror(number))
