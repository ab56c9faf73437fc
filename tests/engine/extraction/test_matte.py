"""Where a frame shows smoke; fire is distinguished from colored smoke, and smoke is continued over it."""

import numpy as np
import pytest
from scipy import ndimage

from smokelift.extraction.matte import (
    FULL_DEVIATION,
    MAX_SMOOTHING,
    MIN_DEVIATION,
    SMOOTHING,
    certainty,
    fire_color,
    firelight,
    hot_pixels,
    matte,
    smoothing,
    without_fire,
)
from smokelift.extraction.plate import known_plate, without_noise_light
from smokelift.footage.images import linear_to_srgb, srgb_to_linear
from smokelift.footage.noise import Noise, lasting_noise
from tests.engine.films import HEIGHT, WIDTH, clear_plate, clip_of, film, overlap, wall


def test_smoke_over_most_of_the_picture_is_not_noise(tmp_path) -> None:
    def billows(n: int) -> np.ndarray:
        rows, columns = np.mgrid[:HEIGHT, :WIDTH]
        return np.where(columns < 0.65 * WIDTH, 0.3 + 0.25 * np.sin(rows / 4 + 0.8 * n), 0.0)

    for name, behind in (("black", np.zeros((HEIGHT, WIDTH, 3))), ("wall", wall(0.2, 0.5))):
        clip = film(tmp_path / name, behind, billows, 0.9)
        plate, _ = known_plate(behind, clip)
        assert 0.5 < plate.noise.total.mean() * 255 < 2.0
        for n in (4, 12, 20):
            assert overlap(matte(clip.frame(n), plate).mask, billows(n) > 0.002) > 0.9


def test_noise_is_smoothed_as_far_as_that_helps() -> None:
    codes = np.full(3, 1 / 255, np.float32)
    assert smoothing(lasting_noise(0.1)) == smoothing(Noise(2 * codes, codes)) == SMOOTHING
    assert SMOOTHING < smoothing(Noise(10 * codes, codes)) < MAX_SMOOTHING
    assert smoothing(Noise(50 * codes, codes)) == MAX_SMOOTHING


def test_faint_smoke_is_seen_in_noise(tmp_path) -> None:
    rows, columns = np.mgrid[:HEIGHT, :WIDTH]
    veil = np.where(np.hypot(rows - 36, columns - 28) < 16, 0.09, 0.0)
    truth = wall(0.2, 0.3)
    clip = film(tmp_path, truth, lambda n: veil, 0.6, 25.0)
    plate, _ = known_plate(truth, clip)
    found = matte(without_noise_light(clip, plate.noise).frame(5), plate).mask
    assert overlap(found, veil > 0) > 0.7


@pytest.mark.parametrize("noise", [1.0, 3.0, 8.0])
def test_a_faint_rim_counts_as_far_as_it_is_certain(noise) -> None:
    """It falls to nothing with the light. A veil by itself is as certain, and a clear background has none."""
    columns = np.broadcast_to(np.arange(260), (120, 260))
    light = np.where(columns < 40, 25 * noise, 6 * noise * np.clip((100 - columns) / 60, 0, 1))
    light[:, 200:220] = 3 * noise
    values = np.random.default_rng(0).normal(40 + light, noise)[..., None].repeat(3, -1)
    plate = clear_plate(np.full((120, 260, 3), srgb_to_linear(40 / 255)), noise)
    found = matte(srgb_to_linear((values / 255).astype(np.float32)), plate)
    probability = found.probability.mean(0)
    assert (found.probability[found.mask] == 1).all()
    wanted = np.clip((light[0, :120] / noise - MIN_DEVIATION) / (FULL_DEVIATION - MIN_DEVIATION), 0, 1)
    np.testing.assert_allclose(probability[:120], wanted, atol=0.2)
    assert np.diff(probability[45:95:5]).max() < 0.02
    assert probability[204:216].mean() > 0.8
    assert not probability[105:190].any() and not probability[230:].any()


