"""Algorithm 3 as the paper has it: gradient descent with a fixed rate, the video used again as if from 90 degrees.

    rho <- max(0, rho - rate * densityGrad),   densityGrad = sum_views sum_pixels 2 (L - I) gradRec

Picture and record are the paper's own too (`smokelift.baselines.renderer`). Two slips of the listing are mended (the
sign of the difference, which ascends as printed, and the missing rho >= 0); the fixed rate, the start from thin fog
and the imposed side view, where no other is given, are the paper's. Its derivative is none voxel by voxel, so in thick
smoke the loss falls at first and then rises without bound, at any rate; hence one thing that the listing has not: the
best density seen is kept.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from smokelift.density.fit import Fit
from smokelift.render.renderer import Image, Volume

if TYPE_CHECKING:
    from smokelift.baselines.renderer import PaperRenderer


def fit_paper(
    renderers: Sequence[PaperRenderer],
    targets: Sequence[Image],
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
        One for each view.
    targets : (rows, columns, 3)
        What each should show, linear radiance.
    density : (nx, ny, nz)
        Start.
    thin : (nx, ny, nz)
        Thin fog, in which the rate is measured, so that it does not depend on the start.
    rate
        Change of density that one step makes in the steepest voxel of the thin fog.
    minimum_loss
        Mean squared difference, in units of the targets' mean square, at which to stop.
    iterations
        At most so many.
    """
    _, slope = _losses_and_gradient(renderers, targets, thin)
    factor = np.float32(rate / (float(np.abs(slope).max()) or 1.0))
    enough = minimum_loss * sum(float(np.sum(np.square(target, dtype=np.float64))) for target in targets)
    current = density
    losses, gradient = _losses_and_gradient(renderers, targets, current)
    best, done = Fit(current, losses, 0), 0
    while done < iterations and sum(losses) > enough:
        current = np.maximum(current - factor * gradient, 0)
        losses, gradient = _losses_and_gradient(renderers, targets, current)
        done += 1
        if sum(losses) < best.loss:
            best = Fit(current, losses, done)
    return Fit(best.density, best.losses, done)


def _losses_and_gradient(
    renderers: Sequence[PaperRenderer], targets: Sequence[Image], density: Volume
) -> tuple[tuple[float, ...], Volume]:
    losses, gradient = [], np.zeros_like(density)
    for renderer, target in zip(renderers, targets, strict=True):
        difference = renderer.image(density) - target
        losses.append(float(np.sum(np.square(difference, dtype=np.float64))))
        gradient += renderer.gradient(2 * difference)
    return tuple(losses), gradient
