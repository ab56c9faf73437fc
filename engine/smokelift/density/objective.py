"""What a density fit minimizes: one objective for both of its optimizers and for where they stop.

    E(rho) = sum over terms, pixels of  w |L(rho) - I|^2,    0 <= rho <= bound,  rho = 0 outside the hull

A term is a picture I, of three channels or of an element's four, with the weight w of its pixels, which does not change
during a fit. There is one term per camera. Detail that a depth prior
makes up (`Detail`) has none: before the fit, the start is scaled in turn towards it and the cameras' pictures, and what
these allow of it is left. A prior has no penalty term. It acts through the voxels that may hold smoke, the start and,
with it, the preconditioner of the descent.

Noise of standard deviation s leaves E = sum w s^2 at the true density. Below that a fit reproduces
noise, so it stops there (discrepancy principle: Morozov 1966). The figures that a fit reports are plain: unweighted, of
the cameras alone.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from smokelift.density.observation import ObservedView, ViewSet
from smokelift.render import Image, Renderer, Volume

MIN_INSIDE = 0.3
"""Lower bound of the fraction of a ray's smoke that is taken to lie inside the domain. With less, smoke that the prior
puts outside is missing in the picture; with more, density spikes grow at floor and ceiling
(docs/experiments/density-profile.md)."""


@dataclass(frozen=True, eq=False)
class Term:
    """One picture that the density has to show.

    The renderer is of the view's camera, before the view's background. `weight` (rows, columns) is how much each pixel
    counts, from 0 to 1.
    """

    view: ObservedView
    renderer: Renderer
    weight: NDArray[np.float32]

    def loss(self, residual: Image) -> float:
        """The term's part of the objective, from L - I (rows, columns, channels)."""
        power = np.square(residual, dtype=np.float64)
        return float(np.sum(self.weight[..., None] * power))

    def image_gradient(self, residual: Image) -> Image:
        """Derivative of the term's part by the rendered picture (rows, columns, channels)."""
        return 2 * self.weight[..., None] * residual


def camera_terms(views: ViewSet, inside: Sequence[NDArray[np.float32]]) -> list[Term]:
    """A term for every camera's picture.

    Smoke outside the domain is not modelled. So a pixel counts by ``inside`` (one picture per view), the fraction of
    its ray's smoke that lies inside: the few voxels that the ray crosses on its way out need not hold all that it
    shows.
    """
    return [
        Term(view, renderer, view.influenced * np.maximum(fraction, MIN_INSIDE) ** 2)
        for view, renderer, fraction in zip(views.views, views.renderers, inside, strict=True)
    ]


@dataclass(frozen=True, eq=False)
class Fit:
    """A density (nx, ny, nz) that an optimizer found in so many iterations.

    `loss` is the objective. `residuals` are what is left of each term's picture (rows, columns, channels), L - I.
    """

    density: Volume
    loss: float
    residuals: tuple[Image, ...]
    iterations: int


def objective(terms: Sequence[Term], residuals: Sequence[Image]) -> float:
    """E, from what is left of each term's picture."""
    return sum(term.loss(residual) for term, residual in zip(terms, residuals, strict=True))


def noise_floor(terms: Sequence[Term]) -> float:
    """What noise leaves of the objective at the true density: where a fit stops."""
    return objective(terms, [term.view.noise_left for term in terms])
