"""A scene's lights as simple ones: an environment becomes many, and the same ones for every camera and frame."""

from dataclasses import replace

from smokelift.render.light_sampling import sampled_lights
from smokelift.scene import Camera, DirectionalLight, Domain, PointLight, Scene, completed
from tests.engine.render.environments import sky

SUN = DirectionalLight((0.57, 0.45, -0.68), (3.0, 2.0, 1.0))
LAMP = PointLight((4.0, -3.0, 5.0), (60.0, 50.0, 40.0))
CAMERA = Camera.look_at((1.5, -3.0, 1.4), (0.0, 0.0, 0.7), fov_y_degrees=35, size=(64, 48))
SCENE = completed(Scene(camera=CAMERA, domain=Domain((-0.5, -0.5, 0.0), (0.5, 0.5, 1.0), (8, 8, 8))))


def test_simple_lights_stay_in_their_order() -> None:
    assert sampled_lights(replace(SCENE, lights=(SUN, LAMP))) == (SUN, LAMP)


def test_an_environment_becomes_parallel_lights_in_its_place(light_of) -> None:
    first, *between, last = sampled_lights(replace(SCENE, lights=(LAMP, light_of(sky(), directions=9), SUN)))
    assert (first, last, len(between)) == (LAMP, SUN, 9)
    assert all(isinstance(light, DirectionalLight) for light in between)


def test_lights_do_not_change_while_the_camera_moves(light_of) -> None:
    """Their number is chosen in the first frame."""
    away = Camera.look_at((0.0, -30.0, 1.0), (0.0, 0.0, 0.7), fov_y_degrees=35, size=(64, 48))
    scene = replace(SCENE, lights=(light_of(sky()),))
    moving = replace(scene, camera=replace(CAMERA, matrices=(CAMERA.matrix, away.matrix)))
    assert sampled_lights(moving) == sampled_lights(scene)
