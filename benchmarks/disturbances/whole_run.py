"""Reconstruct a take, and compare what comes out with what is known."""

from collections.abc import Callable
from dataclasses import replace
from functools import partial

import numpy as np

from benchmarks.disturbances.known import GRID, Known, Take
from benchmarks.filming import filmed
from benchmarks.measure import Figures, reconstructed, view_figures
from smokelift import Settings
from smokelift.checks import Array
from smokelift.evaluation.metrics import velocity_error, volume_error
from smokelift.evaluation.truth import SMOKE_FRACTION, finite_mean, resampled
from smokelift.pipeline import Frame
from smokelift.render import Image
from smokelift.scene import CompleteScene
from smokelift.setup.settings import MethodName

_done: dict[tuple[object, ...], Figures] = {}


def whole_run(take: Take, method: MethodName) -> Figures:
    """Reconstruct a take and return its figures; with a refusal the sentence alone.

    Many disturbances have the same take where they disturb nothing: it is reconstructed once per process.

    Returns
    -------
    Those of `view_figures`; ``density_error`` and ``velocity_error``, both relative, and ``mass_ratio``, which are
    absent in another box than the scene's. All are means over the frames that count.
    """
    key = (take.known.name, take.pictures.tobytes(), take.given, take.gain, take.behind, take.scored, method)
    if key not in _done:
        _done[key] = reconstructed(filmed(take.pictures), take.given, smooth(method), partial(_figures, take))
    return _done[key]


def smooth(method: MethodName) -> Settings:
    """Return the settings of all runs: the usual quality without detail that is made up."""
    return replace(Settings.preset(method=method), detail=0.0)


def seen_in(take: Take) -> Callable[[str, int], Image]:
    """Return what gives the true picture of a view in a frame."""
    behind = np.full(3, take.behind, np.float32)
    return lambda view, frame: take.known.views[view].at(slice(frame, frame + 1)).before(behind)[0]


def _figures(take: Take, scene: CompleteScene, frames: list[Frame]) -> Figures:
    figures = view_figures(
        scene,
        lambda frame: frames[frame].density,
        take.known.cameras,
        seen_in(take),
        range(take.scored, len(frames)),
        np.full(3, take.behind, np.float32),
        take.gain,
    )
    box, true_box = scene.domain, take.known.domain
    if np.allclose([*box.min, *box.max], [*true_box.min, *true_box.max]):
        figures |= _volume_figures(take, frames)
    return figures


def _volume_figures(take: Take, frames: list[Frame]) -> Figures:
    known = take.known
    errors, masses, motions = [], [], []
    for k in range(take.scored, len(frames)):
        found, true = resampled(frames[k].density, GRID), known.density(k)
        if true.any():
            errors.append(volume_error(found, true))
            masses.append(float(found.sum() / true.sum()))
        if k > 0:
            motions.append(flow_error(known, k, resampled(frames[k].velocity.centres(), GRID)))
    return {
        "density_error": finite_mean(errors),
        "mass_ratio": finite_mean(masses),
        "velocity_error": finite_mean(motions),
    }


def flow_error(known: Known, moment: int, velocity: Array) -> float | None:
    """Return the relative error of a velocity in the smoke of a moment, without inlets; None where none is known.

    Parameters
    ----------
    known, moment
        What is compared with.
    velocity : (nx, ny, nz, 3)
        At the centers of the small grid's voxels (m/s).
    """
    density, true = known.density(moment), known.velocities[moment]
    compared = (density > SMOKE_FRACTION * density.max()) & ~known.inlets[moment]
    if not compared.any() or not np.isfinite(true).all():
        return None
    return velocity_error(velocity, true, compared)[0]
