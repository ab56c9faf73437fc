"""How many directions stand for an environment: as many as change the picture of the clip's own smoke."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from smokelift.density import Density, DensitySettings, reconstruct_density
from smokelift.render import Renderer
from smokelift.render.environment_count import FEWEST, TOLERANCE, lights_needed
from smokelift.render.renderer import Image
from smokelift.scene import EnvironmentLight, FiniteLight, Medium, Scattering, Scene
from smokelift.setup.choice import Choice
from smokelift.setup.coarse import CoarseFrame


def with_directions(scene: Scene, count: int) -> Scene:
    """The scene with so many directions for each environment that says none itself."""
    lights = tuple(
        replace(light, directions=count) if isinstance(light, EnvironmentLight) and light.directions is None else light
        for light in scene.lights
    )
    return replace(scene, lights=lights)


def choose_directions(
    scene: Scene, frames: Sequence[CoarseFrame], settings: DensitySettings, scattering: Scattering
) -> tuple[Scene, tuple[Choice, ...]]:
    """Choose the number of directions of every environment by doubling.

    Parameters
    ----------
    scene
        Whose environments are looked at.
    frames
        Coarse frames; their light falls on the densities that are found in them without shadows, for which the fewest
        directions do, because only the sum of the light counts.
    settings
        How to fit.
    scattering
        How light is scattered.

    Returns
    -------
    scene
        With a number for each environment.
    choices
        One for each.
    """
    if not any(isinstance(light, EnvironmentLight) for light in scene.lights):
        return scene, ()
    fit = replace(settings, scattering="unshadowed")
    densities = [
        reconstruct_density(frame.picture, with_directions(frame.scene, FEWEST), settings=fit, plate=frame.plate)
        for frame in frames
    ]
    lights, choices = [], []
    for light in scene.lights:
        if isinstance(light, EnvironmentLight):
            choice = _by_hand(light) or _measured(light, frames, densities, scattering)
            assert isinstance(choice.chosen, int)
            light = replace(light, directions=choice.chosen)
            choices.append(choice)
        lights.append(light)
    return replace(scene, lights=tuple(lights)), tuple(choices)


def _by_hand(light: EnvironmentLight) -> Choice | None:
    if light.directions is None:
        return None
    reason = f"Environment by hand: {light.directions} directions."
    return Choice("environment directions", light.directions, reason, by_hand=True)


def _measured(
    light: EnvironmentLight, frames: Sequence[CoarseFrame], densities: Sequence[Density], scattering: Scattering
) -> Choice:
    def picture(lights: Sequence[FiniteLight]) -> Image:
        return _pictures(frames, densities, lights, scattering)

    count, change = lights_needed(light, picture)
    reason = f"Environment: {count} directions; the last doubling changed the picture by {change:.1%}."
    return Choice("environment directions", count, reason, {"change": change}, TOLERANCE)


def _pictures(
    frames: Sequence[CoarseFrame],
    densities: Sequence[Density],
    lights: Sequence[FiniteLight],
    scattering: Scattering,
) -> Image:
    """What the light alone shows of the densities, before black, all pixels in a row."""
    shown = []
    for frame, density in zip(frames, densities, strict=True):
        camera, domain = frame.scene.camera, frame.scene.domain
        assert camera is not None and domain is not None
        medium = frame.scene.medium or Medium()
        renderer = Renderer(camera, domain, medium, lights, np.zeros(3, np.float32), scattering, density.hull)
        shown.append(renderer.image(density.values).ravel())
    return np.concatenate(shown)
