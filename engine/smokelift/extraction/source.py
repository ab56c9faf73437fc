"""The usual source radiance of a clip's smoke: the one place that says from which frames and cells it is found."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from smokelift.extraction.element import MODEL_ERROR, extract_element, usual_source
from smokelift.footage.clip import Clip
from smokelift.footage.images import Picture, area_average, blurred, channel_mean, reduced_size
from smokelift.footage.plate import Plate

SOURCE_FRAMES, SOURCE_SIDE = 4, 64
"""Frames, and cells along their longer side, from which the source radiance is found."""

LIT_PERCENTILE = 90
"""Percentile of what thick smoke sends that an assumed light has to reach: with 99 the transmittance of three composed
clips is off by .02 to .04 more, with 75 the picture of a real one loses 2 dB."""

HUE = 2 * MODEL_ERROR
"""Smallest difference of two colors of mean 1, root mean square, from which on they differ: both may be off by the
model's error. Skies differ from white by .2 to .3, a gray wall by .01."""


def clip_source(clip: Clip, plates: Plate, frames: Sequence[int]) -> Picture:
    """Return the usual source radiance (3,) of a clip's smoke before its plates, from the first of some frames.

    ``frames`` (one at least) have those with the most smoke first.
    """
    shown = [(clip.stored(frame).linear(), plates.at(frame)) for frame in sorted(frames[:SOURCE_FRAMES])]
    return usual_source(shown, reduced_size(*clip.size, SOURCE_SIDE))


def brightest_smoke(clip: Clip, plates: Plate, frame: int, source: Picture) -> float:
    """Return the radiance that the brightest thick smoke of a frame sends, S of its element; 0 without any.

    ``source`` (3,) is what `clip_source` returns. Smoke sends no more than its source radiance, so a light has to make
    that at least as bright.
    """
    picture = clip.stored(frame).linear()
    element = extract_element(picture, plates.at(frame), source, reduced_size(*clip.size, SOURCE_SIDE))
    sent = channel_mean(element.radiance)[element.transmittance < 0.5]
    return float(np.percentile(sent, LIT_PERCENTILE)) if sent.size else 0.0


def shows_transmittance(plate: Picture, source: Picture) -> bool:
    """Whether a plate (rows, columns, 3) shows how much of it smoke of a source radiance (3,) lets through.

    It has to have detail (`tells_source`), or another hue than the smoke: before a smooth gray wall white smoke that is
    thick and white smoke that is thin look alike, and the picture itself is the best that can be fitted.
    """
    own, other = (color / max(float(color.mean()), 1e-12) for color in (plate.mean((0, 1)), source))
    return tells_source(plate) or float(np.sqrt(np.square(own - other).mean())) > HUE


def tells_source(plate: Picture) -> bool:
    """Whether smoke before a plate (rows, columns, 3) shows its source radiance: detail of it has to show through.

    Its neighboring cells have to differ by more than the model's errors do: six walls and photographs by .10 to .35 of
    their mean, smooth skies by .001 and .03. Before these thin smoke in strong light looks like thick smoke.
    """
    rows, columns = plate.shape[:2]
    small = area_average(plate, *reduced_size(columns, rows, SOURCE_SIDE))
    detail = np.sqrt(np.square(small - blurred(small, 1.0)).mean())
    return bool(detail > MODEL_ERROR * small.mean())
