"""Where a frame shows smoke, by its deviation from the background in units of the clip's noise, and where fire in it.

A patch is smoke if noise makes so large and so strong a one too rarely: `FALSE_ALARMS` are expected in a picture of any
size (Desolneux, Moisan and Morel, "Meaningful alignments", 2000). So a wide veil may be hardly above the noise, while a
speck must be far above it. Noise that a whole patch shares does not become rarer with its size: the likeliest shift is
taken off first, at the price of its own probability. Within a patch, the more a pixel deviates, the more certain it is.
Figures: docs/experiments/background.md, docs/experiments/density-profile.md.

Fire is brighter than light explains. Smoke reflects no more than white does, and colored smoke less. So a pixel with
the colors of glowing soot shines by itself if it is as bright as white, or far brighter than smoke of other colors in
the same light. Without emission, a flame would be read as the densest smoke of all, and its light as what lights the
rest. What a flame hides is unknown: the smoke beside it is continued there. Figures: docs/experiments/fire.md.
"""

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from scipy import ndimage, special

from smokelift.checks import Mask
from smokelift.extraction.plate import Plate
from smokelift.footage.clip import Clip
from smokelift.footage.images import Picture, blurred, brightest_channel, channel_mean, linear_to_srgb
from smokelift.footage.noise import Noise
from smokelift.scene.checks import Vector

FALSE_ALARMS = 0.01
"""Mean number of patches of noise in a picture that are taken for smoke (docs/experiments/density-profile.md)."""

PATCH_GROWTH = 4.06
"""Growth of the number of shapes of a patch with each sample of its area (lattice animals: Jensen and Guttmann,
"Statistics of lattice animals", 2000)."""

MIN_DEVIATION, FULL_DEVIATION = 1.5, 3.0
"""Deviations above which a pixel counts, and counts fully, in units of noise (docs/experiments/density-profile.md)."""

SHIFTS = np.linspace(0, 5, 11)
"""Shifts that are tried, in units of the noise that a patch shares: a larger one alone is a false alarm less often than
once in a million patches."""

MEASURED_DEVIATION = 4.0
"""Deviation, in units of noise, above which smoke is used to measure the box, the light and the color."""

SMOOTHING = 1.5
"""Smallest standard deviation, in pixels, of the Gaussian that smooths deviations."""

MAX_SMOOTHING = 4.0
"""Largest standard deviation, in pixels, of that Gaussian in noise: more would hide the smoke's shape."""

GLOBAL_DEVIATION = 2.0
"""Median deviation of a frame, in units of noise, up to which it is drift of the exposure or the codec, and not smoke
that fills the picture."""

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

PALE, FAINT = 0.9, 0.5
"""Largest green over red, and blue over green, of what may be fire, and the fraction of `MIN_FLAME_RED` and of
`MIN_BRIGHTNESS_RATIO` that it has at least: .003 to .03 of the smoke's pixels in seven faint, pale or small fires, at
most .0001 in twelve clips without fire (docs/experiments/fire.md)."""

MIN_COLORED_VALUE = 0.01
"""Linear value of a pixel's largest channel from which on its color counts: 8 bits show none in darker ones."""

GLOW = 0.01
"""Width of the edge that still glows, as a fraction of the picture's longer side."""

CLIPPED_VALUE = 0.95
"""Linear value from which on a channel may be clipped."""

COLOR_FRAMES = 8
"""Largest number of frames that the color of fire is taken from."""


@dataclass(frozen=True, eq=False)
class Matte:
    """Where a frame shows smoke, (rows, columns).

    ``deviation`` is that from the plate in units of noise, smoothed: about 1 or less without smoke.
    ``probability`` is that a pixel shows smoke.
    """

    deviation: Picture
    probability: Picture

    @property
    def mask(self) -> npt.NDArray[np.bool_]:
        """Pixels (rows, columns) that show smoke to measure on."""
        return np.asarray((self.deviation > MEASURED_DEVIATION) & (self.probability > 0))


def matte(frame: npt.ArrayLike, plate: Plate) -> Matte:
    """Find the smoke in a linear frame (rows, columns, 3) before a plate of the same size.

    ValueError is raised if the sizes differ or the frame is not finite.
    """
    linear = np.asarray(frame, np.float32)
    if linear.shape != plate.image.shape:
        raise ValueError(f"the frame has the shape {linear.shape}, its background {plate.image.shape}; they must agree")
    if not np.isfinite(linear).all():
        raise ValueError("the frame holds values that are not finite; clamp them first")
    width = smoothing(plate.noise)
    # a Gaussian lessens white noise as a mean over so many pixels does
    noise = plate.noise.averaged(4 * np.pi * width**2).total
    shown, behind = linear, plate.image
    if width > SMOOTHING:
        # much noise makes mean sRGB values too low; encoding a mean of light does not
        shown, behind = (blurred(light, SMOOTHING) for light in (shown, behind))
        width = float(np.sqrt(width**2 - SMOOTHING**2))
    difference = (linear_to_srgb(shown) - linear_to_srgb(behind)) / noise
    smooth = blurred(difference, width)
    deviation = np.sqrt(channel_mean(smooth**2))
    deviation /= np.clip(np.median(deviation), 1.0, GLOBAL_DEVIATION)
    return Matte(deviation, certainty(deviation, smoothing(plate.noise)))


