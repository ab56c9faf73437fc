"""States of smoke: read from files that keep the velocity near smoke alone, and between two others."""

import numpy as np
import pytest

from smokelift.direct.state import SmokeState, complete_velocity, interpolate
from smokelift.scene import Inlet
from smokelift.transport import Velocity, divergence, project
from smokelift.transport.pressure import faces_of
from tests.engine.direct.rising import DOMAIN, DT, along_x, at_rest, blob


@pytest.mark.parametrize("fraction", [0.25, 0.5, 0.75])
def test_interpolation_moves_a_blob_and_does_not_blend_two(fraction):
    way = 2 * DOMAIN.voxel_size
    velocity = along_x(way / DT)
    first, last = SmokeState(blob((-0.2, 0, 1)), velocity), SmokeState(blob((-0.2 + way, 0, 1)), velocity)
    true = blob((-0.2 + fraction * way, 0, 1))
    found = interpolate(first, last, velocity, DT, fraction)
    mixed = (1 - fraction) * first.density + fraction * last.density

    def error(density):
        return float(np.linalg.norm(density - true) / np.linalg.norm(true))

    assert error(found.density) < 0.05
    assert error(found.density) < 0.2 * error(mixed)
    assert found.density.sum() == pytest.approx(true.sum(), rel=2e-3)
    np.testing.assert_allclose(found.velocity.faces[0][4:12], velocity.faces[0][4:12], rtol=1e-3)


def test_a_flame_is_carried_as_the_smoke_is_and_mass_goes_evenly():
    way = 2 * DOMAIN.voxel_size
    velocity = along_x(way / DT)
    first, last = (SmokeState(blob((x, 0, 1)), velocity, 3 * blob((x, 0, 1))) for x in (-0.2, -0.2 + way))
    found = interpolate(first, last, velocity, DT, 0.5)
    np.testing.assert_allclose(found.flame, 3 * found.density, rtol=1e-4, atol=1e-5)
    assert interpolate(first, SmokeState(last.density, velocity), velocity, DT, 0.5).flame is None
    more = interpolate(at_rest(blob()), at_rest(3 * blob()), along_x(0.0), DT, 0.25)
    assert more.density.sum() == pytest.approx(1.5 * blob().sum(), rel=1e-4)


def test_a_velocity_known_near_smoke_is_completed():
    """Files cut it off; what is left in the known part is nearly all of it, which a projection alone loses."""
    random = np.random.default_rng(0)
    faces = [random.normal(size=f.shape).astype(np.float32) for f in Velocity.zero(DOMAIN.shape, 1.0).faces]
    for _ in range(6):  # eddies larger than voxels
        faces = [sum(np.roll(f, s, a) for a in range(3) for s in (-1, 1)) / np.float32(6) for f in faces]
    whole = project(Velocity((faces[0], faces[1], faces[2]), DOMAIN.voxel_size))
    near = Inlet((0, 0, 1.5), 0.7).voxels(DOMAIN)
    known = faces_of(near)
    cut = whole.with_faces(np.where(m, f, np.float32(0)) for m, f in zip(known, whole.faces, strict=True))

    def error(found: Velocity) -> float:
        squares = [((a - b)[m] ** 2).sum() for a, b, m in zip(found.faces, whole.faces, known, strict=True)]
        return float(np.sqrt(sum(squares)))

    found = complete_velocity(cut)
    assert np.abs(divergence(found)).max() < 1e-3 * max(np.abs(f).max() for f in found.faces) / DOMAIN.voxel_size
    assert error(found) < 0.3 * error(project(cut))
    assert complete_velocity(whole) is whole
