"""What a density fit minimizes, on a moment's grid and on grids that are each half as fine.

    E(rho) = sum over terms, pixels of  w |L(rho) - I|^2,    0 <= rho <= bound,  rho = 0 outside the hull

A term is a picture I, of three channels or of an element's four, with the weight w of its pixels, which does not change
during a fit. There is one term per camera. Detail that a depth prior makes up (`Detail`) has none: before the fit, the
start is scaled in turn towards it and the cameras' pictures, and what these allow of it is left. A prior has no penalty
term. It acts through the voxels that may hold smoke, the start and, with it, the preconditioner of the descent.

Noise of standard deviation s leaves E = sum w s^2 at the true density. Below that a fit reproduces noise, so it stops
there (discrepancy principle: Morozov 1966). The figures that a fit reports are plain: unweighted, of the cameras alone.

On a pyramid (`Level`) detail of several voxels needs no single voxels: a grid half as fine takes an eighth of the work
and the memory. What changes there changes the finer density by the same factor, linear between the voxels' middles. So
the finer density keeps its own detail, and only the last octave is left to find on it.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

import smokelift._core as _core
from smokelift.checks import Array, Mask
from smokelift.density.observation import ObservedView, ViewSet
from smokelift.footage.images import area_average
from smokelift.render import Image, Renderer, Volume
from smokelift.scene.domain import box_around
from smokelift.transport import halved

MIN_INSIDE = 0.3
"""Lower bound of the fraction of a ray's smoke that is taken to lie inside the domain. With less, smoke that the prior
puts outside is missing in the picture; with more, density spikes grow at floor and ceiling
(docs/experiments/density-profile.md)."""

MIN_COARSENED_VOXELS = 1_000_000
"""Voxels that may hold smoke above which a grid has a coarser one (docs/experiments/clip-pixels.md)."""

TINY = np.finfo(np.float32).tiny
"""Smallest normal number, for divisions and logarithms."""

FAINT = 1e-3
"""Fraction of the largest density, or of the most smoke on a ray or a line, below which smoke is too faint for a ratio
to say anything of it."""

BLUR_REACH = 3.0
"""Reach of a blur in its standard deviations: 0.3 % of a Gaussian lie beyond."""

MIN_DEVIATION = 1.5
"""Smallest standard deviation of a blur in voxels of its own grid. Means of two voxels, and what is linear between
their middles, have a variance of 11/12 of a finer voxel. So a blur there is 5 % wider at most."""


@dataclass(frozen=True, eq=False)
class Term:
    """One picture that the density has to show.

    The renderer is of the view's camera, before the view's background. `weight` (rows, columns) is how much each pixel
    counts, from 0 to 1.
    """

    view: ObservedView
    renderer: Renderer
    weight: Array

    def loss(self, residual: Image) -> float:
        """The term's part of the objective, from L - I (rows, columns, channels)."""
        power = np.square(residual, dtype=np.float64)
        return float(np.sum(self.weight[..., None] * power))

    def image_gradient(self, residual: Image) -> Image:
        """Derivative of the term's part by the rendered picture (rows, columns, channels)."""
        return 2 * self.weight[..., None] * residual


def camera_terms(views: ViewSet, inside: Sequence[Array]) -> list[Term]:
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


