"""How much each combination of a pixel's colours counts where the background is uncertain.

A wall's light differs from place to place mostly along its own colour: what is continued behind smoke may be wrong by
much there, and hardly along the other combinations of the three, which still tell smoke from background. So what is
left of a picture, r, counts as generalised least squares would have it (Aitken 1936):

    n^2 r (n^2 + T^2 S)^-1 r

with S the covariance of the errors of what is continued, T the share of the light behind that passes, and n the error
without them: the camera's noise and the model's own. Before a background that is known every colour counts alike.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from smokelift.footage.plate import Plate, noise_at
from smokelift.render import Image

MODEL_ERROR = 0.15
"""Error of what the model of light makes of smoke, as a share of what smoke changes in the picture. With less, a wall
whose colours tell nothing loses mass; with more, those that tell are listened to less
(docs/experiments/disturbed-clips.md)."""

MIN_VARIANCE = 1e-12
"""Radiance squared: n^2 at least, for division."""


@dataclass(frozen=True, eq=False)
class ColourWeight:
    """The weight of each pixel's colours.

    Attributes
    ----------
    axes : (3, 3)
        The combinations, one a column, each of length 1 and perpendicular to the others.
    shares : (rows, columns, 3)
        How much each of them counts, from 0 to 1.
    """

    axes: NDArray[np.float32]
    shares: Image

    @staticmethod
    def of(image: Image, plate: Plate, optical_depth: NDArray[np.float32]) -> ColourWeight | None:
        """Return the weight of a picture's colours (rows, columns, 3); None where all of its background is certain.

        Parameters
        ----------
        image : (rows, columns, 3)
            Linear radiance.
        plate
            What is behind.
        optical_depth : (rows, columns)
            Of the smoke, as far as it is known.
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
        """How much each channel counts by itself, (rows, columns, 3): the matrices' diagonals."""
        return np.asarray(self.shares @ np.square(self.axes).T)
