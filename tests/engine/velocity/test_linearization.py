"""Tests of the change between two densities, linearized."""

import numpy as np
import pytest

from smokelift.transport import StaggeredGrid
from smokelift.velocity.linearization import directional_derivative, linearize


@pytest.mark.parametrize("shape", [(6, 7, 8), (1, 7, 8)])
def test_what_a_shift_explains_is_linear_in_it(shape):
    """A plane that is shifted leaves no change at the shift, and the whole change at rest."""
    y, z = np.indices(shape[1:]).astype(np.float32)
    before = np.broadcast_to(10 + y + 2 * z, shape).copy()
    rest = StaggeredGrid.zero(shape, 1.0)
    linear = linearize(before, before - 1, np.ones(shape, np.float32), rest)
    assert linear.scale == pytest.approx(5**0.5)
    np.testing.assert_allclose(linear.offset * linear.scale, -1, rtol=1e-5)
    upwards = rest.with_faces([rest.faces[0], rest.faces[1], rest.faces[2] + np.float32(0.5)])
    along = directional_derivative(linear.direction, upwards.faces)
    np.testing.assert_allclose(along * linear.scale, 1, rtol=1e-5)
    assert linear.unexplained_fraction(upwards, 0.0)[0] < 1e-10
    assert linear.with_dissipation(0.1).offset.shape == shape


def test_nothing_is_linearized_where_there_is_no_structure():
    nothing = np.zeros((4, 4, 4), np.float32)
    assert linearize(nothing, nothing, nothing + 1, StaggeredGrid.zero((4, 4, 4), 1.0)) is None