@dataclass(frozen=True, eq=False)
class Level:
    """A pyramid level: a moment on one grid, whose voxels are each `coarseness` voxels of the finest grid wide.

    `inside_fraction` has a picture (rows, columns) for each view: the fraction of every ray's smoke that lies inside
    the domain. What involves the coarser level may be asked only where there is one.
    """

    views: ViewSet
    inside_fraction: tuple[Array, ...]
    coarseness: int = 1

    @cached_property
    def coarser(self) -> Level | None:
        """The level of a grid half as fine; None where the smoke has few voxels."""
        views = self.views
        if np.count_nonzero(views.hull) <= MIN_COARSENED_VOXELS:
            return None
        optics = replace(views.optics, domain=views.optics.domain.coarser(2))
        seen = tuple(view.coarser(optics) for view in views.views)
        inside = tuple(
            area_average(fraction, *view.camera.size) for fraction, view in zip(self.inside_fraction, seen, strict=True)
        )
        return Level(ViewSet(seen, any_of_two(views.hull), optics, views.frame), inside, 2 * self.coarseness)

    def terms(self) -> list[Term]:
        """Terms of the cameras' pictures; see `camera_terms`."""
        return camera_terms(self.views, self.inside_fraction)

    def from_coarser(self, values: Volume) -> Array:
        """Values of the coarser grid at this one's voxels (n,) that may hold smoke, linear between middles."""
        fine, coarse = self._boxes()
        return _core.prolong_values(values[coarse], self.views.hull[fine])

    def changed_on_coarser(self, density: Volume, change: Callable[[Volume], Volume]) -> Volume:
        """A density of this grid, changed as `change` changes its means on the coarser grid."""
        fine, coarse = self._boxes()
        means = self.coarse_means(density)
        after = change(means)
        result = np.zeros(density.shape, np.float32)
        _core.scale_alike(density[fine], self.views.hull[fine], means[coarse], after[coarse], float(TINY), result[fine])
        return result

    def coarse_means(self, density: Volume) -> Volume:
        """Means of a density of this grid on the coarser one."""
        fine, coarse = self._boxes()
        means = np.zeros(halved(self.views.optics.domain.resolution), np.float32)
        means[coarse] = _core.means_of_two(density[fine], self.views.hull[fine])
        return means

    def blurred(self, values: Volume, deviation: float) -> Array:
        """A volume blurred by a Gaussian of so many voxels, (n,) at those that may hold smoke.

        It fades where the smoke ends, so compare it only with another one that is blurred alike.
        """
        box = box_around(self.views.hull, round(BLUR_REACH * deviation))
        return _blurred(values[box], self.views.hull[box], deviation)

    @cached_property
    def _box(self) -> tuple[slice, slice, slice]:
        """The box around the smoke."""
        return box_around(self.views.hull, 0)

    def _boxes(self) -> tuple[tuple[slice, ...], tuple[slice, ...]]:
        """The box around the smoke on this grid and on the coarser one."""
        assert self.coarser is not None
        coarse, shape = self.coarser._box, self.views.hull.shape
        fine = tuple(
            slice(2 * span.start, min(2 * span.stop, count)) for span, count in zip(coarse, shape, strict=True)
        )
        return fine, coarse


def _blurred(values: Volume, marked: Mask, deviation: float) -> Array:
    """A volume blurred, (n,) at the marked voxels; on a grid that is as coarse as the blur allows."""
    if deviation < 2 * MIN_DEVIATION:
        return np.asarray(_core.blur(values, deviation, BLUR_REACH)[marked])
    coarse = any_of_two(marked)
    means = np.zeros(coarse.shape, np.float32)
    means[coarse] = _blurred(_core.means_of_two(values), coarse, deviation / 2)
    return _core.prolong_values(means, marked)


def any_of_two(voxels: Mask) -> Mask:
    """Whether any of two voxels along every axis is marked."""
    for axis in range(3):
        lead = (slice(None),) * axis
        second = voxels[(*lead, slice(1, None, 2))]
        voxels = voxels[(*lead, slice(0, None, 2))].copy()
        voxels[(*lead, slice(0, second.shape[axis]))] |= second
    return voxels


def with_neighbors(voxels: Mask) -> Mask:
    """Mark the six voxels beside each marked one too: a fast `ndimage.binary_dilation`."""
    result = voxels.copy()
    for axis in range(3):
        lead = (slice(None),) * axis
        low, high = (*lead, slice(None, -1)), (*lead, slice(1, None))
        result[high] |= voxels[low]
        result[low] |= voxels[high]
    return result
