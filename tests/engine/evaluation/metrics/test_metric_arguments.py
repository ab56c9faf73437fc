"""What every metric refuses."""

from __future__ import annotations

import math

import numpy as np
import pytest

from smokelift.evaluation.metrics import (
    mass,
    mean_divergence,
    psnr,
    ssim,
    velocity_error,
    volume_error,
    warp_error,
)
from smokelift.transport import Velocity


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


def test_a_velocity_on_faces_is_brought_to_the_centres_first() -> None:
    wind, smoke = Velocity.zero((4, 4, 4), 0.1), np.ones((4, 4, 4))
    for measured in (
        lambda: velocity_error(wind, wind),
        lambda: mean_divergence(wind, 0.1),
        lambda: warp_error(smoke, smoke, wind),
    ):
        with pytest.raises(ValueError, match=r"velocity\.centres\(\), not a Velocity"):
            measured()
    assert velocity_error(wind.centres(), wind.centres()) == (0, 1)
    with pytest.raises(ValueError, match=r"must have the shape \(nx, ny, nz, 3\), not \(4, 4, 4\)"):
        mean_divergence(smoke, 0.1)


def test_numbers_out_of_range() -> None:
    smoke, picture = np.ones((4, 4, 4)), np.ones((12, 12))
    for size in ("0.1", (0.1, 0.1, 0.1), None, 0):
        with pytest.raises(ValueError, match="voxel_size must be positive"):
            mass(smoke, size)  # type: ignore[arg-type]
    for metric in (psnr, ssim):
        with pytest.raises(ValueError, match="peak must be positive"):
            metric(picture, picture, peak=0)  # type: ignore[operator]
    with pytest.raises(ValueError, match=r'must be an array of real numbers, not "a\.png"'):
        psnr("a.png", picture)  # type: ignore[arg-type]
