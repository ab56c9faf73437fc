"""Fakes of a truth: each is caught by a score, other smoke of the kind by none."""

from __future__ import annotations

import numpy as np
import pytest
from scipy import ndimage

from benchmarks.accuracy.fakes import fakes, measured
from smokelift.evaluation.frame_means import Figures
from smokelift.evaluation.truth import Truth
from smokelift.scene import Background, Camera, DirectionalLight, Domain, Medium, Scene, completed
from smokelift.transport import Velocity

SHAPE, FRAMES, VOXEL = (24, 24, 36), 3, 0.1
SCENE = Scene(
    camera=Camera.look_at((0, -8, 1.8), (0, 0, 1.8), fov_y_degrees=27, size=(48, 72)),
    domain=Domain((-1.2, -1.2, 0), (1.2, 1.2, 3.6), SHAPE),
    medium=Medium(extinction=5.0, albedo=0.9),
    lights=(DirectionalLight((0.3, 0.5, -0.8), (12.0, 12.0, 12.0)),),
    background=Background(color=(0.0, 0.0, 0.0)),
    scattering="single",
)


def truth(seed: int) -> Truth:
    """A ball of lumps that rise by a voxel a frame."""
    lumps = ndimage.gaussian_filter(np.random.default_rng(seed).standard_normal((24, 24, 48)), 2) * 12
    x, y, z = np.indices(SHAPE) - np.array([11.5, 11.5, 17.5])[:, None, None, None]
    ball = np.exp(-(x**2 + y**2 + (z / 1.3) ** 2) / 40)
    densities = [np.maximum(ball * np.maximum(1 + lumps[..., 8 - n : 44 - n], 0) - 0.1, 0) for n in range(FRAMES)]
    rest = Velocity.zero(SHAPE, VOXEL).faces
    faces = tuple(np.stack([face] * FRAMES).astype(np.float16) for face in rest)
    inflow = np.zeros((FRAMES, int(np.prod(SHAPE)) // 8), np.uint8)
    return Truth(np.stack(densities).astype(np.float16), faces, inflow, VOXEL, 24.0, ())


@pytest.fixture(scope="module")
def found() -> dict[str, Figures]:
    true = truth(1)
    return {name: measured(completed(SCENE), FRAMES, true, density) for name, density in fakes(true, truth(2)).items()}


def test_other_smoke_of_the_kind_has_about_the_truth_s_own_distance(found) -> None:
    for name in ("turned by 90 degrees", "other smoke"):
        assert found[name]["patches"] < 1.6 * found["truth"]["patches_own"]
        assert found[name]["texture"] < 1.3 * found["truth"]["texture_own"]
        assert found[name]["edges"] == pytest.approx(1, abs=0.15)
        assert found[name]["flicker"] == pytest.approx(1, abs=0.3)


@pytest.mark.parametrize("name", ["blurred", "turned on a lathe", "front drawn out in depth"])
def test_smooth_fakes_have_another_texture_and_lack_edges(found, name) -> None:
    assert found[name]["texture"] > 1.2 * found["other smoke"]["texture"]
    assert found[name]["edges"] < 0.93


def test_blur_and_what_is_drawn_out_in_depth_have_other_patches(found) -> None:
    for name in ("blurred", "front drawn out in depth"):
        assert found[name]["patches"] > 1.2 * found["other smoke"]["patches"]
    assert found["front drawn out in depth"]["front_patches"] > 1.3 * found["truth"]["front_patches"]


def test_haze_is_outside_the_outlines(found) -> None:
    assert found["truth"]["halo"] < 0.005 < 0.02 < found["haze"]["halo"]


def test_noise_and_stutter_flicker(found) -> None:
    for name in ("blurred, new noise in every frame", "every other frame twice"):
        assert found[name]["flicker"] > 1.3
