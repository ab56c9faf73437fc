"""The main job (algorithms 1 and 4): a clip in, one frame of density and velocity after the other out.

rho_1, rho_2 from their pictures alone; then for t = 3, 4, ...
    u~_t   = Project(advect(u_t-1, u_t-1))          prediction of the velocity
    rho~_t = advect(rho_t-1, u~_t)                  prediction of the density
    rho_t  = Reconstruction(picture_t, rho~_t)      correction by the renderer
    u_t    = VelRecon(rho_t-1, rho_t)               correction of the velocity
"""

from __future__ import annotations

import time
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from smokelift.baselines.velocity import PaperVelocity
from smokelift.density import Density, SmokeAxis, depth_guess, fit_density, gather_evidence, optical_depth
from smokelift.density.axis import estimate_axis
from smokelift.density.hull import project_voxels
from smokelift.density.initial import first_guess
from smokelift.density.light import refine_axis
from smokelift.footage.clip import Clip
from smokelift.output.writer import SequenceWriter
from smokelift.render.renderer import Image, Volume
from smokelift.scene import Domain, Scene, completed
from smokelift.setup.settings import Settings
from smokelift.setup.shot import Shot, prepare_shot
from smokelift.transport import Array, ResidualMeans, Velocity, advect
from smokelift.velocity import CoarseToFine, VelocityEstimator

AXIS_FRAMES = 16
"""Frames from which the place in depth is estimated."""

LIGHT_FRAMES = 4
"""Those of them whose light is looked at as well: it costs 200 pictures on a coarse grid for each."""


@dataclass(frozen=True, eq=False)
class Frame:
    """One reconstructed frame.

    Attributes
    ----------
    number
        1 for the clip's first frame.
    density : (nx, ny, nz) float32
    velocity
        In m/s, of the smoke that arrives in this frame (the first frame has the second's).
    figures
        Measures of the fit and seconds spent.
    """

    number: int
    density: Volume
    velocity: Velocity
    figures: Mapping[str, Any]


def reconstruct(
    clip: Clip,
    scene: Scene,
    settings: Settings | None = None,
    out: str | Path | None = None,
    *,
    npz: bool = False,
    resume: bool = False,
    shot: Shot | None = None,
) -> Iterator[Frame]:
    """Reconstruct a clip frame by frame.

    Parameters
    ----------
    clip
        The footage.
    scene
        Whatever is known of the shot; the rest is estimated (see `prepare_shot`).
    settings
        `Settings.preset` of a quality and a method; balanced by default.
    out
        Directory for the sequence; without it frames are only yielded.
    npz
        Write NumPy twins as well.
    resume
        Go on from the frames in ``out``. The frames that are there are not yielded again.
    shot
        The result of `prepare_shot`, if it has been computed already.

    Yields
    ------
    Frame
        In the clip's order, each already written when it is yielded.

    Raises
    ------
    ValueError
        For bad input (`SceneError`, `ClipError`, `SequenceError` are ValueErrors too).
    """
    settings = settings or Settings.preset()
    shot = shot or prepare_shot(clip, scene, settings)
    settings = replace(
        settings,
        density=replace(settings.density, scattering=shot.scattering),
        velocity=replace(
            settings.velocity,
            coarsening=shot.coarsening,
            levels=shot.levels,
        ),
    )
    if out is None:
        yield from _frames(clip, shot, settings, None)
        return
    with SequenceWriter(
        out,
        completed(replace(shot.scene, scattering=shot.scattering)),
        settings.as_dict(),
        npz=npz,
        resume=resume,
        background=shot.estimated_background,
        choices=[choice.as_dict() for choice in shot.choices],
    ) as writer:
        state = writer.state
        start = None
        if state is not None:
            assert shot.scene.domain is not None
            left = state.extra.get("unexplained_mean"), state.extra.get("unexplained_magnitude")
            residual = None if left[0] is None or left[1] is None else ResidualMeans(left[0], left[1])
            size, closed = shot.scene.domain.voxel_size, shot.scene.closed
            velocity = Velocity(state.velocity, size, closed, residual=residual)
            start = Frame(state.number, state.density, velocity, {})
        elif writer.finished:
            return
        for frame in _frames(clip, shot, settings, start):
            if frame.number not in writer.finished:
                writer.write(frame.number, frame.density, frame.velocity.faces, frame.figures, _memory(frame.velocity))
                yield frame


def _memory(velocity: Velocity) -> dict[str, Array]:
    """What the next estimate needs to know of a velocity beside the velocity itself."""
    if velocity.residual is None:
        return {}
    return {"unexplained_mean": velocity.residual.mean, "unexplained_magnitude": velocity.residual.magnitude}


