"""Reconstruct a take, and compare what comes out with what is known."""

from dataclasses import replace

import numpy as np

from benchmarks.background.clips import filmed
from benchmarks.disturbances.known import FRONT, GRID, Known, Take
from smokelift import Reconstruction, Settings, prepare_shot
from smokelift.evaluation.frame_means import SMOKE_SHARE, eight_bit_values, finite_mean
from smokelift.evaluation.metrics import psnr, velocity_error, volume_error
from smokelift.evaluation.truth import resampled
from smokelift.pipeline import Frame, compose
from smokelift.render import scene_renderer
from smokelift.scene import CompleteScene
from smokelift.setup.settings import MethodName
from smokelift.transport import Array

Figures = dict[str, float | str | None]


_done: dict[tuple[object, ...], Figures] = {}


def whole_run(take: Take, method: MethodName) -> Figures:
    """Reconstruct a take and return its figures; with a refusal the sentence alone.

    Many disturbances have the same take where they disturb nothing: it is reconstructed once a process.

    Returns
    -------
    ``psnr_VIEW`` and ``psnr_new``, the mean over the new views (dB); ``density_error`` and ``velocity_error``, both
    relative, and ``mass_ratio``, which are absent in another box than the scene's. All are means over the frames that
    count.
    """
    key = (take.known.name, take.pictures.tobytes(), take.given, take.gain, take.behind, take.scored, method)
    if key not in _done:
        _done[key] = _measured(take, method)
    return _done[key]


def _measured(take: Take, method: MethodName) -> Figures:
    settings = replace(Settings.preset(method=method), detail=0.0)
    clip = filmed(take.pictures, "clip")
    try:
        shot = prepare_shot(clip, take.given, settings)
        frames = list(Reconstruction(shot, compose(shot.settings)))
    except ValueError as error:
        return {"refused": str(error)}
    figures = _picture_figures(take, shot.scene, frames)
    box, true_box = shot.scene.domain, take.known.domain
    if np.allclose([*box.min, *box.max], [*true_box.min, *true_box.max]):
        figures |= _volume_figures(take, frames)
    return figures


def _picture_figures(take: Take, scene: CompleteScene, frames: list[Frame]) -> Figures:
    known, behind = take.known, np.full(3, take.behind, np.float32)
    found: Figures = {}
    for view, camera in known.cameras.items():
        renderer = scene_renderer(scene, camera, np.float32(take.gain) * behind)
        values = []
        for k in range(take.scored, len(frames)):
            shown = renderer.image(frames[k].density)[..., :1] / take.gain
            seen = known.radiance[view][k] + known.transmittance[view][k] * take.behind
            values.append(psnr(eight_bit_values(shown), eight_bit_values(seen[..., None])))
        found[f"psnr_{view}"] = finite_mean(values)
    found["psnr_new"] = finite_mean(float(found[f"psnr_{view}"] or np.nan) for view in known.cameras if view != FRONT)
    return found


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
        At the centres of the small grid's voxels (m/s).
    """
    density, true = known.density(moment), known.velocities[moment]
    counted = (density > SMOKE_SHARE * density.max()) & ~known.inlets[moment]
    if not counted.any() or not np.isfinite(true).all():
        return None
    return velocity_error(velocity, true, counted)[0]
