"""A scene with nothing left open."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scene_examples import GOOD, load

from smokelift.scene import Background, Inlet, Medium, Scene, completed, scene_from_dict, scene_to_dict


def test_a_complete_scene_comes_back_as_it_was_written(tmp_path: Path) -> None:
    scene = completed(replace(load(tmp_path, GOOD), scattering="absorption"))
    assert completed(scene_from_dict(scene_to_dict(scene))) == scene


def test_inlets_add_up(tmp_path: Path) -> None:
    scene = completed(load(tmp_path, GOOD))
    inlets = Inlet((0, 0, 0), 0.2), Inlet((0.5, 0.5, 1), 0.1)
    expected = inlets[0].voxels(scene.domain) | inlets[1].voxels(scene.domain)
    np.testing.assert_array_equal(replace(scene, inlets=inlets).inflow(), expected)
    assert scene.inflow() is None


def test_what_is_missing_takes_a_default_but_camera_and_domain(tmp_path: Path) -> None:
    described = load(tmp_path, GOOD)
    bare = Scene(camera=described.camera, domain=described.domain)
    scene = completed(bare)
    assert (scene.medium, scene.lights, scene.scattering) == (Medium(), (), "single")
    assert scene.background == Background(color=(0.0, 0.0, 0.0))
    assert completed(scene) == scene
    other = described.views[0].camera
    assert completed(replace(bare, camera=None), other) == completed(scene, other) == replace(scene, camera=other)
    with pytest.raises(ValueError, match="no camera"):
        completed(replace(bare, camera=None))
    with pytest.raises(ValueError, match="no domain"):
        completed(replace(bare, domain=None))
