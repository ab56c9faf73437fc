"""The projection with given faces: obstacles, and what is known of a flow."""

import numpy as np

from smokelift.direct import Ball, complete_velocity
from smokelift.direct.constraint import faces_between, faces_of, project_with_given_faces
from smokelift.direct.obstacles import Solid
from smokelift.transport import Velocity, divergence, project
from tests.engine.direct.rising import DOMAIN


def uniform(speed: float = 1.0) -> Velocity:
    x, y, z = Velocity.zero(DOMAIN.shape, DOMAIN.voxel_size).faces
    return Velocity((x + np.float32(speed), y, z), DOMAIN.voxel_size, ("z-",))


def test_no_air_enters_an_obstacle_and_none_is_made_around_it():
    solid = Ball((0, 0, 1.5), 0.5).voxels(DOMAIN)
    found = Solid(solid, None).projected(uniform())
    for mask, component in zip(faces_of(solid), found.faces, strict=True):
        assert not component[mask].any()
    assert np.abs(divergence(found)).max() * DOMAIN.voxel_size < 0.005
    # the air goes round it: faster beside it than far away
    beside = found.faces[0][8, 2:14, 12]
    assert beside.max() > 1.1
    assert project(uniform()).faces[0].max() < 1.01


def test_the_force_of_an_obstacle_acts_on_its_surface_alone():
    """Elsewhere the field changes by a velocity without divergence only, which no projection would take away."""
    field, solid = uniform(), Ball((0, 0, 1.5), 0.5).voxels(DOMAIN)
    still = Velocity.zero(DOMAIN.shape, DOMAIN.voxel_size).faces
    found = project_with_given_faces(field, faces_between(solid), still)
    again = project(Velocity(found.faces, field.voxel_size, field.closed))
    for a, b in zip(found.faces, again.faces, strict=True):
        np.testing.assert_allclose(a, b, atol=1e-5)


def test_a_velocity_known_near_smoke_is_completed():
    """Files cut it off; what is left in the known part is nearly all of it, which a projection alone loses."""
    random = np.random.default_rng(0)
    faces = [random.normal(size=f.shape).astype(np.float32) for f in Velocity.zero(DOMAIN.shape, 1.0).faces]
    for _ in range(6):  # eddies larger than voxels
        faces = [sum(np.roll(f, s, a) for a in range(3) for s in (-1, 1)) / np.float32(6) for f in faces]
    whole = project(Velocity((faces[0], faces[1], faces[2]), DOMAIN.voxel_size))
    near = Ball((0, 0, 1.5), 0.7).voxels(DOMAIN)
    known = faces_of(near)
    cut = whole.with_faces(np.where(m, f, np.float32(0)) for m, f in zip(known, whole.faces, strict=True))

    def error(found: Velocity) -> float:
        squares = [((a - b)[m] ** 2).sum() for a, b, m in zip(found.faces, whole.faces, known, strict=True)]
        return float(np.sqrt(sum(squares)))

    found = complete_velocity(cut)
    assert np.abs(divergence(found)).max() < 1e-3 * max(np.abs(f).max() for f in found.faces) / DOMAIN.voxel_size
    assert error(found) < 0.3 * error(project(cut))
    assert complete_velocity(whole) is whole
