"""The small plume of the tests is the example."""

from dataclasses import replace
from pathlib import Path

import numpy as np

from smokelift.footage.clip import Clip
from smokelift.footage.image_files import read_image
from smokelift.footage.images import area_average
from smokelift.scene import Scene

SMALL = Path(__file__).parent / "plume"
EXAMPLE = SMALL.parents[1] / "examples" / "plume"


def test_the_scene_is_the_examples_but_for_its_size() -> None:
    small, example = (Scene.load(folder / "scene.toml") for folder in (SMALL, EXAMPLE))
    assert small.camera == example.camera.resized(256, 384)
    files = {"clip": example.clip, "background": example.background}
    assert replace(small, camera=example.camera, **files) == example


def test_every_frame_and_the_plate_are_the_examples() -> None:
    with Clip.open(SMALL / "clip.mp4") as small, Clip.open(EXAMPLE / "clip.mp4") as example:
        assert (len(small), small.fps) == (len(example), example.fps)
        for number in (0, 20, 47):
            wanted = area_average(example.frame(number), 256, 384)
            assert np.abs(small.frame(number) - wanted).mean() < 0.005
    wanted = area_average(read_image(EXAMPLE / "plate.png"), 256, 384)
    np.testing.assert_allclose(read_image(SMALL / "plate.png"), wanted, atol=0.01)
