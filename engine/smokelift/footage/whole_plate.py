"""The background to the last pixel, from whole frames where a small picture says that they are clear.

Which pixels show the background, and in which frames, is as smooth in the picture as smoke is, so that a proxy tells
it. What the background is there, the mean of whole frames tells where and when they are clear. Where they never are,
the small background is enlarged, and the detail of the mean is given its contrast back.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from smokelift.footage.behind_smoke import DETAIL_QUANTILE
from smokelift.footage.clear_picture import ClearPicture
from smokelift.footage.clip import Clip
from smokelift.footage.frame_source import Edges
from smokelift.footage.images import Picture, area_average, linear_to_srgb, srgb_to_linear
from smokelift.footage.proxy import Proxy

STEP = 2
"""Every so manieth frame is read whole: half of those that are examined."""

DETAIL_MARGIN = 16
"""Pixels of the proxy around what is unknown whose detail bounds that of the unknown."""


def whole_plate(clip: Clip, proxy: Proxy, gains: Picture, found: ClearPicture) -> Picture:
    """Return a linear background (rows, columns, 3) of full size.

    It is made of the frames of the clip's proxy, as they are exposed; each is brighter by its gain (3,) than the
    background that was found of the proxy.
    """
    if found.image.shape[1::-1] == clip.size:
        return found.image
    shown = (found.clear & found.known)[::STEP]
    known = shown.any(0)
    whole = _mean(clip, proxy.numbers[::STEP], gains[::STEP], np.where(known, shown, True))
    if known.all():
        return whole
    rows, columns = (np.flatnonzero(~known.all(axis)) for axis in (1, 0))
    (top, down), (left, right) = (
        (max(0, int(lines[0]) - DETAIL_MARGIN), min(n, int(lines[-1]) + 1 + DETAIL_MARGIN))
        for lines, n in ((rows, known.shape[0]), (columns, known.shape[1]))
    )
    small = np.s_[top:down, left:right]
    y, x = (_edges(*sizes) for sizes in zip(known.shape, clip.size[::-1], strict=True))
    part = np.s_[y[top] : y[down], x[left] : x[right]]
    size = x[right] - x[left], y[down] - y[top]
    mean = linear_to_srgb(whole[part])
    detail = mean - area_average(area_average(mean, right - left, down - top), *size)
    clearly = spread_out(known, clip.size)[part]
    most = np.quantile(np.abs(detail[clearly]), DETAIL_QUANTILE, axis=0) if clearly.any() else np.zeros(3, np.float32)
    detail = np.clip(detail * spread_out(found.contrast, clip.size)[part][..., None], -most, most)
    filled = srgb_to_linear(np.maximum(area_average(linear_to_srgb(found.image[small]), *size) + detail, 0))
    whole[part] = np.where(clearly[..., None], whole[part], filled)
    return whole


def spread_out(values: NDArray[Any], size: tuple[int, int]) -> NDArray[Any]:
    """Return values (rows, columns) of small pixels at those of a picture of a width and a height."""
    rows, columns = (np.diff(_edges(*sizes)) for sizes in zip(values.shape, size[::-1], strict=True))
    return np.repeat(np.repeat(values, rows, axis=0), columns, axis=1)


def _mean(clip: Clip, numbers: tuple[int, ...], gains: Picture, shown: NDArray[np.bool_]) -> Picture:
    """The linear mean of whole frames of a file over the times at which they are ``shown``, of pixels of the proxy."""
    file, width, height = clip.whole(), *clip.size
    down, across = (_edges(*each) for each in zip(shown.shape[1:], (height, width), strict=True))
    total = np.zeros((height, width, 3), np.float32)
    times = shown.sum(0, dtype=np.float32)[..., None]
    for number, gain, clear in zip(numbers, gains, shown, strict=True):
        file.stored(number).add_weighted(clear[..., None] / (gain * times), (down, across), total)
    return total


def _edges(count: int, pixels: int) -> Edges:
    """Where each of so many parts of a line of pixels begins, and the end of the last."""
    return np.asarray(-(-np.arange(count + 1) * pixels // count), np.int32)
