"""What pictures of smoke look like, with nothing to compare them with, and beside other clips."""

from __future__ import annotations

import numpy as np
import pytest
from scipy import ndimage

from smokelift.evaluation.picture_statistics import MOTION_SIDE, PictureSeries, beside_references, reduced


def clip(seed: int, blur: float = 0.0, frames: int = 4, new: bool = False) -> list[np.ndarray]:
    """Smoke with detail of some pixels that rises by two pixels a frame, or is new in every frame."""
    random = np.random.default_rng(seed)
    noise = ndimage.gaussian_filter(random.standard_normal((140, 80)), 2) * 12
    rows, columns = np.indices((120, 80))
    ball = np.exp(-(((rows - 60) / 30) ** 2) - ((columns - 40) / 16) ** 2)
    pictures = []
    for frame in range(frames):
        if new:
            noise = ndimage.gaussian_filter(random.standard_normal((140, 80)), 2) * 12
        seen = ball * (2 + noise[2 * frame : 2 * frame + 120])
        pictures.append(ndimage.gaussian_filter(seen, blur).astype(np.float32))
    return pictures


def statistics(pictures: list[np.ndarray]):
    series = PictureSeries()
    for picture in pictures:
        series.add(picture)
    return series.statistics()


def test_smoke_that_flows_beside_smoke_that_pops() -> None:
    flows, pops = (statistics(clip(1, new=new)).figures for new in (False, True))
    assert flows["flow_speed"] == pytest.approx(2, rel=0.1)
    assert flows["flow_warp_error"] < 0.3 < pops["flow_warp_error"]
    assert flows["flow_divergence"] < 0.3 * pops["flow_divergence"]
    assert flows["flicker"] < 0.7 * pops["flicker"]


def test_banded_smoke_has_detail_that_is_constant_along_rows() -> None:
    bands = [np.repeat(picture.mean(1, keepdims=True), 80, 1) for picture in clip(1)]
    plain, banded = (statistics(pictures).figures["row_constant_detail"] for pictures in (clip(1), bands))
    assert plain < 0.2
    assert banded > 0.9


def test_single_and_empty_pictures_say_less() -> None:
    assert statistics(clip(1)[:1]).figures | {"row_constant_detail": 0} == {
        "row_constant_detail": 0,
        "flicker": None,
        "flow_speed": None,
        "flow_divergence": None,
        "flow_warp_error": None,
    }
    empty = statistics([np.zeros((40, 30), np.float32)] * 3).figures
    assert empty["row_constant_detail"] is None
    assert empty["flow_speed"] is None


def test_other_smoke_is_a_reference_and_blurred_smoke_is_far_from_it() -> None:
    references = [statistics(clip(seed)) for seed in (2, 3)]
    sharp, smooth = (beside_references(statistics(clip(1, blur)), references) for blur in (0.0, 4.0))
    assert sharp["reference_distance"] < 1.5
    assert smooth["reference_distance"] > 5
    assert smooth["reference_octaves"][-1] < smooth["reference_octaves"][1] < 1
    expected = np.mean([reference.figures["row_constant_detail"] for reference in references])
    assert sharp["row_constant_detail_reference"] == pytest.approx(expected)


def test_brightness_is_no_difference_from_a_reference() -> None:
    plain, dim = statistics(clip(1)), statistics([0.1 * picture for picture in clip(1)])
    assert beside_references(dim, [plain])["reference_distance"] == pytest.approx(0, abs=1e-3)


def test_nothing_is_said_of_empty_pictures_or_without_a_reference() -> None:
    empty, plain = statistics([np.zeros((40, 30), np.float32)]), statistics(clip(1))
    for found, references in ((empty, [plain]), (plain, [empty]), (plain, [])):
        assert set(beside_references(found, references).values()) == {None}


def test_pictures_are_reduced_and_never_enlarged() -> None:
    assert reduced(np.ones((2 * MOTION_SIDE, 100), np.float32), MOTION_SIDE).shape == (MOTION_SIDE, 50)
    assert reduced(np.ones((90, 60), np.float32), MOTION_SIDE).shape == (90, 60)
