"""Clips whose exposure changes, brought to that of their backgrounds."""

from __future__ import annotations

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

    @lru_cache(maxsize=1)
    def still(plate: Plate) -> Picture:
        return small(plate.image)

    def balanced(number: int, picture: Picture) -> Picture:
        gains = gain_of(small(picture), still(plates.at(number)))
        return picture if (gains == 1).all() else picture / gains

    return clip.changed(balanced)
