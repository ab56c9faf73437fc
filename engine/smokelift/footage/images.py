"""Arithmetic of linear pictures, float32 arrays [row, column, rgb], row 0 at the top; and what is unknown of them.

A picture of which a part is unknown is continued from what is known around it; how wrong that is can be measured on
what is known.
"""

from collections.abc import Iterator
from functools import lru_cache
from typing import TypeVar

import numpy as np
import numpy.typing as npt
import scipy.sparse
from scipy import ndimage

import smokelift._core as _core
from smokelift.checks import Mask

Picture = npt.NDArray[np.float32]

Value = TypeVar("Value", np.float32, np.uint16)

Number = TypeVar("Number", np.float32, np.float64)

Codes = npt.NDArray[np.uint8] | npt.NDArray[np.uint16]

LUMINANCE = np.array([0.2126, 0.7152, 0.0722])
"""Weights of linear red, green and blue (ITU-R BT.709)."""

LOOK_UPS = 2**16
"""Codes looked up at a time: their indices fit the cache."""

DETAIL = 4.0
"""Standard deviation, in pixels, of the Gaussian that keeps smoke and removes the finer detail of a background."""

ISLAND = 0.01
"""Fraction of the picture up to which a clear patch is taken for an accident."""

RELAXATIONS = 4
"""Times that unknown pixels become the mean of their neighbors at each level: behind smoke before a sky it is off by
.0015, without any by .0032, with 32 by .0011 (docs/experiments/hidden-plate.md)."""

NEIGHBORS = np.array([0.25, 0, 0.25], np.float32)
"""Weights of a pixel's neighbors along an axis in the mean over all four (by definition)."""

SPECK = 7
"""Pixels along the square whose majority decides for its middle pixel."""

SHIFTS = (-1 / 2, -1 / 3, -1 / 6, 1 / 6, 1 / 3, 1 / 2)
"""Shifts to the right, in picture widths, that lay the outline of the unknown on the known."""


def look_up(values: npt.NDArray[Value], codes: Codes) -> npt.NDArray[Value]:
    """Return ``values[codes]``, in the codes' shape.

    NumPy's indexing takes three times as long, and ends the process (NumPy 1.26) if it lacks memory for its buffers.
    """
    flat = codes.reshape(-1)
    found = np.empty(flat.shape, values.dtype)
    for start in range(0, flat.size, LOOK_UPS):
        part = slice(start, start + LOOK_UPS)
        values.take(flat[part], out=found[part], mode="clip")  # no code is outside, and "raise" copies the result
    return found.reshape(codes.shape)


def srgb_to_linear(encoded: npt.ArrayLike) -> Picture:
    """Decode sRGB values (1 is white) to linear ones by the exact piecewise curve, continued above 1."""
    e = np.asarray(encoded, np.float32)
    curve = ((np.maximum(e, np.float32(0.04)) + np.float32(0.055)) / np.float32(1.055)) ** np.float32(2.4)
    return np.asarray(np.where(e <= np.float32(0.04045), e / np.float32(12.92), curve))


def linear_to_srgb(linear: npt.ArrayLike) -> Picture:
    """Encode linear values as sRGB (1 is white) by the exact piecewise curve, continued above 1."""
    v = np.asarray(linear, np.float32)
    curve = np.float32(1.055) * np.maximum(v, np.float32(0.003)) ** np.float32(1 / 2.4) - np.float32(0.055)
    return np.asarray(np.where(v <= np.float32(0.0031308), v * np.float32(12.92), curve))


def reduced_size(width: int, height: int, side: float) -> tuple[int, int]:
    """Return the width and height of a picture whose longer side is reduced to ``side`` pixels at most."""
    scale = max(1.0, max(width, height) / side)
    return max(1, round(width / scale)), max(1, round(height / scale))


def area_average(image: npt.ArrayLike, width: int, height: int) -> Picture:
    """Resize a picture (rows, columns) or (rows, columns, channels): a new pixel is the mean of the area it covers.

    An axis that grows is interpolated linearly. ValueError is raised if a size is below 1.
    """
    if min(width, height) < 1:
        raise ValueError(f"a picture needs at least one pixel, not {width} x {height}")
    values = np.asarray(image, np.float32)
    rows, columns = values.shape[:2]
    if rows != height:
        values = (area_weights(rows, height) @ values.reshape(rows, -1)).reshape(height, *values.shape[1:])
    if columns != width:
        weights, shape = area_weights(columns, width), (height, width, *values.shape[2:])
        channels = values.reshape(height, columns, -1)
        values = _core.sum_columns(channels, weights.indptr, weights.indices, weights.data).reshape(shape)
    return np.ascontiguousarray(values)


def brightest_channel(values: npt.NDArray[Number]) -> npt.NDArray[Number]:
    """Return the largest of three values along the last axis; NumPy's ``max`` takes five times as long."""
    red, green, blue = np.moveaxis(values, -1, 0)
    return np.asarray(np.maximum(np.maximum(red, green), blue))


def channel_mean(values: Picture) -> Picture:
    """Return the mean of three values along the last axis; NumPy's ``mean`` takes much longer."""
    red, green, blue = np.moveaxis(values, -1, 0)
    return np.asarray((red + green + blue) / np.float32(3))


def blurred(picture: Picture, deviation: float) -> Picture:
    """Smooth a picture (rows, columns) or (rows, columns, channels) with a Gaussian; its deviation is in pixels.

    This is SciPy's ``gaussian_filter`` of float32, in a quarter of the time.
    """
    # the weights of a pixel and of its neighbors to one side, up to four standard deviations
    weights = np.exp(-0.5 / deviation**2 * np.arange(int(4.0 * deviation + 0.5) + 1) ** 2)
    whole = np.concatenate([weights[:0:-1], weights])
    channels = picture.reshape(*picture.shape[:2], -1)
    return _core.blur_picture(channels, weights / whole.sum()).reshape(picture.shape)


