"""What is assumed of the depth: how much smoke a picture shows, in the shadows that the smoke casts on itself."""

import numpy as np

from smokelift import Camera, DirectionalLight, Domain, Scene
from smokelift.density import GradientFit, Observation, RoundDepth, ViewSet
from smokelift.render import Image, Volume, render, scene_optics
from smokelift.scene import Medium, completed

SCENE = Scene(
    camera=Camera.look_at((0, -5, 0.5), (0, 0, 0.5), fov_y_degrees=14, size=(32, 32)),
    domain=Domain((-0.5, -0.5, 0), (0.5, 0.5, 1), (24, 24, 24)),
    medium=Medium(extinction=10, albedo=0.8),
    lights=(DirectionalLight((-0.9, 0.3, -0.3), (8, 8, 8)),),
)


def ball(thickness: float) -> Volume:
    """A ball that fades outwards, with an optical depth through its middle."""
    x, y, z = SCENE.domain.offsets(SCENE.domain.centre)
    density = np.exp(-(((x**2 + y**2 + z**2) / 0.08) ** 2)).astype(np.float32)
    column = density[12, :, 12].sum() * SCENE.domain.voxel_size * SCENE.medium.extinction
    return np.asarray(density * (thickness / column), np.float32)


def views_of(image: Image) -> ViewSet:
    return ViewSet.of([Observation(SCENE.camera, image)], scene_optics(completed(SCENE)))


def test_what_stands_in_the_shadow_of_the_rest_is_not_taken_for_thin() -> None:
    views = views_of(render(ball(4), SCENE))
    density = RoundDepth().estimate(views).density
    assert density[:12].sum() > 0.5 * density[12:].sum()  # of the half that faces the light


def test_thin_smoke_has_the_mass_that_its_picture_shows() -> None:
    true = ball(0.4)
    views = views_of(render(true, SCENE))
    fitted = GradientFit().fit(views, RoundDepth().estimate(views), None)
    assert abs(fitted.density.sum() / true.sum() - 1) < 0.1
