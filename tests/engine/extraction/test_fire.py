"""Fire is distinguished from colored smoke, and smoke is continued over it."""

import numpy as np
import pytest

from smokelift.extraction.fire import fire_color, firelight, hot_pixels, without_fire
from smokelift.extraction.plate import known_plate
from tests.engine.films import clip_of

ROWS, COLUMNS = 48, 64
FLAME, SMOKE = (1.0, 0.45, 0.08), 0.06


def picture(number: int, flame=FLAME, smoke=(SMOKE,) * 3, behind=0.0) -> np.ndarray:
    """A column of smoke, wavering, with a flame at its base."""
    y, x = np.mgrid[:ROWS, :COLUMNS]
    opacity = 0.9 * np.exp(-(((x - 32 - np.sin(number + y / 5)) / 9) ** 2))[..., None]
    fire = np.exp(-(((x - 32) / 4) ** 2) - ((y - 46) / 8) ** 2)[..., None]
    return np.asarray(behind * (1 - opacity) + opacity * smoke + 1.5 * fire * flame, np.float32).clip(0, 1)


def pixels(**what):
    """All pixels of a frame that show smoke, and black behind them."""
    seen = picture(1, **what)
    seen = seen[seen.max(-1) > 0.01]
    return seen, np.zeros_like(seen)


def fire_share(*seen) -> float:
    """The share of the pixels that is fire."""
    hot = hot_pixels(*seen)
    return hot.fraction * hot.burn


@pytest.mark.parametrize(
    "what",
    [{}, {"flame": 8 * np.array(FLAME)}, {"smoke": np.full(3, 0.5)}, {"smoke": np.zeros(3)}],
    ids=["dark smoke", "clipped to yellow", "bright smoke", "no smoke"],
)
def test_a_flame_is_fire_whatever_the_smoke_is(what) -> None:
    """Also a core that is clipped to yellow, which is no bright smoke."""
    assert 0.01 < fire_share(*pixels(**what)) < (1 if what else 0.3)


@pytest.mark.parametrize(
    ("bright", "burns", "may_burn"), [(0, False, False), (18, False, True), (30, True, True)], ids=str
)
def test_fire_of_which_little_is_bright_may_be_fire(bright, burns, may_burn) -> None:
    """A hundred pixels of fire, some of them as bright as white, in smoke that is as bright as most of them."""
    flames = np.tile(np.float32((0.75, 0.3, 0.06)), (100, 1))
    flames[:bright] *= 1.25
    seen = np.concatenate([flames, np.full((900, 3), 0.5, np.float32)])
    hot = hot_pixels(seen, np.zeros_like(seen))
    assert (hot.fraction, hot.bright) == (pytest.approx(0.1), pytest.approx(bright / 100))
    assert (hot.burn, hot.may_burn) == (burns, may_burn)


@pytest.mark.parametrize(
    "what",
    [{"flame": np.zeros(3)}, {"smoke": np.array((0.9, 0.45, 0.1)), "flame": np.zeros(3)}, {"flame": np.ones(3)}],
    ids=["no flame", "orange smoke", "white light"],
)
def test_what_is_no_fire(what) -> None:
    assert fire_share(*pixels(**what)) == 0


def test_a_bright_wall_behind_thin_smoke_is_no_fire() -> None:
    wall = np.broadcast_to(np.float32((0.9, 0.5, 0.2)), (100, 3))
    colors = np.concatenate([0.9 * wall + 0.006, np.full((50, 3), 0.06, np.float32)])
    behind = np.concatenate([wall, np.zeros((50, 3), np.float32)])
    assert fire_share(colors, behind) == 0


def test_what_is_added_to_the_background_counts() -> None:
    sky, land = np.full((90, 3), 0.45, np.float32), np.full((10, 3), 0.02, np.float32)
    flames = np.broadcast_to(np.float32((0.95, 0.35, 0.08)), (10, 3))
    seen = np.concatenate([0.7 * sky + 0.02, flames])
    assert fire_share(seen, np.concatenate([sky, land])) == pytest.approx(0.1)
    assert fire_share(seen, np.concatenate([sky, 0.9 * flames])) == 0


def test_smoke_is_continued_over_fire_and_stays_elsewhere(tmp_path) -> None:
    clip = clip_of(tmp_path, map(picture, range(4)))
    dark = without_fire(clip, known_plate(np.zeros(3), clip)[0])
    seen, before = dark.frame(2), clip.frame(2)
    assert before[40:, 28:36].max() > 0.9
    assert seen.max() < 2 * SMOKE
    assert seen[46, 32].min() > 0.2 * SMOKE
    np.testing.assert_array_equal(seen[:20], before[:20])


def test_the_light_of_fire_is_what_it_adds_to_the_smoke(tmp_path) -> None:
    """Where it is and nowhere else, in its own color; the smoke that is continued is thinner than that in the fire."""
    with clip_of(tmp_path, map(picture, range(3)), ".exr") as clip:
        light = firelight(clip, without_fire(clip, known_plate(np.zeros(3), clip)[0]))
        assert fire_color(clip, light) == pytest.approx(FLAME, abs=0.04)
        added = light.frame(1)
        np.testing.assert_allclose(added[44, 32], picture(1)[44, 32] - SMOKE, atol=0.045)
        assert not added[:20].any() and added.min() == 0


def test_fire_is_found_in_frames_of_any_exposure(tmp_path) -> None:
    """In a frame at half the exposure fire adds too little light, before it is exposed as the others are."""
    behind = 0.1 + 0.1 * np.random.default_rng(0).uniform(size=(ROWS, COLUMNS, 1)).repeat(3, 2)
    shown = [picture(n, behind=behind) * (0.45 if n == 2 else 1.0) for n in range(4)]
    with clip_of(tmp_path, shown, ".exr") as clip:
        plate, exposed = known_plate(behind, clip)
        dark = without_fire(exposed, plate)
        assert exposed.gain(2) == pytest.approx(0.45, rel=0.02)
        assert dark.frame(2).max() < 0.3
        np.testing.assert_allclose(dark.frame(2)[:20], picture(2, behind=behind)[:20], rtol=0.03)
