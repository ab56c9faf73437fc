"""What every metric refuses."""

from __future__ import annotations

import math

import numpy as np
import pytest

from smokelift.evaluation.metrics import mass, psnr, ssim, velocity_error, volume_error


@pytest.mark.parametrize("function", [psnr, ssim, volume_error, velocity_error])
def test_bad_arrays_are_refused(function) -> None:  # type: ignore[no-untyped-def]
    good = np.ones((12, 12, 3))
    bad = good.copy()
    bad[0, 0, 0] = np.nan
    for pair in ((good, bad), (bad, good)):
        with pytest.raises(ValueError, match="finite"):
            function(*pair)
    with pytest.raises(ValueError, match="shapes must be equal"):
        function(good, good[1:])
    with pytest.raises(ValueError, match="empty"):
        function(good[:0], good[:0])


def test_masks_must_fit_and_count_something() -> None:
    values = np.ones((4, 4, 4))
    for mask in (np.zeros((4, 4), bool), np.ones((3, 4), bool)):
        with pytest.raises(ValueError, match="mask"):
            psnr(values, values, mask)
        with pytest.raises(ValueError, match="mask"):
            volume_error(values, values, mask)
        with pytest.raises(ValueError, match="mask"):
            velocity_error(np.ones((4, 4, 3)), np.ones((4, 4, 3)), mask)
    with pytest.raises(ValueError, match="finite"):
        mass(np.array([math.inf]), 1.0)
