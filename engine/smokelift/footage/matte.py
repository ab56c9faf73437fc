"""Where a frame shows smoke: its deviation from the background, in units of the clip's noise.

A patch that deviates is smoke if noise makes so large and so strong a one too rarely: `FALSE_ALARMS` are expected in a
picture, whatever its size (Desolneux, Moisan and Morel, "Meaningful alignments", 2000). So a wide veil needs to be
hardly above the noise, and a speck has to be far above it. Within a patch, a pixel is as certain as it deviates.
Figures: docs/experiments/background.md, docs/experiments/faint-rim.md.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from scipy import ndimage, special

from smokelift.footage.images import Picture, blurred, channel_mean, linear_to_srgb
from smokelift.footage.noise import Noise
from smokelift.footage.plate import Plate

FALSE_ALARMS = 0.01
"""Number of patches of noise that are taken for smoke in a picture, on the mean."""

PATCH_GROWTH = 4.06
"""Factor by which the number of shapes of a patch grows with each sample of its area (lattice animals: Jensen and
Guttmann, "Statistics of lattice animals", 2000)."""

MIN_DEVIATION, FULL_DEVIATION = 1.5, 3.0
"""Deviations from which a pixel counts, and counts fully, in units of noise (docs/experiments/faint-rim.md)."""

MEASURED_DEVIATION = 4.0
"""Deviation from which on a pixel shows smoke that box, light and colour are measured on, in units of noise."""

SMOOTHING = 1.5
"""Standard deviation of the Gaussian that smooths the deviation, in pixels, at least."""

MAX_SMOOTHING = 4.0
"""Standard deviation of that Gaussian in noise, in pixels, at most: more hides the smoke's own shape."""

GLOBAL_DEVIATION = 2.0
"""Units of noise. A median deviation of a frame up to this is treated as drift of exposure or of the codec, not as
smoke that fills the picture."""


@dataclass(frozen=True, eq=False)
class Matte:
    """Where a frame shows smoke.

    Attributes
    ----------
    deviation : (rows, columns)
        From the plate, in units of noise, smoothed over two pixels. About 1 or less without smoke.
    share : (rows, columns)
        How certain a pixel shows smoke, from 0 to 1.
    """

    deviation: Picture
    share: Picture

    @property
    def mask(self) -> npt.NDArray[np.bool_]:
        """Pixels (rows, columns) that show smoke to measure on."""
        return np.asarray((self.deviation > MEASURED_DEVIATION) & (self.share > 0))


def matte(frame: npt.ArrayLike, plate: Plate) -> Matte:
    """Find the smoke in a frame.

    Parameters
    ----------
    frame : (rows, columns, 3)
        Linear.
    plate
        The background of the same size.

    Raises
    ------
    ValueError
        If the sizes differ or the frame is not finite.
    """
    linear = np.asarray(frame, np.float32)
    if linear.shape != plate.image.shape:
        raise ValueError(f"the frame has the shape {linear.shape}, its background {plate.image.shape}; they must agree")
    if not np.isfinite(linear).all():
        raise ValueError("the frame holds values that are not finite; clamp them first")
    width = smoothing(plate.noise)
    # as far as white noise goes, a Gaussian is a mean over so many pixels
    noise = plate.noise.averaged(4 * np.pi * width**2).total
    shown, behind = linear, plate.image
    if width > SMOOTHING:
        # in much noise the sRGB value of light is too low on the mean; that of a mean of light is not
        shown, behind = (blurred(light, SMOOTHING) for light in (shown, behind))
        width = float(np.sqrt(width**2 - SMOOTHING**2))
    difference = (linear_to_srgb(shown) - linear_to_srgb(behind)) / noise
    smooth = blurred(difference, width)
    deviation = np.sqrt(channel_mean(smooth**2))
    deviation /= np.clip(np.median(deviation), 1.0, GLOBAL_DEVIATION)
    share = np.clip((deviation - MIN_DEVIATION) / (FULL_DEVIATION - MIN_DEVIATION), 0, 1)
    share[~_meaningful(deviation, 4 * np.pi * smoothing(plate.noise) ** 2)] = 0
    return Matte(deviation, share)


def _meaningful(deviation: Picture, sample: float) -> npt.NDArray[np.bool_]:
    """Patches (rows, columns) of a deviation above `MIN_DEVIATION` that noise makes too rarely.

    ``sample`` is the number of pixels that noise has in common, so that a patch of noise is as likely as the product of
    its samples' probabilities, each to deviate as far.
    """
    patches, count = ndimage.label(deviation > MIN_DEVIATION, structure=np.ones((3, 3)))
    inside = patches > 0
    # of a normal value to be as far from zero, to either side
    probability = np.log(2 * PATCH_GROWTH) + special.log_ndtr(-deviation[inside])
    surprise = -np.bincount(patches[inside], probability, count + 1) / sample
    expected = np.log(max(deviation.size / sample, 1)) - surprise
    rare = expected < np.log(FALSE_ALARMS)
    rare[0] = False
    return np.asarray(rare[patches])


def smoothing(noise: Noise) -> float:
    """Return the standard deviation in pixels of the Gaussian that leaves as much of white noise as lasts anyway."""
    even = float((noise.white / noise.lasting).max()) / np.sqrt(4 * np.pi)
    return float(np.clip(even, SMOOTHING, MAX_SMOOTHING))
