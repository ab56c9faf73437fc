"""How light travels through the smoke of a scene: all that a picture needs besides density, camera and background."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from smokelift.extraction.given_background import background_picture
from smokelift.render.environment import environment_count, environment_lights
from smokelift.render.renderer import Image, Renderer
from smokelift.scene import (
    Camera,
    CompleteScene,
    DirectionalLight,
    Domain,
    EnvironmentLight,
    FiniteLight,
    Medium,
    PointLight,
    Scattering,
)


@dataclass(frozen=True)
class Optics:
    """How light travels through the smoke of a domain.

    Attributes
    ----------
    domain, medium
        Where the smoke is, and what it does to light.
    lights
        Directional and point lights only; an environment is split into many.
    scattering
        ``"multiple"`` times, ``"single"`` with self-shadowing, ``"unshadowed"`` or ``"absorption"``.
    """

    domain: Domain
    medium: Medium
    lights: tuple[FiniteLight, ...]
    scattering: Scattering

    def renderer(self, camera: Camera, background: Image, support: NDArray[np.bool_] | None = None) -> Renderer:
        """The renderer of a camera before a background; see `Renderer` for the parameters."""
        return Renderer(camera, self.domain, self.medium, self.lights, background, self.scattering, support)

    def unshadowed_source(self) -> NDArray[np.float64]:
        """Source radiance (3,), W/m^2/sr, of isotropic smoke in the middle of the domain, with nothing before it.

        Light that is scattered many times raises it as it raises that of the surface of a half-space, on the mean over
        all directions of the light: 2 / (1 + sqrt(1 - albedo)), the mean of Chandrasekhar's H function (1950,
        Radiative Transfer, section 38).
        """
        total = np.zeros(3)
        for light in self.lights:
            if isinstance(light, PointLight):
                total += np.array(light.intensity) / np.sum((np.array(self.domain.centre) - light.position) ** 2)
            else:
                total += light.irradiance
        albedos = np.array(self.medium.albedos)
        orders = 2 / (1 + np.sqrt(1 - albedos)) if self.scattering == "multiple" else 1.0
        return np.asarray(orders * albedos / (4 * np.pi) * total)


def scene_optics(scene: CompleteScene) -> Optics:
    """The optics of a scene; see `sampled_lights` for its lights."""
    return Optics(scene.domain, scene.medium, sampled_lights(scene), scene.scattering)


def scene_renderer(scene: CompleteScene, camera: Camera | None = None, background: Image | None = None) -> Renderer:
    """The renderer of a scene: by default for its own camera, before its own background.

    Raises
    ------
    ValueError
        If the camera moves.
    """
    view = camera or scene.camera
    if view.moves:
        raise ValueError("The camera moves; give the one of a frame, camera.at(frame).")
    behind = background_picture(scene, view) if background is None else background
    return scene_optics(scene).renderer(view, behind)


def sampled_lights(scene: CompleteScene) -> tuple[FiniteLight, ...]:
    """The lights of a scene, in which an environment has become as many parallel lights as it needs.

    That number is found with the scene's own camera, where it is in the first frame. It is the same for every other
    camera and frame, so that a sequence is lit alike from all sides.
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