def certainty(deviation: Picture, width: float, shared: Picture | float = 0.0) -> Picture:
    """Return how certainly a pixel shows smoke (rows, columns), by its deviation in units of noise.

    From 0 at `MIN_DEVIATION` to 1 at `FULL_DEVIATION`, and 0 in patches that noise makes often enough. ``width`` is the
    standard deviation, in pixels, of the Gaussian that smoothed the deviation. ``shared`` is that of noise that a patch
    of any size shares, in the deviation's units. The probability of a patch of noise is the product of its samples'
    probabilities to deviate as far, and of that of the shift by shared noise that makes it largest.
    """
    patches, count = ndimage.label(deviation > MIN_DEVIATION, structure=np.ones((3, 3)))
    inside, sample = patches > 0, 4 * np.pi * width**2
    beyond, step = deviation[inside], np.broadcast_to(np.float32(shared), deviation.shape)[inside]
    rare = np.ones(count + 1, np.bool_)
    for shift in SHIFTS if np.any(step) else SHIFTS[:1]:
        # that a normal value is as far from zero, to either side; what a shift explains is no shape of its own
        probability = np.minimum(np.log(2 * PATCH_GROWTH) + special.log_ndtr(np.float32(shift) * step - beyond), 0)
        surprise = -np.bincount(patches[inside], probability, count + 1) / sample
        surprise -= np.log(2) + special.log_ndtr(-shift)
        expected = np.log(max(deviation.size / sample, 1)) - surprise
        rare &= expected < np.log(FALSE_ALARMS)
    rare[0] = False
    certain = np.clip((deviation - MIN_DEVIATION) / (FULL_DEVIATION - MIN_DEVIATION), 0, 1)
    return np.where(rare[patches], certain, np.float32(0))


def smoothing(noise: Noise) -> float:
    """Return the standard deviation, in pixels, of the Gaussian that lessens white noise to the lasting part."""
    even = float((noise.white / noise.lasting).max()) / np.sqrt(4 * np.pi)
    return float(np.clip(even, SMOOTHING, MAX_SMOOTHING))


@dataclass(frozen=True)
class HotPixels:
    """Smoke pixels that have the colors of fire and add as much light.

    ``fraction`` is theirs of all smoke pixels, ``bright`` that of them which are brighter than light explains. Of all
    smoke pixels ``possible`` are these, and fainter and paler ones that add more such light than other smoke does.
    """

    fraction: float
    bright: float
    possible: float

    @property
    def burn(self) -> bool:
        """Whether they are fire."""
        return self.fraction > MIN_FIRE_FRACTION and self.bright >= MIN_BRIGHT_FRACTION

    @property
    def may_burn(self) -> bool:
        """Whether as many of them as fire has at least may be fire."""
        return self.possible > MIN_FIRE_FRACTION


def hot_pixels(colors: Picture, behind: Picture) -> HotPixels:
    """Return how much of the smoke may be fire.

    ``colors`` and ``behind`` are the linear radiance (n, 3) of the smoke's pixels and of their background.
    """
    if not len(colors):
        return HotPixels(0.0, 0.0, 0.0)
    warm, strong = _like_fire(colors, behind)
    fire = warm & strong
    added, brightest = brightest_channel(colors - behind), brightest_channel(colors)

    def outshines(warm: Mask, ratio: float) -> Mask:
        # a core clipped to yellow or white does not show its color
        other = ~warm & (brightest > MIN_COLORED_VALUE) & (brightest < CLIPPED_VALUE)
        enough = np.mean(other) >= MIN_SMOKE_FRACTION
        return added > ratio * np.percentile(added[other], 95) if enough else np.zeros_like(warm)

    bright = (colors[..., 0] > WHITE_RED) | outshines(warm, MIN_BRIGHTNESS_RATIO)
    pale = _warmer(colors, PALE)
    # what is reddest of it is its own light, not what shines through
    red, green, blue = np.moveaxis(colors - behind, -1, 0)
    own = (red > FAINT * MIN_FLAME_RED) & (np.maximum(green, blue) < PALE * red)
    possible = (fire & bright) | (pale & own & outshines(pale, FAINT * MIN_BRIGHTNESS_RATIO))
    of_fire = float(bright[fire].mean()) if fire.any() else 0.0
    return HotPixels(float(fire.mean()), of_fire, float(possible.mean()))


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
    return _warmer(colors, WARM), colors[..., 0] - behind[..., 0] > MIN_FLAME_RED


def _warmer(colors: Picture, limit: float) -> Mask:
    """Whether green over red, and blue over green, are less than a limit."""
    red, green, blue = np.moveaxis(colors, -1, 0)
    return np.asarray((green < limit * red) & (blue < limit * green))
