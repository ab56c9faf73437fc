"""What a camera sees of a density: from where, and before which background."""

from dataclasses import replace

import numpy as np

from smokelift.footage.images import area_average
from smokelift.output.images import write_image
from smokelift.output.sequence import Viewer
from smokelift.render import render
from smokelift.scene import Background, completed, orbit


def test_the_front_is_the_scenes_own_view(plume) -> None:
    image = Viewer(completed(plume.scene)).image(3, plume.densities[2])
    np.testing.assert_allclose(image, render(plume.densities[2], plume.scene), atol=1e-6)


def test_a_clean_plate_stands_behind_what_the_camera_itself_shows(plume, tmp_path) -> None:
    plate = np.zeros((56, 40, 3), np.float32)
    plate[:, :20] = 0.5
    write_image(tmp_path / "plate.exr", plate)
    scene = completed(replace(plume.scene, background=Background(image=tmp_path / "plate.exr")))
    nothing = np.zeros_like(plume.densities[0])
    part = scene.camera.cropped(10, 8, 30, 40).resized(15, 20)
    for camera, expected in (
        (None, plate),
        (scene.camera.resized(20, 28), area_average(plate, 20, 28)),
        (part, area_average(plate[8:48, 10:40], 15, 20)),
        (scene.camera.cropped(-10, 0, 40, 56), 0.25),
        (orbit(scene.camera, scene.domain, 45), 0.25),
    ):
        viewer = Viewer(scene, camera)
        np.testing.assert_allclose(viewer.image(1, nothing) - expected, 0, atol=1e-3)
        np.testing.assert_allclose(viewer.background(1) - expected, 0, atol=1e-3)


def test_a_moving_camera_is_followed(plume, tracked, tmp_path) -> None:
    scene = replace(tracked, background=Background(image=tmp_path / "plate_#.exr"))
    for n in range(5):
        write_image(tmp_path / f"plate_{n}.exr", np.full((56, 40, 3), 0.1 * n, np.float32))
    scene = completed(scene)
    front, turned = Viewer(scene), Viewer(scene, orbit(scene.camera, scene.domain, 30))
    for number in (1, 4, 2):
        density, camera = plume.densities[number - 1], tracked.camera.at(number - 1)
        before = replace(tracked, background=Background(color=[0.1 * (number - 1)] * 3))
        np.testing.assert_allclose(front.image(number, density), render(density, before, camera), atol=1e-3)
        aside = orbit(camera, scene.domain, 30)
        np.testing.assert_allclose(turned.image(number, density), render(density, tracked, aside), atol=1e-3)


def test_a_flame_adds_its_light(plume) -> None:
    scene = completed(replace(plume.scene, medium=replace(plume.scene.medium, flame_color=(1.0, 0.5, 0.0))))
    flame = 4 * np.roll(plume.densities[2], -4, 2)
    dark, lit = (Viewer(scene).image(3, plume.densities[2], each) for each in (None, flame))
    red, green, blue = np.moveaxis(lit - dark, -1, 0)
    assert red.max() > 0.05 and not blue.any()
    np.testing.assert_allclose(green, red / 2, atol=1e-6)
    np.testing.assert_array_equal(Viewer(completed(plume.scene)).image(3, plume.densities[2], flame), dark)
