"""The protocol for captured smoke: any number of cameras, as calibrated and registered, with and without a gain."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from benchmarks.accuracy.scenes import REAL_FRAMES, REAL_SIZE, captured_scene
from benchmarks.accuracy.score import best_gain
from smokelift import Camera, ClipSource, Domain, Scene
from smokelift.output.images import write_image

WIDTH, HEIGHT = 54, 96


@pytest.fixture(scope="module")
def capture(tmp_path_factory) -> Path:
    """The folder of a capture with two further cameras at one place: 00 as bright as the input, 05 half so."""
    folder = tmp_path_factory.mktemp("capture")
    picture = np.zeros((HEIGHT, WIDTH, 3), np.float32)
    picture[40:60, 20:34] = 0.4
    picture[10, 10] = 0.01  # not quite half as bright in 8 bits
    for name, brightness in (("input", 1.0), ("dim", 0.5)):
        for frame in range(REAL_FRAMES[-1] + 1):
            write_image(folder / f"{name}_{frame:04d}.png", np.float32(brightness) * picture)
    scene = Scene(
        ClipSource(folder / "input_####.png", fps=60.0),
        camera=Camera.look_at((0, -5, 0), (0, 0, 0), fov_y_degrees=30, size=(WIDTH, HEIGHT)),
        domain=Domain((-1, -1, -1), (1, 1, 1), (8, 8, 8)),
    )
    scene.save(folder / "scene.toml")
    turned = Camera.look_at((5, 0, 0), (0, 0, 0), fov_y_degrees=30, size=(WIDTH, HEIGHT))
    replace(scene, camera=turned).save(folder / "camera00.toml")
    replace(scene, camera=turned, clip=ClipSource(folder / "dim_####.png", fps=60.0)).save(folder / "camera05.toml")
    return folder


def test_every_camera_of_the_folder_is_scored_and_only_registered_ones_are_moved(capture):
    calibrated, registered = (captured_scene(capture, registered=moved) for moved in (False, True))
    assert list(calibrated.cameras) == ["input", "camera00", "camera05"]
    assert list(registered.cameras) == ["input", "camera00"]  # nobody has registered camera 05
    assert calibrated.name != registered.name and calibrated.scored == range(10, 111, 10)
    before, after = (scene.seen("camera00", 10)[..., 0] for scene in (calibrated, registered))
    assert before.shape == REAL_SIZE[::-1]
    places = np.argwhere(after > 0.2).mean(0) - np.argwhere(before > 0.2).mean(0)
    np.testing.assert_allclose(places, (-5, 5), atol=0.5)  # a pixel of 96 rows up, one to the right
    np.testing.assert_array_equal(calibrated.seen("input", 10), registered.seen("input", 10))


def test_the_gain_is_that_of_the_exposure():
    picture = np.random.default_rng(0).random((11, 12, 3)).astype(np.float32)
    assert best_gain([picture], [np.float32(0.5) * picture]) == pytest.approx(0.5, rel=0.01)
    assert best_gain([0 * picture], [picture]) == 1
