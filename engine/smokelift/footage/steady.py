"""Clips brought to what their backgrounds are measured by: one exposure, and the brightness of light without noise."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace
from functools import lru_cache
from types import MappingProxyType

import numpy as np

from smokelift.footage.clip import Clip
from smokelift.footage.exposure import gain_of, small
from smokelift.footage.images import Picture, linear_to_srgb
from smokelift.footage.noise import EIGHT_BIT_STEP, Noise, linear_excess, linear_per_srgb
from smokelift.footage.plate import Plate, Plates

MIDDLE = np.full(3, 0.5, np.float32)
"""sRGB values at which it is judged whether noise brightens a clip."""

UNCOVERED = 5
"""Frames whose median is shown where a mask hides all of them."""


def steady(clip: Clip, plates: Plates, known: Mapping[int, Picture] = MappingProxyType({})) -> Clip:
    """Return a clip whose frames are all exposed as their backgrounds are; ``known`` are gains (3,) by frame."""
    gains_of = exposures(plates)

    def gains(number: int, shown: Callable[[], Picture]) -> Picture:
        return known[number] if number in known else gains_of(number, shown())

    def balanced(number: int, picture: Picture) -> Picture:
        return picture / gains(number, lambda: small(picture))

    return clip.changed(balanced, lambda number, tiny: bool((gains(number, tiny) == 1).all()))


def without_noise_light(clip: Clip, noise: Noise) -> Clip:
    """Return a clip without the light that its noise adds to means (`linear_excess`).

    A clip that is brightened by less than rounding to 8 bits may do is returned as it is. Before black too little is
    taken off: the noise is measured where there is no smoke, and there it is clipped.
    """
    if (linear_excess(MIDDLE, noise.total) <= 0.5 * EIGHT_BIT_STEP * linear_per_srgb(MIDDLE)).all():
        return clip

    def lessened(_: int, picture: Picture) -> Picture:
        return np.maximum(picture - linear_excess(linear_to_srgb(picture), noise.total), 0)

    return clip.changed(lessened)


def cleared(clip: Clip, plates: Plates) -> Clip:
    """Return a clip that shows its background, as it is exposed, wherever a mask hides a frame."""
    if clip.mask is None:
        return clip
    gains_of = exposures(plates)

    def change(number: int, picture: Picture) -> Picture:
        visible = clip.as_seen(number, picture)
        hidden = np.isnan(visible)
        return np.where(hidden, plates.at(number).image * gains_of(number, small(visible)), picture)

    return clip.changed(change)


def uncovered(plates: Plates, clip: Clip) -> Plates:
    """Return backgrounds that show what a clip shows where a mask hides all of it, if nothing else tells what is there.

    It is no smoke, so it may stand behind the result.
    """
    if clip.mask is None or not isinstance(plates, Plate):
        return plates
    numbers = clip.spread(UNCOVERED)
    hidden = plates.confidence == 0
    for number in numbers:
        seen = clip.seen(number, *clip.size)
        hidden = hidden if seen is None else hidden & ~seen
    filmed, gains_of = clip.as_filmed(), exposures(plates)
    shown = []
    for number in numbers:
        gains = gains_of(number, small(clip.as_seen(number, clip.frame(number))))
        shown.append(filmed.frame(number)[hidden] / gains)
    image = plates.image.copy()
    image[hidden] = np.median(shown, axis=0)
    return replace(plates, image=image)


def exposures(plates: Plates) -> Callable[[int, Picture], Picture]:
    """Return what tells by how much a frame, by number and `small` picture, is brighter than its background, (3,)."""

    @lru_cache(maxsize=1)
    def still(plate: Plate) -> Picture:
        return small(plate.image)

    return lambda number, picture: gain_of(picture, still(plates.at(number)))
