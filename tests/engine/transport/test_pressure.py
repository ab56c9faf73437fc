"""Projection and the Poisson solver under it; with given faces: obstacles, and what is known of a flow."""

import itertools

import numpy as np
import pytest

from smokelift import _core
from smokelift.direct.surroundings import Solid
from smokelift.scene import Inlet
from smokelift.transport import Velocity, divergence, project
from smokelift.transport.pressure import faces_between, faces_of, project_with_given_faces
from tests.engine.direct.rising import DOMAIN, along_x
from tests.engine.transport.random_fields import ALL_SIDES, SHAPE, names, random_velocity


def inner_product(a, b, closed):
    """Faces on open sides belong to half a voxel."""
    total = 0.0
    for axis, (p, q) in enumerate(zip(a, b, strict=True)):
        product = np.moveaxis(p.astype(float) * q, axis, 0)
        total += product[1:-1].sum() + sum(
            product[-high].sum() * (1.0 if closed[2 * axis + high] else 0.5) for high in (0, 1)
        )
    return total


def minus_laplacian(p, closed):
    result = np.zeros_like(p)
    for axis, high in itertools.product(range(3), (0, 1)):
        neighbor = np.roll(p, -1 if high else 1, axis)
        side = tuple(-high if d == axis else slice(None) for d in range(3))
        neighbor[side] = p[side] if closed[2 * axis + high] else -p[side]
        result += p - neighbor
    return result


@pytest.mark.parametrize(
    ("shape", "sides"),
    [
        *((shape, ALL_SIDES) for shape in (SHAPE, (8, 12, 16), (3, 2, 1), (1, 5, 4))),
        # large enough for transforms to be split
        *((shape, [*ALL_SIDES[::9], ALL_SIDES[-1]]) for shape in ((2, 72, 100), (3, 65, 160))),
    ],
)
def test_poisson_on_every_mix_of_sides(shape, sides):
    rng = np.random.default_rng(3)
    for closed in sides:
        truth = rng.standard_normal(shape)
        solution = _core.solve_poisson(minus_laplacian(truth, closed), closed)
        if all(closed):  # known up to a constant
            truth, solution = truth - truth.mean(), solution - solution.mean()
        np.testing.assert_allclose(solution, truth, atol=2e-5 if np.size(truth) < 10_000 else 2e-4)


@pytest.mark.parametrize("closed", [*ALL_SIDES[::7], ALL_SIDES[-1]])
def test_projection(closed):
    velocity = random_velocity(5)
    sides = names(closed)
    once = project(velocity, sides)
    assert np.abs(divergence(once)).max() < 1e-5 * max(np.abs(a).max() for a in once.faces)
    for axis, high in itertools.product(range(3), (0, 1)):
        if closed[2 * axis + high]:
            assert not np.take(once.faces[axis], -high, axis).any()

    twice = project(once, sides)
    for a, b in zip(once.faces, twice.faces, strict=True):
        np.testing.assert_allclose(a, b, atol=1e-5)

    # What is taken away is orthogonal to every velocity without divergence.
    other = project(random_velocity(6), sides)
    removed = [a - b for a, b in zip(velocity.faces, once.faces, strict=True)]
    size = inner_product(velocity.faces, velocity.faces, closed)
    assert abs(inner_product(removed, other.faces, closed)) < 1e-5 * size


def test_projection_keeps_units():
    velocity = random_velocity(7)
    small = Velocity(tuple(1e-3 * a for a in velocity.faces), 0.01)
    for a, b in zip(project(velocity).faces, project(small).faces, strict=True):
        np.testing.assert_allclose(1e-3 * a, b, rtol=1e-4, atol=1e-8)


def test_divergence_is_per_volume():
    faces = Velocity.zero(SHAPE, 0.1).faces
    faces[0][1:] = 2.0
    result = divergence(Velocity(faces, 0.1))
    np.testing.assert_allclose(result[0], 20.0)
    assert not result[1:].any()


def test_no_air_enters_an_obstacle_and_none_is_made_around_it():
    solid = Inlet((0, 0, 1.5), 0.5).voxels(DOMAIN)
    found = Solid(solid, None).projected(along_x(1.0))
    assert not any(component[mask].any() for mask, component in zip(faces_of(solid), found.faces, strict=True))
    assert np.abs(divergence(found)).max() * DOMAIN.voxel_size < 0.005
    # the air goes round it: faster beside it than far away
    assert found.faces[0][8, 2:14, 12].max() > 1.1


def test_the_force_of_an_obstacle_acts_on_its_surface_alone():
    """Elsewhere the field changes by a velocity without divergence only, which no projection would take away."""
    field, solid = along_x(1.0), Inlet((0, 0, 1.5), 0.5).voxels(DOMAIN)
    still = Velocity.zero(DOMAIN.shape, DOMAIN.voxel_size).faces
    found = project_with_given_faces(field, faces_between(solid), still)
    again = project(Velocity(found.faces, field.voxel_size, field.closed))
    for a, b in zip(found.faces, again.faces, strict=True):
        np.testing.assert_allclose(a, b, atol=1e-5)
