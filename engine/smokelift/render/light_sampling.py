"""A scene's lights as finitely many directional and point lights, each of which one sweep can do.

Lights give their own samples. Only an environment does not: how many it needs depends on what it lights.
"""

from __future__ import annotations

from functools import lru_cache

from smokelift.render.environment import environment_lights
from smokelift.render.environment_count import environment_count
from smokelift.scene import Camera, CompleteScene, DirectionalLight, Domain, EnvironmentLight, FiniteLight, Medium


def sampled_lights(scene: CompleteScene) -> tuple[FiniteLight, ...]:
    """The lights of a scene, in which an environment has become as many parallel lights as it needs.

    That number is found with the scene's own camera, where it is in the first frame. It is the same for every other
    camera and frame, so that a sequence is lit alike from all sides.

    Raises
    ------
    smokelift.footage.images.ImageError
        If an environment's picture cannot be read.
    """
    lights: list[FiniteLight] = []
    for light in scene.lights:
        if isinstance(light, EnvironmentLight):
            lights += _environment(light, scene.camera.at(0), scene.domain, scene.medium)
        else:
            lights += light.samples()
    return tuple(lights)


@lru_cache(maxsize=4)
def _environment(
    light: EnvironmentLight, camera: Camera, domain: Domain, medium: Medium
) -> tuple[DirectionalLight, ...]:
    return environment_lights(light, light.directions or environment_count(light, camera, domain, medium))
