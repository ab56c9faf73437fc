"""How velocity estimates fail in the field, one by one: whatever is put in, what comes out stays sound.

Smooth, textured blobs without noise are not what the default's weights are for (turbulent smoke is, see
benchmarks/velocity/accuracy.py), so the bounds here are those of a sound estimate, not of an exact one.
"""

import numpy as np
import pytest

from smokelift.scene import SIDES
from smokelift.velocity import estimate_velocity, predict_velocity
from tests.engine.velocity.known_motions import (
    DT,
    VOXEL,
    error_in_smoke,
    mean_motion,
    rotation,
    translation,
    uniform,
    voxels_a_frame,
)

SHAPE = (40, 32, 40)
WIDE = {"shape": SHAPE, "radius": 7.0}


@pytest.mark.parametrize("speed", [0.1, 1, 10])
def test_speeds_from_a_tenth_of_a_voxel_to_ten(speed):
    motion = speed * np.array((0.48, -0.6, 0.64))
    before, after, truth = translation(motion, (48, 48, 56), radius=9.0)
    found = estimate_velocity(before, after, DT, VOXEL)
    assert error_in_smoke(found, after, truth) < 0.55
    speeds = np.linalg.norm(voxels_a_frame(found), axis=-1)
    assert 0.7 < speeds[after > 0.1 * after.max()].mean() / speed < 1.3
    assert speeds.max() < 3 * speed


def test_a_chain_of_frames_settles():
    angle, prediction = 0.12, None
    errors, speeds = [], []
    for frame in range(8):
        before, after, truth = rotation(angle, **WIDE, before=angle * frame)
        found = estimate_velocity(before, after, DT, VOXEL, prediction=prediction)
        prediction = predict_velocity(found, DT)
        errors.append(error_in_smoke(found, after, truth))
        largest = np.linalg.norm(truth[after > 0.1 * after.max()], axis=-1).max()
        speeds.append(np.linalg.norm(voxels_a_frame(found), axis=-1).max() / largest)
    assert max(errors[3:]) < 0.85 * errors[0] < 0.65
    assert min(speeds[4:]) > 0.7 and max(speeds[4:]) < 1.6


def test_the_velocity_is_found_in_a_box_of_walls():
    before, after, _ = translation((0.5, -0.3, 0.6), **WIDE)
    found = estimate_velocity(before, after, DT, VOXEL, closed=SIDES)
    assert mean_motion(found, after) == pytest.approx((0.5, -0.3, 0.6), abs=0.2)
    for axis, component in enumerate(found.faces):
        assert not component.take((0, -1), axis).any()


@pytest.mark.parametrize("prediction", [None, uniform((0.5, -0.5, 0.5), SHAPE)], ids=["alone", "predicted"])
def test_smoke_that_is_gone_has_no_velocity(prediction):
    before, _, _ = translation((0.3, 0.2, 0.5), **WIDE)
    gone = estimate_velocity(before, np.zeros(SHAPE), DT, VOXEL, prediction=prediction)
    assert np.abs(voxels_a_frame(gone)).max() < 0.2
    never = estimate_velocity(np.zeros(SHAPE), np.zeros(SHAPE), DT, VOXEL, prediction=prediction)
    assert not never.centres().any()


@pytest.mark.parametrize("before", [0.0, 1e-3])
def test_smoke_that_was_not_there_has_no_motion(before):
    density = translation((0, 0, 0), **WIDE)[0].astype(np.float32)
    found = estimate_velocity(before * density, density, DT, VOXEL)
    assert np.abs(voxels_a_frame(found)).max() == 0


@pytest.mark.parametrize("left", [1.02, 1.5, 10, 0.95, 0.8, 0.5])
def test_flicker_and_dissolving_are_no_motion(left):
    before, _, _ = translation((0, 0, 0), **WIDE)
    found = estimate_velocity(before, left * before, DT, VOXEL)
    assert np.abs(voxels_a_frame(found)).max() < 0.05
    if left < 1:
        assert found.figures["dissipation"] == pytest.approx(1 - left, abs=0.01)
