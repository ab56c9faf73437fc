"""Fire in smoke: pixels that shine by themselves, and a clip with smoke in their place.

Fire is brighter than light explains. Smoke reflects no more than white does, and colored smoke less. So a pixel with
the colors of glowing soot shines by itself if it is as bright as white, or far brighter than smoke of other colors in
the same light. Without emission, a flame would be read as the densest smoke of all, and its light as what lights the
rest. What a flame hides is unknown: the smoke beside it is continued there. Figures: docs/experiments/fire.md.
"""

from dataclasses import dataclass

import numpy as np
from scipy import ndimage

from smokelift.checks import Mask
from smokelift.extraction.matte import matte
from smokelift.extraction.plate import Plate
from smokelift.footage.clip import Clip
from smokelift.footage.images import Picture, brightest_channel
from smokelift.scene.checks import Vector

MIN_FLAME_RED = 0.5
"""Smallest linear red that fire adds to its background: exposed for its surroundings, fire is clipped or nearly so."""

WARM = 0.75
"""Largest green over red, and blue over green, of fire; a black body of 2700 K has 0.5 and 0.3 in linear BT.709."""

WHITE_RED = 0.9
"""Linear red of a white surface, which reflects nine tenths, in an exposure that just holds it."""

MIN_BRIGHTNESS_RATIO = 3.0
"""Smallest ratio of what fire adds to the background to what other smoke adds: fire lights the smoke near it."""

MIN_FIRE_FRACTION, MIN_SMOKE_FRACTION = 0.0005, 0.1
"""Smallest fractions of smoke pixels that are fire, and that have another color."""

MIN_BRIGHT_FRACTION = 0.25
"""Smallest fraction of the fire that is so bright: six public clips of fire have .4 to .7, red smoke and red ink none
(docs/experiments/fire.md)."""

MIN_COLORED_VALUE = 0.01
"""Linear value of a pixel's largest channel from which on its color counts: 8 bits show none in darker ones."""

GLOW = 0.01
"""Width of the edge that still glows, as a fraction of the picture's longer side."""

CLIPPED_VALUE = 0.95
"""Linear value from which on a channel may be clipped."""

COLOR_FRAMES = 8
"""Largest number of frames that the color of fire is taken from."""


@dataclass(frozen=True)
class HotPixels:
    """Smoke pixels that have the colors of fire and add as much light.

    ``fraction`` is theirs of all smoke pixels, ``bright`` that of them which are brighter than light explains.
    """

    fraction: float
    bright: float

    @property
    def burn(self) -> bool:
        """Whether they are fire."""
        return self.fraction > MIN_FIRE_FRACTION and self.bright >= MIN_BRIGHT_FRACTION

    @property
    def may_burn(self) -> bool:
        """Whether some of them are brighter than light explains, as many as fire has at least."""
        return self.fraction * self.bright > MIN_FIRE_FRACTION


def hot_pixels(colors: Picture, behind: Picture) -> HotPixels:
    """Return how much of the smoke may be fire.

    ``colors`` and ``behind`` are the linear radiance (n, 3) of the smoke's pixels and of their background.
    """
    warm, strong = _like_fire(colors, behind)
    fire = warm & strong
    if not fire.any():
        return HotPixels(0.0, 0.0)
    added, brightest = brightest_channel(colors - behind), brightest_channel(colors)
    # a core clipped to yellow or white does not show its color
    other = ~warm & (brightest > MIN_COLORED_VALUE) & (brightest < CLIPPED_VALUE)
    bright = colors[..., 0] > WHITE_RED
    if other.mean() >= MIN_SMOKE_FRACTION:
        bright |= added > MIN_BRIGHTNESS_RATIO * np.percentile(added[other], 95)
    return HotPixels(float(fire.mean()), float(bright[fire].mean()))


def without_fire(clip: Clip, plate: Plate) -> Clip:
    """Return a clip with the smoke beside fire continued over it; the clip must be exposed as its plate is."""
    return clip.changed(lambda number, picture: _doused(picture, plate.at(number)))


def firelight(clip: Clip, doused: Clip) -> Clip:
    """Return a clip of the light that fire adds to one `without_fire`; clipped pixels show less than fire adds."""
    return clip.changed(lambda number, picture: np.maximum(picture - doused.frame(number), 0))


def fire_color(clip: Clip, light: Clip) -> Vector:
    """Return the color of a clip's `firelight`, the largest of red, green and blue 1; the light must not be all zero.

    It is the mean over pixels that are not clipped (over all if all are), weighted by the light's brightness, since
    smoke mistaken for fire is as bright everywhere.
    """
    whole, certain = np.zeros(3), np.zeros(3)
    for number in clip.spread(COLOR_FRAMES):
        picture, added = clip.frame(number), light.frame(number)
        weighted = added * added.max(-1, keepdims=True)
        whole += weighted.sum((0, 1), dtype=np.float64)
        certain += weighted[picture.max(-1) < CLIPPED_VALUE].sum(0, dtype=np.float64)
    total = certain if certain.any() else whole
    red, green, blue = map(float, (total / total.max()).round(3))
    return red, green, blue


def _doused(picture: Picture, plate: Plate) -> Picture:
    """A picture with the smoke beside fire, its glow and its core continued over it, or itself if it shows no fire."""
    smoke = matte(picture, plate).mask
    warm, strong = _like_fire(picture, plate.image)
    # the core is clipped to yellow and white
    fire = ndimage.binary_propagation(warm & strong & smoke, mask=(warm | strong) & smoke)
    if not fire.any():
        return picture
    width = max(1, round(GLOW * max(picture.shape[:2])))
    fire = ndimage.binary_dilation(ndimage.binary_fill_holes(fire), iterations=width)
    beside = smoke & ~fire
    if not beside.any():
        return np.where(fire[..., None], plate.image, picture)
    rows, columns = ndimage.distance_transform_edt(~beside, return_distances=False, return_indices=True)
    return np.where(fire[..., None], picture[rows, columns], picture)


def _like_fire(colors: Picture, behind: Picture) -> tuple[Mask, Mask]:
    """Whether light is of a fire's color, and whether it adds as much to what is ``behind`` it."""
    red, green, blue = np.moveaxis(colors, -1, 0)
    return (green < WARM * red) & (blue < WARM * green), red - behind[..., 0] > MIN_FLAME_RED