def _frames(clip: Clip, shot: Shot, settings: Settings, start: Frame | None) -> Iterator[Frame]:
    """Frames after ``start``; the first is held back until the second gives it a velocity."""
    assert shot.scene.camera is not None and shot.scene.domain is not None
    domain = shot.scene.domain
    dt = 1.0 / clip.fps
    inflow = shot.scene.inflow()
    axis = smoke_axis(clip, shot, settings)
    estimator: VelocityEstimator = PaperVelocity() if settings.method == "paper" else CoarseToFine(settings.velocity)
    before = start
    for index in range(start.number if start else 0, len(clip)):
        began = time.perf_counter()
        now = shot.at(index)
        predicted = None
        initial = None
        # from where there was no smoke nothing is carried
        if before is not None and index >= 2 and before.density.any():
            predicted = estimator.predict(before.velocity, dt)
            # pictures correct the mass, but not of what a moving camera does not see
            initial = advect(before.density, predicted, dt, conserve=shot.scene.camera.moves)
        accepted: Mapping[str, float] = {}
        if now is None:
            density = _unseen(domain, initial)
        else:
            last = before.density if before is not None else None
            density, accepted = _corrected(clip.frame(index), now, settings, axis, initial, last)
        fitted = time.perf_counter()
        velocity = Velocity.zero(domain.resolution, domain.voxel_size, shot.scene.closed)
        if before is not None:
            velocity = estimator.estimate(
                before.density,
                density.values,
                dt,
                domain.voxel_size,
                closed=shot.scene.closed,
                inflow=inflow,
                prediction=predicted,
            )
        done = time.perf_counter()
        figures = {
            **density.figures,
            "mass": float(density.values.sum(dtype=np.float64)) * domain.voxel_size**3,
            "transport": dict(accepted),
            "velocity": dict(velocity.figures),
            "seconds_density": fitted - began,
            "seconds_velocity": done - fitted,
        }
        frame = Frame(index + 1, density.values, velocity, figures)
        if index == 1 and before is not None:
            yield replace(before, velocity=velocity)
        if index > 0 or len(clip) == 1:
            yield frame
        before = frame


def smoke_axis(clip: Clip, shot: Shot, settings: Settings) -> SmokeAxis:
    """Where in depth the smoke of a clip stands: as the settings say, or estimated from some frames."""
    scene = shot.small_scene
    assert scene.camera is not None and scene.domain is not None
    if settings.axis_depth is not None:
        return SmokeAxis.given(settings.axis_depth, scene.camera, scene.domain)
    if settings.method == "paper" or shot.plate_at is not None or shot.views:
        return SmokeAxis.upright()
    pictures = [shot.working.cut(clip.frame(number)) for number in clip.spread(AXIS_FRAMES)]
    amounts = [optical_depth(picture, scene, settings.density, shot.plate) for picture in pictures]
    axis = estimate_axis(amounts, scene.camera, scene.domain, scene.inlets)
    if scene.inlets or shot.scattering != "single":
        return axis
    looks = list(zip(pictures, amounts, strict=True))[:: AXIS_FRAMES // LIGHT_FRAMES]
    return refine_axis(axis, [look for look in looks if look[1].any()], scene, shot.plate)


def _corrected(
    picture: Image, shot: Shot, settings: Settings, axis: SmokeAxis, transported: Volume | None, before: Volume | None
) -> tuple[Density, Mapping[str, float]]:
    """The frame's density from its pictures and the density carried along, and what was taken over of that."""
    image, scene = shot.working.cut(picture), shot.small_scene
    seen = gather_evidence(image, scene, settings.density, shot.plate, axis, shot.beside)
    initial: Volume | None = transported
    accepted: Mapping[str, float] = {}
    if settings.method == "default" and transported is not None and before is not None:
        initial = depth_guess(seen, scene)
        if settings.transport > 0:
            guess = first_guess(
                image, scene, shot.plate, shot.scattering, initial, transported, before, settings.transport
            )
            initial, accepted = guess.density, guess.figures
    density = fit_density(seen, scene, initial, settings.density)
    assert shot.scene.camera is not None and scene.camera is not None and scene.domain is not None
    if transported is not None and shot.scene.camera.moves:
        # what a moving camera does not see now it may have seen before
        visible = project_voxels(scene.camera, scene.domain).visible
        density = replace(density, values=np.where(visible, density.values, transported))
    return density, accepted


def _unseen(domain: Domain, transported: Volume | None) -> Density:
    """The density of a frame whose picture shows nothing of the domain: what was carried along."""
    nothing = np.zeros(domain.resolution, np.float32)
    figures = {"loss": 0.0, "psnr": 0.0, "iterations": 0.0, "hull_share": 0.0}
    return Density(nothing if transported is None else transported, nothing > 0, figures)
