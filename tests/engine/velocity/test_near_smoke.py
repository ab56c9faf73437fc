"""A velocity of a coarser grid, where smoke is."""

import numpy as np
import pytest

from smokelift.transport import Velocity, advect, face_shapes, halved, project
from smokelift.velocity import near_smoke as module
from smokelift.velocity.estimator import refine
from smokelift.velocity.near_smoke import advect_near, refine_near_smoke

SHAPE = (41, 36, 48)


def puff() -> np.ndarray:
    density = np.zeros(SHAPE, np.float32)
    density[16:20, 14:18, 20:26] = np.random.default_rng(0).random((4, 4, 6), np.float32)
    return density


def flow(speed: float, closed: tuple[str, ...] = ()) -> Velocity:
    """Smooth and without divergence, on half the grid; voxels of the density have an edge of 1 m."""
    half = halved(SHAPE)
    faces = []
    for axis, shape in enumerate(face_shapes(half)):
        places = np.indices(shape) / np.reshape(half, (3, 1, 1, 1))
        faces.append(speed * (0.6 + np.sin(4 * places[(axis + 1) % 3] + axis)).astype(np.float32))
    x, y, z = faces
    return project(Velocity((x, y, z), 2.0, closed))


@pytest.mark.parametrize("speed", [0.0, 0.5, 5.0])
@pytest.mark.parametrize("conserve", [False, True])
def test_smoke_is_carried_as_by_the_velocity_of_the_whole_box(speed, conserve) -> None:
    velocity = flow(speed, ("z-",))
    expected = advect(puff(), refine(velocity, SHAPE), 1.0, conserve=conserve)
    np.testing.assert_allclose(advect_near(puff(), velocity, 1.0, 1.0, conserve=conserve), expected, atol=1e-5)
    assert expected.any()


def test_velocity_is_right_where_smoke_can_arrive_and_zero_where_none_is() -> None:
    nothing = np.zeros(SHAPE, np.float32)
    assert not advect_near(nothing, flow(1.0), 1.0, 1.0).any()
    assert not any(component.any() for component in refine_near_smoke(flow(1.0), nothing > 0, 1.0, 1.0).faces)
    velocity, smoke = flow(1.0), puff() > 0
    whole, near = refine(velocity, SHAPE), refine_near_smoke(velocity, smoke, 1.0, 1.0)
    assert near.voxel_size == 1.0
    assert not near.centres()[:4].any()
    inside = (slice(13, 23), slice(11, 21), slice(17, 29))
    np.testing.assert_allclose(near.centres()[inside], whole.centres()[inside], atol=1e-6)
    carried = advect(puff(), near, 1.0)
    np.testing.assert_allclose(carried, advect(puff(), whole, 1.0), atol=1e-5)
    assert refine_near_smoke(whole, smoke, 1.0, 1.0) is whole


def test_slabs_of_a_large_box_are_as_the_box(monkeypatch) -> None:
    density, velocity = puff(), flow(1.0)
    density[30:34, 28:32, 40:44] = 0.5
    carried, near = advect_near(density, velocity, 1.0, 1.0), refine_near_smoke(velocity, density > 0, 1.0, 1.0)
    monkeypatch.setattr(module, "MIN_SLAB_VOXELS", 0)
    monkeypatch.setattr(module, "SLAB", 3)
    np.testing.assert_allclose(advect_near(density, velocity, 1.0, 1.0), carried, atol=1e-5)
    again = refine_near_smoke(velocity, density > 0, 1.0, 1.0)
    assert np.count_nonzero(again.centres()) < np.count_nonzero(near.centres())
    for axis, slabs in enumerate(again.faces):
        given = slabs != 0
        np.testing.assert_array_equal(slabs[given], near.faces[axis][given])
    np.testing.assert_allclose(advect(density, again, 1.0), carried, atol=1e-5)
