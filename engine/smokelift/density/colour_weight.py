"""How much each combination of a pixel's colours counts where the background is uncertain.

A wall's light varies mostly along its own colour. So what is continued behind smoke may be wrong by much along that
colour, and hardly along the other combinations of the three, which still tell smoke from background. The residual r of
a picture counts as in generalised least squares (Aitken 1936):

    n^2 r (n^2 + T^2 S)^-1 r

with S the covariance of the continued background's errors, T the share of the light behind that passes, and n the error
without them: the camera's noise and the model's own. Before a background that is known every colour counts alike.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from smokelift.footage.plate import Plate, noise_at
from smokelift.render import Image

MODEL_ERROR = 0.15
"""Error of the model of light, as a share of what smoke changes in the picture. With less, a wall whose colours tell
nothing loses mass; with more, those that tell count too little (docs/experiments/disturbed-clips.md)."""

MIN_VARIANCE = 1e-12
"""Lower bound of n^2 (radiance squared), for division."""


@dataclass(frozen=True, eq=False)
class ColourWeight:
    """The weight of each pixel's colours.

    `axes` (3, 3) has the combinations as orthonormal columns. `shares` (rows, columns, 3) is how much each of them
    counts, from 0 to 1.
    """

    axes: NDArray[np.float32]
    shares: Image

    @staticmethod
    def of(image: Image, plate: Plate, optical_depth: NDArray[np.float32]) -> ColourWeight | None:
        """The weight of a picture's colours; None where all of its background is certain.

        The image (rows, columns, 3) is linear radiance. ``optical_depth`` (rows, columns) is the smoke's, as far as it
        is known.
        """
        unknown = 1 - plate.confidence
        if not (plate.errors.any() and unknown.any()):
            return None
        variances, axes = np.linalg.eigh(plate.errors.astype(np.float64))
        model = MODEL_ERROR * np.abs(image - plate.image).mean(-1)
        without = np.maximum(np.square(noise_at(image, plate)).mean(-1) + model**2, MIN_VARIANCE)
        passed = np.exp(-2 * optical_depth) * unknown / without
        shares = 1 / (1 + passed[..., None] * np.maximum(variances, 0))
        return ColourWeight(axes.astype(np.float32), shares.astype(np.float32))

    def weighted(self, colours: Image) -> Image:
        """Multiply colours (rows, columns, 3) by the weight's matrices."""
        return np.asarray(((colours @ self.axes) * self.shares) @ self.axes.T, np.float32)

    def of_channels(self) -> Image:
        """How much each channel counts by itself (rows, columns, 3): the diagonals of the matrices."""
        return np.asarray(self.shares @ np.square(self.axes).T)
