"""Advection of densities and velocities."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from smokelift import _core
from smokelift.scene import SIDES
from smokelift.transport import Velocity, advect, project
from tests.engine.transport.random_fields import SHAPE, random_velocity, uniform

SCHEMES = ["maccormack", "semi-lagrangian"]


@pytest.mark.parametrize("threads", [2, 3])
def test_results_do_not_depend_on_threads(threads):
    rng = np.random.default_rng(8)
    field, velocity = rng.random(SHAPE).astype(np.float32), random_velocity(8)
    one, free = advect(field, velocity, 1.0), project(velocity, SIDES)
    _core.set_threads(threads)
    np.testing.assert_array_equal(advect(field, velocity, 1.0), one)
    for a, b in zip(project(velocity, SIDES).faces, free.faces, strict=True):
        np.testing.assert_array_equal(a, b)


@pytest.mark.parametrize("scheme", SCHEMES)
def test_whole_voxels_are_shifted_exactly(scheme):
    density = np.random.default_rng(9).random(SHAPE).astype(np.float32)
    moved = advect(density, uniform((0.2, -0.1, 0.3), voxel_size=0.05), 0.5, scheme=scheme)
    np.testing.assert_allclose(moved[2:, :-1, 3:], density[:-2, 1:, :-3], atol=1e-4)
    # Nothing comes in from outside.
    assert not moved[:2].any()
    assert not moved[:, -1:].any()
    assert not moved[:, :, :3].any()


@pytest.mark.parametrize("scheme", SCHEMES)
def test_a_constant_stays_constant_between_walls(scheme):
    velocity = project(random_velocity(10), SIDES)
    moved = advect(np.full(SHAPE, 0.7, np.float32), velocity, 0.2, scheme=scheme)
    np.testing.assert_allclose(moved, 0.7, rtol=1e-5)


def swirl(speed, shape=(32, 32, 16)):
    """A flow between walls without divergence, round and round, as fast as `speed` voxels per step."""
    along = [np.sin(np.pi * np.arange(n + 1) / n) ** 2 for n in shape[:2]]
    stream = along[0][:, None] * along[1][None, :]
    x, y = (np.repeat(a[:, :, None], shape[2], 2) for a in (np.diff(stream, axis=1), -np.diff(stream, axis=0)))
    scale = speed / max(np.abs(x).max(), np.abs(y).max())
    return Velocity((scale * x, scale * y, np.zeros((*shape[:2], shape[2] + 1))), 1.0)


def structured_blob(shape=(32, 32, 16)):
    """Smoke away from the middle, and exactly none further out."""
    x, y, z = (i - (n - 1) / 2 for i, n in zip(np.indices(shape), shape, strict=True))
    ball = np.exp(-((x - 5) ** 2 + y**2 + z**2) / 20)
    return np.maximum(ball * (1 + 0.5 * np.sin(0.9 * x) * np.cos(0.8 * y + 0.5 * z)) - 0.02, 0).astype(np.float32)


@pytest.mark.parametrize("scheme", SCHEMES)
@pytest.mark.parametrize("speed", [0.1, 0.3, 1, 3, 10])
def test_mass_can_be_kept(scheme, speed):
    """From a tenth of a voxel to ten a step; what is repaired stays smoke, and where there is smoke."""
    flow, density = swirl(speed), structured_blob()
    kept = density
    for _ in range(8):
        plain = advect(kept, flow, 1.0, scheme=scheme)
        kept = advect(kept, flow, 1.0, scheme=scheme, conserve=True)
        assert kept.min() >= 0
        assert not kept[plain == 0].any()
        assert kept.sum(dtype=float) == pytest.approx(density.sum(dtype=float), rel=1e-5)


@pytest.mark.parametrize("speed", [0.3, 1.3, 4.0])
def test_what_leaves_the_box_is_gone_and_nothing_comes_in(speed):
    full = np.ones(SHAPE, np.float32)
    for amount in (1, 1e-6):
        moved = advect(np.float32(amount) * full, uniform((speed, 0, 0)), 1.0, conserve=True)
        assert moved.sum(dtype=float) == pytest.approx((1 - speed / SHAPE[0]) * amount * full.sum(), rel=1e-5)
    gone = advect(full, uniform((0, -2.0 * SHAPE[1], 0)), 1.0, conserve=True)
    assert not gone.any()


def test_no_mass_leaves_through_walls():
    full = np.ones(SHAPE, np.float32)
    flow = project(random_velocity(3), SIDES)
    assert advect(full, flow, 1.0, conserve=True).sum(dtype=float) == pytest.approx(full.size, rel=1e-5)
    half = project(random_velocity(3), SIDES[:5])
    assert advect(full, half, 1.0, conserve=True).sum(dtype=float) < 0.999 * full.size


def test_maccormack_keeps_more_detail():
    x, y, z = np.indices((32, 16, 16)) - np.array([8, 7.5, 7.5])[:, None, None, None]
    blob = np.exp(-(x**2 + y**2 + z**2) / 8).astype(np.float32)
    sharp = smooth = blob
    flow = uniform((0.4, 0, 0), blob.shape)
    for _ in range(10):
        sharp, smooth = advect(sharp, flow, 1.0), advect(smooth, flow, 1.0, scheme="semi-lagrangian")
    truth = np.roll(blob, 4, 0)
    assert np.linalg.norm(sharp - truth) < 0.5 * np.linalg.norm(smooth - truth)


@settings(max_examples=30, deadline=None, derandomize=True)
@given(
    field=arrays(np.float32, (5, 4, 6), elements=st.floats(0, 1e3, width=32)),
    seed=st.integers(0, 2**16),
    scale=st.floats(0, 10),
    scheme=st.sampled_from(SCHEMES),
)
def test_transport_makes_no_new_extremes(field, seed, scale, scheme):
    moved = advect(field, random_velocity(seed, scale, shape=field.shape), 1.0, scheme=scheme)
    assert moved.min() >= 0
    assert moved.max() <= field.max() * (1 + 1e-6)


@pytest.mark.parametrize("scheme", SCHEMES)
def test_a_velocity_is_carried_from_its_own_positions(scheme):
    field = random_velocity(11)
    moved = advect(field, uniform((1, 0, -2)), 1.0, scheme=scheme)
    for a, b in zip(moved.faces, field.faces, strict=True):
        np.testing.assert_allclose(a[1:, :, :-2], b[:-1, :, 2:], atol=1e-5)
    still = uniform((0.3, 0.1, -0.7))
    for a, b in zip(advect(still, field, 1.0, scheme=scheme).faces, still.faces, strict=True):
        np.testing.assert_allclose(a, b, rtol=1e-6)
