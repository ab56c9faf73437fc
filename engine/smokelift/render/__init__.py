"""The differentiable renderer: a density and a scene in, an image out, and the exact derivative back.

``rays`` puts camera rays into the grid, ``light`` finds how much light reaches every voxel, ``view`` sums it up
along the rays, ``renderer`` ties them together, ``device`` runs them.
"""

from __future__ import annotations

import numpy as np

from smokelift import images
from smokelift.render.device import DeviceError, start
from smokelift.render.renderer import Image, Renderer, Scattering, Volume
from smokelift.scene import Camera, DirectionalLight, Domain, Light, Medium, Scene

__all__ = ["DeviceError", "Renderer", "render", "render_gradient", "start"]


def render(density: Volume, scene: Scene, camera: Camera | None = None, scattering: Scattering = "single") -> Image:
    """Render a density as a camera sees it (method section 1).

    Parameters
    ----------
    density : (nx, ny, nz)
        Density at voxel centres, >= 0.
    scene
        Needs a domain, and a camera unless one is given; at most one directional light. Without a background the
        smoke is seen before black.
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


def render_gradient(
    density: Volume,
    scene: Scene,
    target: Image,
    camera: Camera | None = None,
    scattering: Scattering = "single",
) -> tuple[float, Volume, Image]:
    """Squared difference between the rendered and a target image, with its derivative (method section 2).

    Parameters
    ----------
    density, scene, camera, scattering
        As in `render`.
    target : (rows, columns, 3)
        Linear radiance.

    Returns
    -------
    loss : float
        Sum over pixels and channels of (image - target)^2.
    gradient : (nx, ny, nz) float32
        dloss / ddensity: the exact derivative of the discrete image, shadows included.
    image : (rows, columns, 3) float32

    Raises
    ------
    ValueError
        As in `render`, or if the target is not finite or has another shape than the image.
    """
    renderer = scene_renderer(scene, camera, scattering)
    width, height = renderer.camera.size
    target = np.asarray(target, np.float32)
    if target.shape != (height, width, 3):
        raise ValueError(f"The target image must have the shape {(height, width, 3)}, not {target.shape}.")
    if not np.isfinite(target).all():
        raise ValueError("The target image holds values that are not finite.")
    image = renderer.image(_checked(density, scene), keep_record=True)
    difference = image - target
    loss = float(np.sum(np.square(difference, dtype=np.float64)))
    return loss, renderer.gradient(2 * difference), image


def scene_sun(lights: tuple[Light, ...]) -> DirectionalLight | None:
    """The one directional light of a scene, or None without lights.

    Raises
    ------
    ValueError
        If there are several lights, or one that is not directional.
    """
    if not lights:
        return None
    if len(lights) > 1 or not isinstance(lights[0], DirectionalLight):
        raise ValueError('This version renders one light of type "directional"; remove the others from the scene.')
    return lights[0]


def scene_background(scene: Scene, camera: Camera | None = None) -> Image:
    """Background radiance for a camera: (rows, columns, 3), or (3,) where it is one colour."""
    background = scene.background
    if background is None:
        return np.zeros(3, np.float32)
    if background.color is not None:
        return np.array(background.color, np.float32)
    if background.image is None:
        return np.zeros(3, np.float32)
    picture = images.read_image(background.image)
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
        If there is no camera or no domain, or for lights that are not rendered.
    """
    view = camera or scene.camera
    if view is None:
        raise ValueError("The scene has no camera; give one.")
    return Renderer(
        view,
        _domain(scene),
        scene.medium or Medium(),
        scene_sun(scene.lights),
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
