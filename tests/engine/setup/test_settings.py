"""Settings: presets differ as they say, bad values are refused, and JSON can hold them."""

import itertools
import json
from dataclasses import replace

import pytest

from smokelift.setup.settings import LIMITS, LOST_DETAIL, QUALITIES, Settings


def test_better_qualities_cost_more() -> None:
    presets = [Settings.preset(quality) for quality in QUALITIES]
    for less, more in itertools.pairwise(presets):
        for pixels in (300, 600, 4000):
            assert LIMITS[less.quality].voxels(pixels) < LIMITS[more.quality].voxels(pixels)
        assert LOST_DETAIL[less.quality] > LOST_DETAIL[more.quality]
        assert less.density.fit_iterations <= more.density.fit_iterations
        assert less.density.descent_iterations <= more.density.descent_iterations


@pytest.mark.parametrize(
    ("pixels", "allowed"),
    [(40, (40, 40, 40, 40)), (128, (64, 96, 128, 128)), (360, (64, 120, 180, 360)), (2000, (64, 128, 256, 2000))],
)
def test_qualities_are_shares_of_the_clips_pixels(pixels, allowed) -> None:
    """Never more than one voxel per pixel; a small clip gets all that it has, a large one no more than can be
    afforded."""
    assert tuple(LIMITS[quality].voxels(pixels) for quality in QUALITIES) == allowed


def test_detail_is_made_up_unless_somebody_measures() -> None:
    assert (Settings.preset().detail, Settings.preset().seed) == (1.0, 0)
    assert Settings.preset(method="paper").detail == 0
    with pytest.raises(ValueError, match="detail"):
        replace(Settings.preset(method="paper"), detail=0.5)


@pytest.mark.parametrize(("quality", "method"), [*((quality, "default") for quality in QUALITIES), ("draft", "paper")])
def test_json_holds_all_settings(quality, method) -> None:
    settings = Settings.preset(quality, method, (16, 16, 24))
    read = json.loads(json.dumps(settings.as_dict(), allow_nan=False))
    assert (read["quality"], read["method"], read["resolution"]) == (quality, method, [16, 16, 24])
    assert (read["detail"], read["seed"]) == (settings.detail, settings.seed)
    assert read["density"]["descent_iterations"] == settings.density.descent_iterations
    assert read["velocity"]["smoothness"] == settings.velocity.smoothness


@pytest.mark.parametrize(
    ("values", "words"),
    [
        ({"method": "best"}, "method"),
        ({"quality": "ultra"}, "quality"),
        ({"transport": 1.5}, "transport"),
        ({"transport": float("nan")}, "transport"),
        ({"distance": float("inf")}, "distance"),
        ({"detail": -0.1}, "detail .* -0.1"),
        ({"seed": -1}, "seed .* -1"),
        ({"resolution": (7, 64, 64)}, "resolution"),
        ({"resolution": (64, 64)}, "resolution"),
        ({"resolution": 64}, "resolution .* 64"),
        ({"detail": "1"}, 'detail .* "1"'),
        ({"distance": "0.1"}, 'distance .* "0.1"'),
    ],
)
def test_bad_values_are_refused(values, words) -> None:
    with pytest.raises(ValueError, match=words):
        Settings(**values)
