"""Two lights that explain what smoke adds, against SciPy's least squares without negative parts."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.optimize import nnls

from smokelift.setup.sun_and_rest import explained


@pytest.mark.parametrize("seed", range(4))
def test_strengths_are_the_least_squares_of_lights_that_add(seed: int) -> None:
    """Also where one of the two, or both, would take light away."""
    rng = np.random.default_rng(seed)
    lit, everywhere = rng.uniform(0, 1, (6, 40)), rng.uniform(0, 1, 40)
    mixed = 0.5 * lit[0] + 0.2 * everywhere
    for added in (mixed, lit[1] - 0.3 * everywhere, everywhere - 0.5 * lit[2], -mixed):
        found = explained(lit, everywhere, added)
        for n, sun in enumerate(lit):
            strengths, left = nnls(np.stack([sun, everywhere], 1), added)
            np.testing.assert_allclose((found.sun[n], found.rest[n]), strengths, atol=1e-9)
            assert found.left[n] == pytest.approx(left**2, abs=1e-9)
