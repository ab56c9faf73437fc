"""What is done to densities before their motion is looked for."""

from __future__ import annotations

import numpy as np
import pytest
from scipy import ndimage

from smokelift import _core


@pytest.mark.parametrize(("width", "truncate"), [(0.5, 4.0), (1.0, 3.0), (2.0, 3.0)])
@pytest.mark.parametrize("shape", [(9, 20, 13), (3, 2, 1)])
def test_blur_is_a_gaussian(shape, width, truncate):
    cells = np.random.default_rng(1).random(shape, np.float32)
    expected = ndimage.gaussian_filter(cells, width, truncate=truncate)
    np.testing.assert_allclose(_core.blur(cells, width, truncate), expected, rtol=1e-5)
