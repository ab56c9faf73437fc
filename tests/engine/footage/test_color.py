"""How files encode light: the curves and matrices of the standards."""

import numpy as np
import pytest

from smokelift.footage.color import hlg_to_linear, pq_to_linear, primaries_name, to_bt709


def test_hlg_is_light_at_the_camera() -> None:
    # BT.2100, table 5: a signal of 1/2 is a twelfth of the peak, 1 is the peak; BT.2408 has white at 75 %
    black, twelfth, white, peak = hlg_to_linear([0.0, 0.5, 0.75, 1.0])
    assert (black, white) == (0.0, 1.0)
    assert peak / twelfth == pytest.approx(12, rel=1e-5)


def test_pq_is_absolute() -> None:
    # BT.2408, table 1: 100 cd/m2 are at 51 % of the signal, 203 at 58 %, 1000 at 75 %
    found = pq_to_linear([0.0, 0.508, 0.581, 0.752, 1.0]) * 203
    np.testing.assert_allclose(found, [0, 100, 203, 1000, 10_000], rtol=0.005)


@pytest.mark.parametrize("primaries", [1, 2, 5, 6, 7, 9, 12])
def test_white_stays_white(primaries: int) -> None:
    np.testing.assert_allclose(to_bt709(np.ones((1, 1, 3), np.float32), primaries), 1.0, rtol=1e-5)
    assert (primaries_name(primaries) is None) == (primaries in (1, 2))


def test_wider_colors() -> None:
    # BT.2087, the inverse of its matrix; what BT.709 cannot show is clipped
    found = to_bt709(np.array([[[0.5, 0.4, 0.3], [0.0, 1.0, 0.0]]], np.float32), 9)[0]
    matrix = np.array([[1.6605, -0.5876, -0.0728], [-0.1246, 1.1329, -0.0083], [-0.0182, -0.1006, 1.1187]])
    np.testing.assert_allclose(found[0], matrix @ [0.5, 0.4, 0.3], atol=2e-4)
    np.testing.assert_allclose(found[1], [0, 1.1329, 0], atol=2e-4)
