"""What every way of fitting a density to pictures is given for each, and what it comes back with."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from smokelift.render.renderer import Image, Renderer, Volume


@dataclass(frozen=True, eq=False)
class Target:
    """A picture that the density has to show.

    Attributes
    ----------
    renderer
        Of the picture's camera.
    image : (rows, columns, 3)
        Linear radiance.
    weight : (rows, columns)
        How much each pixel counts, 0 to 1.
    """

    renderer: Renderer
    image: Image
    weight: NDArray[np.float32]


@dataclass(frozen=True, eq=False)
class Fit:
    """A density with its pictures.

    Attributes
    ----------
    density : (nx, ny, nz)
    losses
        Sum of squared differences to each target over the smoke's pixels.
    iterations
    """

    density: Volume
    losses: tuple[float, ...]
    iterations: int

    @property
    def loss(self) -> float:
        """Of all targets together."""
        return sum(self.losses)
