"""Clips whose exposure changes, brought to that of their backgrounds."""

from __future__ import annotations

from collections.abc import Callable
from functools import lru_cache

from smokelift.footage.clip import Clip
from smokelift.footage.exposure import gain_of, small
from smokelift.footage.images import Picture
from smokelift.footage.plate import Plate, Plates


def steady(clip: Clip, plates: Plates) -> Clip:
    """Return a clip whose frames are all exposed as their backgrounds are.

    Parameters
    ----------
    clip
        The footage. It is read when the frames of the result are.
    plates
        Its backgrounds.
    """
    gains_of = exposures(plates)

    def balanced(number: int, picture: Picture) -> Picture:
        gains = gains_of(number, picture)
        return picture if (gains == 1).all() else picture / gains

    return clip.changed(balanced)


def exposures(plates: Plates) -> Callable[[int, Picture], Picture]:
    """Return what tells by how much a frame, given by number and picture, is brighter than its background, (3,)."""

    @lru_cache(maxsize=1)
    def still(plate: Plate) -> Picture:
        return small(plate.image)

    return lambda number, picture: gain_of(small(picture), still(plates.at(number)))
