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


def test_blur_lacks_edges_and_texture(found) -> None:
    blurred = found["blurred truth"]
    assert blurred["patches"] > 0.2 and blurred["edges"] < 0.9


def test_rows_of_means_have_other_edges(found) -> None:
    assert abs(found["rows of the truth's means"]["edges"] - 1) > 0.1


def test_noise_flickers(found) -> None:
    assert found["blurred truth with new noise in every frame"]["flicker"] > 2


def test_other_smoke_of_the_kind_differs_in_psnr_alone(found) -> None:
    other = found["front of other smoke"]
    assert other["psnr"] < 30
    assert other["patches"] < 1.5 * found["front"]["patches"]
    assert other["edges"] == pytest.approx(1, abs=0.2)
    assert other["flicker"] == pytest.approx(1, abs=0.3)
