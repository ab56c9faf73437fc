"""Pictures as they are written."""

from __future__ import annotations

import numpy as np

from smokelift.output.images import eight_bit


def test_eight_bit_is_srgb() -> None:
    """Linear light is encoded, rounded and cut at both ends."""
    image = np.array([[[0, 0.2159, 1], [-1, 7, 0.0031308]]], np.float32)
    np.testing.assert_array_equal(eight_bit(image), [[[0, 128, 255], [0, 255, 10]]])
    assert eight_bit(image).dtype == np.uint8
