"""Grids that are half as fine, and a velocity of such a grid where smoke is."""

from dataclasses import replace

import numpy as np
import pytest

from smokelift.transport import Velocity, advect, divergence, face_shapes, halved, part_of, project
from smokelift.velocity import pyramid as module
from smokelift.velocity.pyramid import advect_near, coarsen_velocity, prolong, refine, refine_near_smoke
from tests.engine.transport.random_fields import random_velocity


@pytest.mark.parametrize("shape", [(8, 6, 10), (7, 9, 5)])
def test_half_as_fine_a_flow_is_as_free_of_divergence(shape):
    coarse = coarsen_velocity(project(random_velocity(0, shape=shape)))
    assert coarse.shape == tuple((n + 1) // 2 for n in shape)
    inner = tuple(slice(0, n // 2) for n in shape)  # an odd last voxel is continued outwards
    assert np.abs(divergence(coarse)[inner]).max() < 1e-5


@pytest.mark.parametrize("closed", [(), ("z-",), ("x+", "y-", "z+")])
@pytest.mark.parametrize("shape", [(12, 8, 10), (11, 9, 7)])
def test_twice_as_fine_a_flow_has_no_divergence_and_stops_at_walls(shape, closed):
    rough = random_velocity(1, voxel_size=2.0, shape=tuple((n + 1) // 2 for n in shape))
    fine = Velocity(prolong(project(rough, closed), shape), 1.0, closed)
    assert fine.shape == shape
    assert np.abs(divergence(fine)).max() < 1e-5
    for wall in closed:
        axis, end = "xyz".index(wall[0]), -1 if wall[1] == "+" else 0
        assert not fine.faces[axis].take(end, axis).any()


def test_twice_as_fine_a_turning_flow_turns_as_it_did():
    def turning(voxel: float, shape: tuple[int, int, int]) -> Velocity:
        x, y = (voxel * (np.arange(n) + 0.5) for n in shape[:2])
        faces = (y[None, :, None], -x[:, None, None], np.zeros((1, 1, 1)))
        return Velocity(tuple(map(np.broadcast_to, faces, face_shapes(shape))), voxel)

    fine = turning(1.0, (14, 12, 10))
    inner = slice(4, 6)  # the ends are continued
    for found, expected in zip(prolong(turning(2.0, (7, 6, 5)), fine.shape), fine.faces, strict=True):
        np.testing.assert_allclose(found[inner, inner, inner], expected[inner, inner, inner], atol=1e-5)


@pytest.mark.parametrize("shape", [(40, 36, 44), (41, 35, 43)])
@pytest.mark.parametrize(
    "box", [(slice(13, 20), slice(0, 9), slice(30, 31)), (slice(0, 5), slice(11, 25), slice(14, 33))]
)
def test_part_of_a_finer_velocity_is_what_the_whole_has_there(shape, box):
    """Computed around the box alone, on a grid coarsened twice, with what is known of the estimate."""
    coarse_shape = tuple(-(-n // 4) for n in shape)
    coarse = replace(random_velocity(2, voxel_size=4.0, shape=coarse_shape), closed=("y-",))
    found, expected = refine(coarse, shape, box), part_of(refine(coarse, shape), box)
    assert found.voxel_size == 1.0
    assert found.closed == expected.closed == (("y-",) if box[1].start == 0 else ())
    for mine, other in zip(found.faces, expected.faces, strict=True):
        np.testing.assert_allclose(mine, other, atol=1e-6)


BOX = (41, 36, 48)


def puff() -> np.ndarray:
    density = np.zeros(BOX, np.float32)
    density[16:20, 14:18, 20:26] = np.random.default_rng(0).random((4, 4, 6), np.float32)
    return density


def flow(speed: float, closed: tuple[str, ...] = ()) -> Velocity:
    """Smooth and without divergence, on half the grid; voxels of the density have an edge of 1 m."""
    half = halved(BOX)
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
    expected = advect(puff(), refine(velocity, BOX), 1.0, conserve=conserve)
    np.testing.assert_allclose(advect_near(puff(), velocity, 1.0, 1.0, conserve=conserve), expected, atol=1e-5)
    assert expected.any()


def test_velocity_is_right_where_smoke_can_arrive_and_zero_where_none_is() -> None:
    nothing = np.zeros(BOX, np.float32)
    assert not advect_near(nothing, flow(1.0), 1.0, 1.0).any()
    assert not any(component.any() for component in refine_near_smoke(flow(1.0), nothing > 0, 1.0, 1.0).faces)
    velocity, smoke = flow(1.0), puff() > 0
    whole, near = refine(velocity, BOX), refine_near_smoke(velocity, smoke, 1.0, 1.0)
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
