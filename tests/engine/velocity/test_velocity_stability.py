"""How velocity estimates fail in the field, one by one: whatever is put in, what comes out stays sound.

Smooth, textured blobs without noise are not what the default's weights are for (turbulent smoke is, see
benchmarks/velocity/accuracy.py), so the bounds here are those of a sound estimate, not of an exact one.
"""

import numpy as np
import pytest

from smokelift.scene import SIDES
from smokelift.transport import Velocity
from smokelift.velocity import estimate_velocity, predict_velocity
from tests.engine.velocity.known_motions import positions, structured_density

DT, VOXEL = 1 / 24, 0.03
SHAPE = (40, 32, 40)


def blob(x, y, z, radius=7.0):
    """Smoke larger than that of the known motions."""
    return structured_density(x, y, z, radius)


def moved(motion, shape=SHAPE, radius=7.0):
    """The blob before and after a motion through the middle of the box, in voxels."""
    motion, where = np.array(motion), positions(shape)
    return [blob(*(a - share * m for a, m in zip(where, motion, strict=True)), radius) for share in (-0.5, 0.5)]


def turned(angle):
    """The blob turned about y."""
    x, y, z = positions(SHAPE)
    c, s = np.cos(angle), np.sin(angle)
    return blob(c * x + s * z, y, c * z - s * x)


def turning(angle):
    """Displacement at arrival of a turn about y."""
    x, y, z = positions(SHAPE)
    c, s = np.cos(angle), np.sin(angle)
    return np.stack([x - (c * x + s * z), 0 * y, z - (c * z - s * x)], axis=-1)


def uniform(motion, shape=SHAPE):
    """The same velocity everywhere, in voxels a frame."""
    zero = Velocity.zero(shape, VOXEL).faces
    x, y, z = (np.full_like(a, v * VOXEL / DT) for a, v in zip(zero, motion, strict=True))
    return Velocity((x, y, z), VOXEL)


def voxels_a_frame(velocity):
    """At voxel centres."""
    return velocity.centres() * (DT / VOXEL)


def mean_motion(velocity, density):
    """Voxels a frame of the smoke as a whole."""
    return np.average(voxels_a_frame(velocity).reshape(-1, 3), axis=0, weights=density.ravel())


def error(velocity, density, truth):
    """Relative, inside the smoke."""
    inside = density > 0.1 * density.max()
    wanted = np.broadcast_to(truth, (*density.shape, 3))[inside]
    return np.linalg.norm(voxels_a_frame(velocity)[inside] - wanted) / np.linalg.norm(wanted)


def mean_speed(velocity, density):
    """Voxels a frame, inside the smoke."""
    return np.linalg.norm(voxels_a_frame(velocity)[density > 0.1 * density.max()], axis=-1).mean()


# velocity collapse and blow-up


@pytest.mark.parametrize("speed", [0.1, 0.3, 1, 3, 10])
def test_speeds_from_a_tenth_of_a_voxel_to_ten(speed):
    motion = speed * np.array((0.48, -0.6, 0.64))
    before, after = moved(motion, (48, 48, 56), radius=9.0)
    found = estimate_velocity(before, after, DT, VOXEL)
    assert error(found, after, motion) < 0.55
    assert 0.7 < mean_speed(found, after) / speed < 1.3
    assert np.linalg.norm(voxels_a_frame(found), axis=-1).max() < 3 * speed


def test_a_chain_of_frames_settles():
    angle, prediction = 0.12, None
    errors, speeds = [], []
    for frame in range(8):
        after = turned(angle * (frame + 1))
        found = estimate_velocity(turned(angle * frame), after, DT, VOXEL, prediction=prediction)
        prediction = predict_velocity(found, DT)
        errors.append(error(found, after, turning(angle)))
        speeds.append(np.linalg.norm(voxels_a_frame(found), axis=-1).max())
    assert max(errors[3:]) < 0.85 * errors[0] < 0.65
    largest = np.linalg.norm(turning(angle)[after > 0.1 * after.max()], axis=-1).max()
    assert all(0.7 < speed / largest < 1.6 for speed in speeds[4:])


def test_the_velocity_is_found_in_a_box_of_walls():
    before, after = moved((0.5, -0.3, 0.6))
    found = estimate_velocity(before, after, DT, VOXEL, closed=SIDES)
    assert mean_motion(found, after) == pytest.approx((0.5, -0.3, 0.6), abs=0.2)
    for axis, component in enumerate(found.faces):
        assert not component.take((0, -1), axis).any()