@lru_cache
def area_weights(old: int, new: int) -> scipy.sparse.csr_array:
    """Return the sparse (new, old) matrix whose rows weight the old pixels of each new one."""
    if new > old:
        position = np.clip((np.arange(new) + 0.5) * (old / new) - 0.5, 0.0, old - 1.0)
        low = np.minimum(position.astype(np.int64), max(old - 2, 0))
        weight = position - low
        rows = np.repeat(np.arange(new), 2)
        columns = np.stack([low, np.minimum(low + 1, old - 1)], axis=1).ravel()
        values = np.stack([1.0 - weight, weight], axis=1).ravel()
    else:
        # in units of 1 / (old new) of the picture all edges are whole numbers, so overlaps are exact
        reach = -(-old // new) + 1
        first = np.arange(new) * old // new
        columns = np.minimum(first[:, None] + np.arange(reach), old - 1)
        inside = first[:, None] + np.arange(reach) < old
        start, stop = np.arange(new)[:, None] * old, (np.arange(new)[:, None] + 1) * old
        overlap = np.minimum(stop, (columns + 1) * new) - np.maximum(start, columns * new)
        rows = np.repeat(np.arange(new), reach)
        values = (np.maximum(overlap, 0) * inside / old).ravel()
        columns = columns.ravel()
    return scipy.sparse.csr_array((values.astype(np.float32), (rows, columns)), shape=(new, old))


def push_pull(image: Picture, confidence: Picture) -> Picture:
    """Blend pixels of low confidence with the smooth continuation of their surroundings.

    The push-pull algorithm (Gortler et al., "The lumigraph", 1996) averages over ever larger blocks, weighted by
    confidence; each level keeps what it knows and takes the rest from the next coarser one, relaxed towards the means
    of its neighbors as a membrane is (Laplace's equation).
    """
    height, width = confidence.shape
    weight: Picture = confidence[..., None]
    if max(height, width) == 1 or float(confidence.min()) >= 1.0:
        return image
    small_size = ((width + 1) // 2, (height + 1) // 2)
    total = area_average(weight, *small_size)
    mean = area_average(image * weight, *small_size) / np.maximum(total, 1e-6)
    # a block counts as known if a quarter of it is: its mean is good enough
    coarse = push_pull(mean, np.minimum(4.0 * total[..., 0], 1.0))
    known, unknown = image * weight, np.float32(1.0) - weight
    blend: Picture = known + area_average(coarse, width, height) * unknown
    for _ in range(RELAXATIONS):
        around = ndimage.correlate1d(blend, NEIGHBORS, 0, mode="nearest")
        around += ndimage.correlate1d(blend, NEIGHBORS, 1, mode="nearest")
        blend = known + around * unknown
    return blend


def continuation_errors(image: Picture, known: Mask) -> Picture:
    """Return the covariance (3, 3) of the colors' errors where a linear picture is continued from what is known.

    They are measured on known pixels, which the shifted outline of the unknown leaves out. The mean error is not
    subtracted: it says nothing of that behind the smoke (docs/experiments/background.md). Zero if nothing is
    unknown, or too much to leave anything out.
    """
    total, count = np.zeros((3, 3)), 0
    for continued, left_out in left_out_parts(linear_to_srgb(image), known):
        error = (srgb_to_linear(continued) - image)[left_out].astype(np.float64)
        total += error.T @ error
        count += len(error)
    return (total / max(count, 1)).astype(np.float32)


def left_out_parts(image: Picture, known: Mask) -> Iterator[tuple[Picture, Mask]]:
    """Yield a picture continued where the shifted outline of the unknown lies on the known, and that part of it."""
    width, reach = known.shape[1], (known.shape[1] + 1) // 2
    unknown = np.pad(~known, ((0, 0), (reach, reach)))
    for shift in SHIFTS if unknown.any() else ():
        first = reach - round(shift * width)
        left_out = known & unknown[:, first : first + width]
        if left_out.mean() >= ISLAND:
            yield push_pull(image, (known & ~left_out).astype(np.float32)), left_out


def in_one_piece(known: Mask) -> Mask:
    """Remove specks, known ones and unknown ones: they are accidents of the samples."""
    down = ndimage.correlate1d(known.astype(np.uint8), np.ones(SPECK), 0)
    smooth = ndimage.correlate1d(down, np.ones(SPECK), 1) > SPECK**2 // 2
    islands, count = ndimage.label(smooth)
    large = np.bincount(islands.ravel(), minlength=count + 1) > ISLAND * known.size
    large[0] = False
    return np.asarray(large[islands])


def mostly_beside(grown: Mask, known: Mask) -> Mask:
    """Remove the patches that ``grown`` adds to what is known if more of their border is unknown than known."""
    patches, count = ndimage.label(grown & ~known, structure=np.ones((3, 3)))
    beside = np.zeros(count + 1)
    for along, across in ((patches, grown), (patches.T, grown.T)):
        for one, other in ((np.s_[:-1], np.s_[1:]), (np.s_[1:], np.s_[:-1])):
            border = (along[one] > 0) & (along[other] == 0)
            sides = np.where(across[other][border], 1, -1)
            beside += np.bincount(along[one][border], sides, count + 1)
    return np.asarray(grown & (beside >= 0)[patches])
