"""How many directions stand for an environment: as many as change the picture of the clip's own smoke."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from smokelift.density import DensitySettings, FittedDensity, reconstruct_density
from smokelift.render import Image, Optics
from smokelift.render.environment_count import FEWEST, TOLERANCE, lights_needed
from smokelift.scene import CompleteScene, EnvironmentLight, FiniteLight
from smokelift.setup.choice import Choice
from smokelift.setup.coarse import CoarseFrame


def with_directions(scene: CompleteScene, count: int) -> CompleteScene:
    """The scene with so many directions for each environment that says none itself."""
    lights = tuple(
        replace(light, directions=count) if isinstance(light, EnvironmentLight) and light.directions is None else light
        for light in scene.lights
    )
    return replace(scene, lights=lights)


def choose_directions(
    scene: CompleteScene, frames: Sequence[CoarseFrame], settings: DensitySettings
) -> tuple[CompleteScene, tuple[Choice[int], ...]]:
    """Choose the number of directions of every environment by doubling.

    Parameters
    ----------
    scene
        Whose environments are looked at.
    frames
        Coarse frames; their light falls on the densities that are found in them without shadows, for which the fewest
        directions do, because only the sum of the light counts. The scene says how they scatter it.
    settings
        How to fit.

    Returns
    -------
    scene
        With a number for each environment.
    choices
        One for each.
    """
    if not any(isinstance(light, EnvironmentLight) for light in scene.lights):
        return scene, ()
    densities = [
        reconstruct_density(
            frame.picture,
            with_directions(frame.scattered_by("unshadowed").scene, FEWEST),
            settings=settings,
            plate=frame.plate,
        )
        for frame in frames
    ]
    scattering = [frame.scattered_by(scene.scattering) for frame in frames]
    lights, choices = [], []
    for light in scene.lights:
        if isinstance(light, EnvironmentLight):
            choice = _by_hand(light) or _measured(light, scattering, densities)
            light = replace(light, directions=choice.chosen)
            choices.append(choice)
        lights.append(light)
    return replace(scene, lights=tuple(lights)), tuple(choices)


def _by_hand(light: EnvironmentLight) -> Choice[int] | None:
    if light.directions is None:
        return None
    reason = f"Environment by hand: {light.directions} directions."
    return Choice("environment directions", light.directions, reason, by_hand=True)


def _measured(
    light: EnvironmentLight, frames: Sequence[CoarseFrame], densities: Sequence[FittedDensity]
) -> Choice[int]:
    def picture(lights: Sequence[FiniteLight]) -> Image:
        return _pictures(frames, densities, lights)

    count, change = lights_needed(light, picture)
    reason = f"Environment: {count} directions; the last doubling changed the picture by {change:.1%}."
    return Choice("environment directions", count, reason, {"change": change}, TOLERANCE)


def _pictures(
    frames: Sequence[CoarseFrame], densities: Sequence[FittedDensity], lights: Sequence[FiniteLight]
) -> Image:
    """What the light alone shows of the densities, before black, all pixels in a row."""
    shown = []
    for frame, fitted in zip(frames, densities, strict=True):
        scene = frame.scene
        optics = Optics(scene.domain, scene.medium, tuple(lights), scene.scattering)
        shown.append(optics.renderer(scene.camera, np.zeros(3, np.float32), fitted.hull).image(fitted.density).ravel())
    return np.concatenate(shown)
