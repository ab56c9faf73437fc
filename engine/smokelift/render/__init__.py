"""The differentiable renderer: a density and a scene in, an image out, and the exact derivative back.

``setup`` puts camera rays (``rays``) and lights (``lights``) into the grid, ``device`` chooses between ``cpu`` and
``gpu``, which find how much light reaches every voxel and sum it up along the rays, ``renderer`` makes colours of it.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import lru_cache
from typing import overload

import numpy as np

from smokelift.footage import images
from smokelift.footage.plate import open_plates
from smokelift.render.device import DeviceError, start
from smokelift.render.environment import environment_count, environment_lights
from smokelift.render.lights import FiniteLight
from smokelift.render.renderer import Image, Renderer, Volume
from smokelift.scene import Camera, DirectionalLight, Domain, EnvironmentLight, Medium, Scattering, Scene

__all__ = ["DeviceError", "Renderer", "render", "render_gradient", "start"]


def render(density: Volume, scene: Scene, camera: Camera | None = None, scattering: Scattering = "single") -> Image:
    """Render a density as a camera sees it (method section 1).

    Parameters
    ----------
    density : (nx, ny, nz)
        Density at voxel centres, >= 0.
    scene
        Needs a domain, and a camera unless one is given. Without a background the smoke is seen before black.
    camera
        Another camera than the scene's. The scene's background picture belongs to the scene's camera, so before
        another camera a picture is replaced by its mean colour.
    scattering
        ``"single"`` with self-shadowing, ``"unshadowed"`` or ``"absorption"``: each cheaper than the one before.

    Returns
    -------
    (rows, columns, 3) float32
        Linear radiance, row 0 at the top.

    Raises
    ------
    ValueError
        If the density is not finite, is negative or does not fit the domain, or if the scene lacks something.
    """
    return scene_renderer(scene, camera, scattering).image(_checked(density, scene))


@overload
def render_gradient(
    density: Volume, scene: Scene, target: Image, camera: Camera | None = None, scattering: Scattering = "single"
) -> tuple[float, Volume, Image]: ...
@overload
def render_gradient(
    density: Volume,
    scene: Scene,
    target: Sequence[Image],
    camera: Sequence[Camera],
    scattering: Scattering = "single",
) -> tuple[float, Volume, list[Image]]: ...
def render_gradient(
    density: Volume,
    scene: Scene,
    target: Image | Sequence[Image],
    camera: Camera | Sequence[Camera] | None = None,
    scattering: Scattering = "single",
) -> tuple[float, Volume, Image | list[Image]]:
    """Squared difference between the rendered and a target image, with its derivative (method section 2).

    Parameters
    ----------
    density, scene, scattering
        As in `render`.
    target : (rows, columns, 3), or a sequence of such
        Linear radiance.
    camera
        As in `render`; or several cameras, with as many targets, whose losses are added up.

    Returns
    -------
    loss : float
        Sum over views, pixels and channels of (image - target)^2.
    gradient : (nx, ny, nz) float32
        dloss / ddensity: the exact derivative of the discrete images, shadows included.
    image : (rows, columns, 3) float32, or a list of such

    Raises
    ------
    ValueError
        As in `render`, if a target is not finite or has another shape than its image, or if there are not as many
        targets as cameras.
    """
    density = _checked(density, scene)
    if camera is None or isinstance(camera, Camera):
        return _view_gradient(density, scene, np.asarray(target, np.float32), camera, scattering)
    if len(camera) != len(target) or not camera:
        raise ValueError(f"There must be one target a camera, not {len(target)} for {len(camera)}.")
    loss, gradient, pictures = 0.0, np.zeros(density.shape, np.float32), []
    for view, goal in zip(camera, target, strict=True):
        part, slope, picture = _view_gradient(density, scene, np.asarray(goal, np.float32), view, scattering)
        loss += part
        gradient += slope
        pictures.append(picture)
    return loss, gradient, pictures


def _view_gradient(
    density: Volume, scene: Scene, target: Image, camera: Camera | None, scattering: Scattering
) -> tuple[float, Volume, Image]:
    renderer = scene_renderer(scene, camera, scattering)
    width, height = renderer.camera.size
    if target.shape != (height, width, 3):
        raise ValueError(f"The target image must have the shape {(height, width, 3)}, not {target.shape}.")
    if not np.isfinite(target).all():
        raise ValueError("The target image holds values that are not finite.")
    image = renderer.image(density, keep_record=True)
    difference = image - target
    loss = float(np.sum(np.square(difference, dtype=np.float64)))
    return loss, renderer.gradient(2 * difference), image


def scene_lights(scene: Scene, camera: Camera | None = None) -> tuple[FiniteLight, ...]:
    """The lights of a scene as the renderer takes them: an environment becomes as many parallel ones as it needs.

    Their number is found with the scene's own camera (where it is in the first frame), if it has one, and stays the
    same for other cameras: a sequence is lit alike from all sides.

    Raises
    ------
    ValueError
        If a scene with an environment lacks a camera or a domain.
    smokelift.footage.images.ImageError
        If an environment's picture cannot be read.
    """
    lights: list[FiniteLight] = []
    for light in scene.lights:
        if not isinstance(light, EnvironmentLight):
            lights.append(light)
            continue
        view = scene.camera or camera
        if view is None:
            raise ValueError("The scene has no camera; an environment light needs one to choose its directions.")
        lights += _environment(light, view.at(0), _domain(scene), scene.medium or Medium())
    return tuple(lights)


@lru_cache(maxsize=4)
def _environment(
    light: EnvironmentLight, camera: Camera, domain: Domain, medium: Medium
) -> tuple[DirectionalLight, ...]:
    return environment_lights(light, light.directions or environment_count(light, camera, domain, medium))


def scene_background(scene: Scene, camera: Camera | None = None) -> Image:
    """Background radiance for a camera: (rows, columns, 3), or (3,) where it is one colour.

    Of a clean plate that changes it is that of the first frame.
    """
    background = scene.background
    if background is None:
        return np.zeros(3, np.float32)
    if background.color is not None:
        return np.array(background.color, np.float32)
    if background.image is None:
        return np.zeros(3, np.float32)
    plates = open_plates(scene)
    if plates is None:
        picture = images.read_image(background.image)
    else:
        picture = plates.frame(scene.clip.first if scene.clip is not None else 0)
    if camera is not None and camera != scene.camera:
        return np.asarray(picture.reshape(-1, 3).mean(0))
    width, height = scene.camera.size if scene.camera else picture.shape[1::-1]
    return images.area_average(picture, width, height)


def scene_renderer(
    scene: Scene, camera: Camera | None, scattering: Scattering, background: Image | None = None
) -> Renderer:
    """The renderer of a scene, or of another camera, before its own background or another.

    Raises
    ------
    ValueError
        If there is no camera or no domain, or the camera moves.
    """
    view = camera or scene.camera
    if view is None:
        raise ValueError("The scene has no camera; give one.")
    if view.moves:
        raise ValueError("The camera moves; give the one of a frame, camera.at(frame).")
    return Renderer(
        view,
        _domain(scene),
        scene.medium or Medium(),
        scene_lights(scene, view),
        scene_background(scene, camera) if background is None else background,
        scattering,
    )


def _domain(scene: Scene) -> Domain:
    if scene.domain is None:
        raise ValueError("The scene has no domain; give its corners and its resolution.")
    return scene.domain


def _checked(density: Volume, scene: Scene) -> Volume:
    density = np.asarray(density, np.float32)
    if density.shape != _domain(scene).resolution:
        raise ValueError(
            f"The density has the shape {density.shape}, the domain {_domain(scene).resolution}; they must agree."
        )
    if not np.isfinite(density).all():
        raise ValueError("The density holds values that are not finite.")
    if density.min(initial=0.0) < 0:
        raise ValueError("The density holds negative values.")
    return density
