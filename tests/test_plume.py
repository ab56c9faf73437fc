"""The small plume of the tests is the example."""

from dataclasses import replace
from pathlib import Path

from smokelift.scene import Scene

SMALL = Path(__file__).parent / "plume"
EXAMPLE = SMALL.parents[1] / "examples" / "plume"


def test_the_scene_is_the_examples_but_for_its_size() -> None:
    small, example = (Scene.load(folder / "scene.toml") for folder in (SMALL, EXAMPLE))
    assert small.camera == example.camera.resized(256, 384)
    files = {"clip": example.clip, "background": example.background}
    assert replace(small, camera=example.camera, **files) == example