def test_noise_is_hardly_ever_smoke() -> None:
    random = np.random.default_rng(0)
    alarms = 0
    for size in ((40, 60), (120, 260)):
        plate = clear_plate(np.full((*size, 3), 0.2), 2)
        encoded = linear_to_srgb(plate.image)
        for _ in range(50):
            # as neighbors share it
            shared = ndimage.gaussian_filter(random.standard_normal(size), SMOOTHING) * SMOOTHING * np.sqrt(4 * np.pi)
            noisy = encoded + np.float32(2 / 255) * shared[..., None].astype(np.float32)
            alarms += bool(matte(srgb_to_linear(noisy), plate).probability.any())
    assert alarms <= 1


def test_a_speck_has_to_be_stronger_than_a_veil() -> None:
    plate = clear_plate(np.full((120, 160, 3), 0.2))
    for side, codes, found in ((40, 3, True), (6, 3, False), (6, 30, True)):
        encoded = linear_to_srgb(plate.image)
        encoded[50 : 50 + side, 50 : 50 + side] += np.float32(codes / 255)
        assert matte(srgb_to_linear(encoded), plate).probability.any() == found


def test_noise_that_a_patch_shares_is_as_likely_in_a_wide_one() -> None:
    """Unlike other noise; what is beyond all that such noise may be is smoke, and so is what lies beside that."""
    deviation = np.zeros((120, 160), np.float32)
    deviation[20:100, 20:140] = 3
    assert certainty(deviation, 2.0)[60, 80] == 1
    assert not certainty(deviation, 2.0, 1.0).any()
    assert certainty(deviation, 2.0, np.full(deviation.shape, 0.3))[60, 80] == 1
    deviation[40:80, 40:80] = 20
    assert certainty(deviation, 2.0, 1.0)[60, 120] == 1


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


def fire_fraction(*seen) -> float:
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
    assert 0.01 < fire_fraction(*pixels(**what)) < (1 if what else 0.3)


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
    [{"flame": 0.2 * np.array(FLAME)}, {"flame": 0.6 * np.array((1, 0.8, 0.5)), "smoke": np.full(3, 0.1)}],
    ids=["faint", "pale"],
)
def test_faint_and_pale_flames_may_be_fire(what) -> None:
    hot = hot_pixels(*pixels(**what))
    assert (hot.burn, hot.may_burn) == (False, True)


def test_no_smoke_is_no_fire() -> None:
    assert not hot_pixels(*np.zeros((2, 0, 3), np.float32)).may_burn


@pytest.mark.parametrize(
    "what",
    [{"flame": np.zeros(3)}, {"smoke": np.array((0.9, 0.45, 0.1)), "flame": np.zeros(3)}, {"flame": np.ones(3)}],
    ids=["no flame", "orange smoke", "white light"],
)
def test_what_is_no_fire(what) -> None:
    assert fire_fraction(*pixels(**what)) == 0
    assert not hot_pixels(*pixels(**what)).may_burn


def test_gray_smoke_before_a_red_wall_and_a_blue_sky_may_not_be_fire() -> None:
    """What shines through smoke is not its own, and what gray smoke takes of a blue sky makes none red."""
    opacity = np.linspace(0, 1, 1000, dtype=np.float32)[:, None]
    for color in ((0.6, 0.2, 0.05), (0.2, 0.4, 0.7)):
        behind = np.tile(np.float32(color), (1000, 1))
        for smoke in (0.1, 0.5, 0.9):
            assert not hot_pixels(behind * (1 - opacity) + smoke * opacity, behind).may_burn


def test_a_bright_wall_behind_thin_smoke_is_no_fire() -> None:
    wall = np.broadcast_to(np.float32((0.9, 0.5, 0.2)), (100, 3))
    colors = np.concatenate([0.9 * wall + 0.006, np.full((50, 3), 0.06, np.float32)])
    behind = np.concatenate([wall, np.zeros((50, 3), np.float32)])
    assert fire_fraction(colors, behind) == 0


def test_what_is_added_to_the_background_counts() -> None:
    sky, land = np.full((90, 3), 0.45, np.float32), np.full((10, 3), 0.02, np.float32)
    flames = np.broadcast_to(np.float32((0.95, 0.35, 0.08)), (10, 3))
    seen = np.concatenate([0.7 * sky + 0.02, flames])
    assert fire_fraction(seen, np.concatenate([sky, land])) == pytest.approx(0.1)
    assert fire_fraction(seen, np.concatenate([sky, 0.9 * flames])) == 0


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
