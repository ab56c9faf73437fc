"""What every way of fitting a density to a picture comes back with."""

from __future__ import annotations

from dataclasses import dataclass

from smokelift.render.renderer import Volume


@dataclass(frozen=True, eq=False)
class Fit:
    """A density with its picture.

    Attributes
    ----------
    density : (nx, ny, nz)
    loss
        Sum of squared differences to the target over the smoke's pixels.
    iterations
    """

    density: Volume
    loss: float
    iterations: int
