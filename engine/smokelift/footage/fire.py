"""Fire in smoke: pixels that shine by themselves, and a clip in which smoke stands in their place.

Smoke scatters light and does not shine. Without emission a flame is read as the densest smoke of all, and its light as
what lights the rest. Fire is far brighter than the smoke around it and has the colours of glowing soot, which part of
that smoke has not: coloured smoke has its colour everywhere. What a flame hides is unknown: the smoke beside it is
continued there. Figures: docs/experiments/fire.md.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
from scipy import ndimage

from smokelift.footage.clip import Clip
from smokelift.footage.images import Picture
from smokelift.footage.matte import matte
from smokelift.footage.plate import Plates

BRIGHT = 0.5
"""Linear red that fire adds to what is behind it, at least: exposed for its surroundings it is clipped or nearly so."""

WARM = 0.75
"""Green over red, and blue over green, of fire at most; a black body of 2700 K has 0.5 and 0.3 in linear BT.709."""

DARKER = 1 / 3
"""Brightness of smoke that has another colour over the fire's, at most."""

LEAST_FIRE, LEAST_SMOKE = 0.002, 0.1
"""Shares of the smoke's pixels that are fire, and that have another colour, at least: fire lights the smoke near it."""

FAINTEST = 0.01
"""Linear value of the largest channel of a pixel whose colour counts: 8 bits show no colour in darker ones."""

GLOW = 0.01
"""Width of the edge that still glows, as a share of the picture's longer side."""

Mask = npt.NDArray[np.bool_]


def fire_share(colours: Picture, behind: Picture) -> float:
    """Return the share of fire among smoke pixels; 0 where no smoke is of another colour and far darker.

    Parameters
    ----------
    colours, behind : (n, 3)
        Linear radiance of the pixels, and of the background there.
    """
    if not len(colours):
        return 0.0
    fire = _hot(colours, behind)
    brightest = colours.max(-1)
    other = ~_warm(colours) & (brightest > FAINTEST)
    if fire.mean() < LEAST_FIRE or other.mean() < LEAST_SMOKE:
        return 0.0
    smoke, flame = np.percentile(brightest[other], 95), np.median(brightest[fire])
    return float(fire.mean()) if smoke < DARKER * flame else 0.0


def without_fire(clip: Clip, plates: Plates) -> Clip:
    """Return a clip in whose frames the smoke beside fire is continued over it.

    Parameters
    ----------
    clip
        Exposed as its backgrounds are.
    plates
        Its backgrounds.
    """

    def doused(number: int, picture: Picture) -> Picture:
        plate = plates.at(number)
        smoke = matte(picture, plate).mask
        fire = _fire(picture, plate.image, smoke)
        if not fire.any():
            return picture
        beside = smoke & ~fire
        if not beside.any():
            return np.where(fire[..., None], plate.image, picture)
        rows, columns = ndimage.distance_transform_edt(~beside, return_distances=False, return_indices=True)
        return np.where(fire[..., None], picture[rows, columns], picture)

    return clip.changed(doused)


def _hot(colours: Picture, behind: Picture) -> Mask:
    """Where light of a fire's colour and strength is added."""
    return _warm(colours) & (colours[..., 0] - behind[..., 0] > BRIGHT)


def _warm(colours: Picture) -> Mask:
    red, green, blue = np.moveaxis(colours, -1, 0)
    return np.asarray((green < WARM * red) & (blue < WARM * green))


def _fire(picture: Picture, behind: Picture, smoke: Mask) -> Mask:
    """Fire with its glow, and with its core, which is clipped to yellow and white."""
    joined = smoke & (_warm(picture) | (picture[..., 0] - behind[..., 0] > BRIGHT))
    fire = ndimage.binary_propagation(_hot(picture, behind) & smoke, mask=joined)
    width = max(1, round(GLOW * max(picture.shape[:2])))
    return np.asarray(ndimage.binary_dilation(ndimage.binary_fill_holes(fire), iterations=width))
