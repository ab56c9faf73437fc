"""Fakes of a side view: each is caught by one measure at least, and only the truth by none."""

from __future__ import annotations

import numpy as np
import pytest
from scipy import ndimage

from benchmarks.accuracy.fakes import fakes, measured
from benchmarks.accuracy.scenes import BakedViews
from smokelift.scene import Camera

FRAMES = 8


def clip(seed: int) -> np.ndarray:
    """Rising smoke, grey [frame, row, column]."""
    noise = ndimage.gaussian_filter(np.random.default_rng(seed).standard_normal((120, 48)), 1.5) * 5
    rows, columns = np.indices((72, 48))
    ball = np.exp(-(((rows - 36) / 20) ** 2) - ((columns - 24) / 12) ** 2)
    return np.stack([0.3 * ball * np.maximum(1 + noise[frame : frame + 72], 0) for frame in range(FRAMES)])


@pytest.fixture(scope="module")
def found() -> dict[str, dict[str, float | None]]:
    camera = Camera.look_at((0, -6, 1), (0, 0, 1), fov_y_degrees=27, size=(48, 72))
    views, other = (
        BakedViews(dict.fromkeys(("0", "45", "90"), camera), {view: clip(seed + n) for n, view in enumerate(names)})
        for seed, names in ((1, ("0", "45", "90")), (5, ("0",)))
    )
    return {name: measured(views, pictures) for name, pictures in fakes(views, other, FRAMES)}


def test_the_mean_of_all_smokes_lacks_fine_octaves(found) -> None:
    assert found["blurred truth"]["front_distance"] > found["truth"]["front_distance"] + 3


def test_copies_are_found_under_shift_mirror_and_moment(found) -> None:
    names = ("front", "front, mirrored and shifted", "the same of 6 frames later")
    assert found["front"]["detail_correlation"] == pytest.approx(1)
    for name in names[:2]:
        assert found[name]["copied_detail"] > 0.9 > found["truth"]["copied_detail"] + 0.2
    assert found[names[2]]["copied_detail_moments"] > found["truth"]["copied_detail_moments"] + 0.2


def test_noise_does_not_flow(found) -> None:
    noise = found["blurred truth with new noise in every frame"]
    assert noise["flow_warp_error"] > 3 * found["truth"]["flow_warp_error"]
    assert noise["flow_divergence"] > 3 * found["truth"]["flow_divergence"]


def test_rows_of_means_have_detail_constant_along_rows(found) -> None:
    assert found["rows of the truth's means"]["row_constant_detail"] > 2 * found["truth"]["row_constant_detail"]


def test_other_smoke_differs_in_psnr_alone(found) -> None:
    other, truth = found["front of other smoke"], found["truth"]
    assert other["psnr"] < 30
    assert other["front_distance"] < 2
    for name in ("copied_detail", "flow_warp_error", "flow_divergence", "row_constant_detail"):
        assert other[name] < 1.5 * truth[name] + 0.05
