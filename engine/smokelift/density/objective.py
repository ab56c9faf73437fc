"""What a density fit minimises: one objective, the same for every optimiser, for the stop and for the figures.

    E(rho) = sum over terms, pixels, channels of  w (L(rho) - I)^2,    0 <= rho <= densest,  rho = 0 outside the hull

A term is a picture I with the weight w of its pixels. There is one for each camera; a depth prior may add pictures of
its own (soft observations), with weights that say how much they count. The prior's other part is the start, which the
preconditioned descent departs from as little as the pictures ask for.

Noise of standard deviation s leaves E = sum w s^2 at the true density. Below that a fit reproduces noise, so it stops
there (discrepancy principle: Morozov 1966).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from smokelift.density.observation import View
from smokelift.render import Image, Renderer, Volume


@dataclass(frozen=True, eq=False)
class Term:
    """One picture that the density has to show.

    Attributes
    ----------
    view
        The picture.
    renderer
        Of the view's camera, before the view's plate.
    weight : (rows, columns)
        How much each pixel counts, 0 to 1.
    """

    view: View
    renderer: Renderer
    weight: NDArray[np.float32]

    def loss(self, residual: Image) -> float:
        """The term's part of the objective, of L - I (rows, columns, 3)."""
        return float(np.sum(self.weight[..., None] * np.square(residual, dtype=np.float64)))

    def image_gradient(self, residual: Image) -> Image:
        """Derivative of the term's part by the rendered picture."""
        return 2 * self.weight[..., None] * residual

    def noise_floor(self) -> float:
        """What the picture's noise leaves of the objective at the true density."""
        return self.loss(self.view.noise)


@dataclass(frozen=True, eq=False)
class Fit:
    """A density that an optimiser found.

    Attributes
    ----------
    density : (nx, ny, nz)
    loss
        The objective.
    residuals : (rows, columns, 3), one a term
        What is left of the pictures, L - I.
    iterations
        Steps that were made.
    """

    density: Volume
    loss: float
    residuals: tuple[Image, ...]
    iterations: int


def objective(terms: Sequence[Term], residuals: Sequence[Image]) -> float:
    """E, of what is left of each term's picture."""
    return sum(term.loss(residual) for term, residual in zip(terms, residuals, strict=True))


def noise_floor(terms: Sequence[Term]) -> float:
    """What noise leaves of the objective at the true density: where a fit stops."""
    return sum(term.noise_floor() for term in terms)
