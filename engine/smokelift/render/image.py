"""The picture of a scene: a density as a camera sees it, and how far it is from a target."""

from collections.abc import Sequence
from typing import overload

import numpy as np
import numpy.typing as npt

from smokelift.checks import densities, radiance, require_kind
from smokelift.extraction.given_background import background_picture
from smokelift.render.environment import sampled_lights
from smokelift.render.renderer import Image, Optics, Renderer, Volume
from smokelift.scene import Camera, CompleteScene, Scene, completed, require_scene

LARGEST_DEPTH = 1e20
"""Optical depth of a voxel, at most: that of a ray through thousands of them is still a number of 32 bits."""


def render(density: Volume, scene: Scene, camera: Camera | None = None) -> Image:
    """Render a density as a camera sees it, by the scene's scattering model.

    Parameters
    ----------
    density : (nx, ny, nz)
        Density at voxel centers, >= 0.
    scene
        Needs a domain, and a camera unless one is given. What else it leaves open takes the defaults of
        `smokelift.scene.completed`: single scattering, and black behind the smoke.
    camera
        Another camera than the scene's. The scene's background picture belongs to the scene's camera, so before
        another camera a picture is replaced by its mean color.

    Returns
    -------
    (rows, columns, 3) float32
        Linear radiance, row 0 at the top.

    Raises
    ------
    ValueError
        If the density is not finite, is negative or does not fit the domain, or if the scene lacks something.

    Examples
    --------
    >>> import numpy as np
    >>> from smokelift import Camera, DirectionalLight, Domain, Scene, render
    >>> scene = Scene(
    ...     camera=Camera.look_at((0.0, -3.0, 0.5), (0.0, 0.0, 0.5), fov_y_degrees=40, size=(32, 24)),
    ...     domain=Domain((-0.5, -0.5, 0.0), (0.5, 0.5, 1.0), (16, 16, 16)),
    ...     lights=(DirectionalLight(direction=(0.0, 0.6, -0.8), irradiance=(3.0, 3.0, 3.0)),),
    ... )
    >>> image = render(np.ones((16, 16, 16), np.float32), scene)
    >>> image.shape, image.dtype
    ((24, 32, 3), dtype('float32'))
    """
    renderer = _renderer(scene, camera)
    return renderer.image(_checked(density, renderer))


@overload
def render_gradient(
    density: Volume, scene: Scene, target: Image, camera: Camera | None = None
) -> tuple[float, Volume, Image]: ...
@overload
def render_gradient(
    density: Volume, scene: Scene, target: Sequence[Image], camera: Sequence[Camera]
) -> tuple[float, Volume, list[Image]]: ...
def render_gradient(
    density: Volume, scene: Scene, target: Image | Sequence[Image], camera: Camera | Sequence[Camera] | None = None
) -> tuple[float, Volume, Image | list[Image]]:
    """Squared difference between the rendered and a target image, with its exact derivative.

    Parameters
    ----------
    density, scene
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

    Examples
    --------
    >>> import numpy as np
    >>> from smokelift import Camera, Domain, Background, Scene, render_gradient
    >>> scene = Scene(
    ...     camera=Camera.look_at((0.0, -3.0, 0.5), (0.0, 0.0, 0.5), fov_y_degrees=40, size=(32, 24)),
    ...     domain=Domain((-0.5, -0.5, 0.0), (0.5, 0.5, 1.0), (16, 16, 16)),
    ...     background=Background(color=(1.0, 1.0, 1.0)),
    ... )
    >>> target = np.ones((24, 32, 3), np.float32)
    >>> loss, gradient, image = render_gradient(np.ones((16, 16, 16), np.float32), scene, target)
    >>> gradient.shape, image.shape, bool(gradient.max() > 0)  # less smoke is nearer to the clear target
    ((16, 16, 16), (24, 32, 3), True)
    """
    if camera is None or isinstance(camera, Camera):
        return _of_view(density, _renderer(scene, camera), target)
    require_kind(camera, Sequence, "camera", "a Camera, or a list of them")
    if len(camera) != len(target) or not camera:
        raise ValueError(f"There must be one target per camera, not {len(target)} for {len(camera)}.")
    views = [_of_view(density, _renderer(scene, view), goal) for view, goal in zip(camera, target, strict=True)]
    losses, gradients, images = zip(*views, strict=True)
    return sum(losses), sum(gradients[1:], gradients[0]), list(images)


def _renderer(scene: Scene, camera: Camera | None) -> Renderer:
    """The renderer of a camera; the scene's own, if it has one, still decides how an environment is sampled."""
    require_scene(scene)
    require_kind(camera, Camera | None, "camera", "a Camera")
    whole = completed(scene, scene.camera or camera)
    return scene_renderer(whole, camera, background_picture(scene, camera))


def _of_view(density: Volume, renderer: Renderer, target: npt.ArrayLike) -> tuple[float, Volume, Image]:
    width, height = renderer.camera.size
    wanted = radiance(target, "The target image")
    if wanted.shape != (height, width, 3):
        raise ValueError(f"The target image must have the shape {(height, width, 3)}, not {wanted.shape}.")
    if not np.isfinite(wanted).all():
        raise ValueError("The target image holds values that are not finite; clamp them first.")
    image = renderer.image(_checked(density, renderer), keep_record=True)
    difference = image - wanted
    loss = float(np.sum(np.square(difference, dtype=np.float64)))
    return loss, renderer.gradient(2 * difference), image


def _checked(density: Volume, renderer: Renderer) -> Volume:
    domain, extinction = renderer.optics.domain, renderer.optics.medium.extinction
    return densities(density, "The density", domain.resolution, LARGEST_DEPTH / (extinction * domain.voxel_size))


def scene_optics(scene: CompleteScene) -> Optics:
    """The optics of a scene; see `sampled_lights` for its lights."""
    return Optics(scene.domain, scene.medium, sampled_lights(scene), scene.scattering)


def scene_renderer(scene: CompleteScene, camera: Camera | None = None, background: Image | None = None) -> Renderer:
    """The renderer of a scene: by default for its own camera, before its own background; ValueError if it moves."""
    view = camera or scene.camera
    if view.moves:
        raise ValueError("The camera moves; give the one of a frame, camera.at(frame).")
    behind = background_picture(scene, view) if background is None else background
    return scene_optics(scene).renderer(view, behind)
