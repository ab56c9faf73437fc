"""Where a frame shows smoke: its deviation from the background, in units of the clip's noise.

A patch is smoke if noise makes so large and so strong a one too rarely: `FALSE_ALARMS` are expected in a picture of any
size (Desolneux, Moisan and Morel, "Meaningful alignments", 2000). So a wide veil may be hardly above the noise, while a
speck must be far above it. Noise that a whole patch shares does not become rarer with its size: the likeliest shift is
taken off first, at the price of its own probability. Within a patch, the more a pixel deviates, the more certain it is.
Figures: docs/experiments/background.md, docs/experiments/density-profile.md.
"""

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from scipy import ndimage, special

from smokelift.extraction.plate import Plate
from smokelift.footage.images import Picture, blurred, channel_mean, linear_to_srgb
from smokelift.footage.noise import Noise

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
    """Return the probability (rows, columns) that a pixel shows smoke, by its deviation in units of noise.

    It is 0 but in patches above `MIN_DEVIATION` that noise makes too rarely. ``width`` is the standard deviation, in
    pixels, of the Gaussian that smoothed the deviation. ``shared`` is that of noise that a patch of any size shares, in
    the deviation's units. The probability of a patch of noise is the product of its samples' probabilities to deviate
    as far, and of that of the shift by shared noise that makes it largest.
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
