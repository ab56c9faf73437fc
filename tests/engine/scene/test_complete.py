"""A scene with nothing left open."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

from scene_examples import GOOD, load

from smokelift.scene import completed, scene_from_dict, scene_to_dict


def test_a_complete_scene_comes_back_as_it_was_written(tmp_path: Path) -> None:
    scene = completed(replace(load(tmp_path, GOOD), scattering="absorption"))
    assert completed(scene_from_dict(scene_to_dict(scene))) == scene
