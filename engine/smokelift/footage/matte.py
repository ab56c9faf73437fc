"""Where a frame shows smoke: its deviation from the background, in units of the clip's noise.

How much the constants matter: docs/experiments/background.md.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from scipy import ndimage

from smokelift.footage.images import Picture, blurred, channel_mean, linear_to_srgb
from smokelift.footage.noise import Noise
from smokelift.footage.plate import Plate

SMOKE_THRESHOLD = 4.0
"""Deviation of a pixel that may be smoke, in units of noise. Twice as much is smoke for certain (hysteresis:
Canny, "A computational approach to edge detection", 1986)."""

CERTAIN_AREA = 1e-4
"""Share of the picture that has to be smoke for certain in a patch of smoke; less is an accident of the noise."""

SMOOTHING = 1.5
"""Standard deviation of the Gaussian that smooths the deviation, in pixels, at least."""

MAX_SMOOTHING = 4.0
"""Standard deviation of that Gaussian in noise, in pixels, at most: more hides the smoke's own shape."""

MIN_DEVIATION = 1.5
"""Deviation from which on a pixel around certain smoke counts as smoke, in units of noise; with twice as much it counts
fully (docs/experiments/faint-rim.md)."""

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
    mask : (rows, columns) bool
        Patches of a deviation above `SMOKE_THRESHOLD` in which `CERTAIN_AREA` of the picture exceeds twice as much.
    """

    deviation: Picture
    mask: npt.NDArray[np.bool_]

    @property
    def share(self) -> Picture:
        """How certain a pixel (rows, columns) shows smoke, from 0 to 1.

        It is 1 in the mask, and around it as much as the deviation is above `MIN_DEVIATION`.
        """
        share = np.clip(self.deviation / MIN_DEVIATION - 1, 0, 1)
        share[~_around_certain(self.deviation, MIN_DEVIATION)] = 0
        return np.asarray(share)


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
        raise ValueError(f"the frame {linear.shape} and the plate {plate.image.shape} must have one shape")
    if not np.isfinite(linear).all():
        raise ValueError("the frame must be finite")
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
    return Matte(deviation, _around_certain(deviation, SMOKE_THRESHOLD))


def _around_certain(deviation: Picture, threshold: float) -> npt.NDArray[np.bool_]:
    """Patches (rows, columns) of a deviation above a threshold that hold enough smoke that is certain."""
    patches, count = ndimage.label(deviation > threshold, structure=np.ones((3, 3)))
    certain = np.bincount(patches[deviation > 2.0 * SMOKE_THRESHOLD], minlength=count + 1)
    return np.asarray((certain > CERTAIN_AREA * patches.size)[patches])


def smoothing(noise: Noise) -> float:
    """Return the standard deviation in pixels of the Gaussian that leaves as much of white noise as lasts anyway."""
    even = float((noise.white / noise.lasting).max()) / np.sqrt(4 * np.pi)
    return float(np.clip(even, SMOOTHING, MAX_SMOOTHING))
