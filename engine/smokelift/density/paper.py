"""Algorithm 3 as the paper has it: gradient descent with a fixed rate, the video used again as if from 90 degrees.

    rho <- max(0, rho - rate * densityGrad),   densityGrad = sum_views sum_pixels 2 (L - I) gradRec

Picture and record are the paper's own too (`smokelift.render.paper`). Two slips of the listing are mended (the sign
of the difference, which ascends as printed, and the missing rho >= 0); the fixed rate, the start from thin fog and the
imposed side view are the paper's. Its derivative is none voxel by voxel, so in thick smoke the loss falls at first and
then rises without bound, at any rate; hence one thing that the listing has not: the best density seen is kept.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from smokelift.density.fit import Fit
from smokelift.render.renderer import Image, Volume

if TYPE_CHECKING:
    from smokelift.render.paper import PaperRenderer


def fit_paper(
    renderers: Sequence[PaperRenderer],
    target: Image,
    density: Volume,
    thin: Volume,
    rate: float,
    minimum_loss: float,
    iterations: int,
) -> Fit:
    """Descend with a fixed rate until the loss is small enough or the iterations are used up.

    Parameters
    ----------
    renderers
        One for each view; the target is the same for all.
    target : (rows, columns, 3)
        Linear radiance.
    density : (nx, ny, nz)
        Start.
    thin : (nx, ny, nz)
        Thin fog, in which the rate is measured, so that it does not depend on the start.
    rate
        Change of density that one step makes in the steepest voxel of the thin fog.
    minimum_loss
        Mean squared difference, in units of the mean squared target, at which to stop.
    iterations
        At most so many.
    """
    _, slope = _loss_and_gradient(renderers, target, thin)
    factor = np.float32(rate / (float(np.abs(slope).max()) or 1.0))
    enough = minimum_loss * float(np.sum(np.square(target, dtype=np.float64))) * len(renderers)
    current = best = density
    loss, gradient = _loss_and_gradient(renderers, target, current)
    least = loss
    done = 0
    while done < iterations and loss > enough:
        current = np.maximum(current - factor * gradient, 0)
        loss, gradient = _loss_and_gradient(renderers, target, current)
        done += 1
        if loss < least:
            best, least = current, loss
    return Fit(best, least, done)


def _loss_and_gradient(renderers: Sequence[PaperRenderer], target: Image, density: Volume) -> tuple[float, Volume]:
    loss, gradient = 0.0, np.zeros_like(density)
    for renderer in renderers:
        difference = renderer.image(density) - target
        loss += float(np.sum(np.square(difference, dtype=np.float64)))
        gradient += renderer.gradient(2 * difference)
    return loss, gradient
