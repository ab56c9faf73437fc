"""The projection with given faces: obstacles, and what is known of a flow."""

import numpy as np

from smokelift.direct.surroundings import Ball, Solid
from smokelift.transport import Velocity, divergence, project
from smokelift.transport.constraint import faces_between, faces_of, project_with_given_faces
from tests.engine.direct.rising import DOMAIN, along_x


def test_no_air_enters_an_obstacle_and_none_is_made_around_it():
    solid = Ball((0, 0, 1.5), 0.5).voxels(DOMAIN)
    found = Solid(solid, None).projected(along_x(1.0))
    assert not any(component[mask].any() for mask, component in zip(faces_of(solid), found.faces, strict=True))
    assert np.abs(divergence(found)).max() * DOMAIN.voxel_size < 0.005
    # the air goes round it: faster beside it than far away
    assert found.faces[0][8, 2:14, 12].max() > 1.1


def test_the_force_of_an_obstacle_acts_on_its_surface_alone():
    """Elsewhere the field changes by a velocity without divergence only, which no projection would take away."""
    field, solid = along_x(1.0), Ball((0, 0, 1.5), 0.5).voxels(DOMAIN)
    still = Velocity.zero(DOMAIN.shape, DOMAIN.voxel_size).faces
    found = project_with_given_faces(field, faces_between(solid), still)
    again = project(Velocity(found.faces, field.voxel_size, field.closed))
    for a, b in zip(found.faces, again.faces, strict=True):
        np.testing.assert_allclose(a, b, atol=1e-5)