# too little vorticity, too much of it


@pytest.mark.parametrize("angle", [0.05, 0.1, 0.2])
def test_a_turn_keeps_its_vorticity(angle):
    before, after = turned(0), turned(angle)
    found = voxels_a_frame(estimate_velocity(before, after, DT, VOXEL))
    inside = after > 0.1 * after.max()
    about_y = np.gradient(found[..., 0], axis=2) - np.gradient(found[..., 2], axis=0)
    wanted = np.gradient(turning(angle)[..., 0], axis=2) - np.gradient(turning(angle)[..., 2], axis=0)
    assert 0.7 < about_y[inside].mean() / wanted[inside].mean() < 1.3


# wrong velocity at the base


def rising_column(speed, frame):
    """A textured column that goes up while new smoke enters at its base, six voxels above the floor."""
    x, y, z = positions((32, 32, 48))
    z = z + 23.5
    own = z - speed * frame
    texture = (
        1
        + 0.4 * np.sin(0.7 * x + 0.3 * y) * np.cos(0.45 * own)
        + 0.3 * np.sin(0.5 * y - 0.2 * x + 0.35 * own)
    )  # fmt: skip
    ends = 1 / ((1 + np.exp(-(z - 6) / 0.7)) * (1 + np.exp((own - 34) / 1.5)))
    return np.exp(-(x**2 + y**2) / 25) * texture * ends, (x**2 + y**2 < 49) & (np.abs(z - 6) <= 2 + speed)


@pytest.mark.parametrize("speed", [0.3, 1, 3])
def test_smoke_rises_from_its_inlet(speed):
    (before, _), (after, inlet) = rising_column(speed, 0), rising_column(speed, 1)
    found = voxels_a_frame(estimate_velocity(before, after, DT, VOXEL, inflow=inlet))[..., 2]
    for height in (6, 7, 8, 10, 14, 20, 30):
        assert 0.3 < np.average(found[..., height], weights=after[..., height]) / speed < 1.4


# first frame without smoke, empty hull


@pytest.mark.parametrize("prediction", [None, uniform((0.5, -0.5, 0.5))], ids=["alone", "predicted"])
def test_smoke_that_is_gone_has_no_velocity(prediction):
    before, _ = moved((0.3, 0.2, 0.5))
    gone = estimate_velocity(before, np.zeros(SHAPE), DT, VOXEL, prediction=prediction)
    assert np.abs(voxels_a_frame(gone)).max() < 0.2
    never = estimate_velocity(np.zeros(SHAPE), np.zeros(SHAPE), DT, VOXEL, prediction=prediction)
    assert not never.centres().any()


# dissipation read as motion


@pytest.mark.parametrize("before", [0.0, 1e-6, 1e-3])
def test_smoke_that_was_not_there_has_no_motion(before):
    density = moved((0, 0, 0))[0].astype(np.float32)
    found = estimate_velocity(before * density, density, DT, VOXEL)
    assert np.abs(voxels_a_frame(found)).max() == 0
    assert not found.confidence.any()


@pytest.mark.parametrize("brighter", [1.02, 1.2, 1.5, 10, 0.8])
def test_flicker_is_no_motion(brighter):
    density = moved((0, 0, 0))[0]
    found = estimate_velocity(density, brighter * density, DT, VOXEL)
    assert np.abs(voxels_a_frame(found)).max() < 0.05


@pytest.mark.parametrize("left", [0.5, 0.8, 0.95])
def test_dissolving_smoke_at_rest_stays_at_rest(left):
    before, _ = moved((0, 0, 0))
    found = estimate_velocity(before, left * before, DT, VOXEL)
    assert np.abs(voxels_a_frame(found)).max() < 0.05
    assert found.figures["dissipation"] == pytest.approx(1 - left, abs=0.01)


@pytest.mark.parametrize("left", [0.8, 0.9, 0.95])
def test_dissolving_smoke_moves_at_its_own_speed(left):
    motion = np.array((0.3, -0.2, 1.0))
    before, after = moved(motion)
    found, steady = (estimate_velocity(before, share * after, DT, VOXEL) for share in (left, 1))
    assert mean_motion(found, after) == pytest.approx(motion, abs=0.25)
    assert error(found, after, motion) < error(steady, after, motion) + 0.15
    assert 0 < found.figures["dissipation"] < 1.2 * (1 - left)
