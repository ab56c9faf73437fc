"""Where a frame shows smoke."""

import numpy as np
import pytest
from scipy import ndimage

from smokelift.extraction.matte import (
    FULL_DEVIATION,
    MAX_SMOOTHING,
    MIN_DEVIATION,
    SMOOTHING,
    certainty,
    matte,
    smoothing,
)
from smokelift.extraction.plate import known_plate, without_noise_light
from smokelift.footage.images import linear_to_srgb, srgb_to_linear
from smokelift.footage.noise import Noise, lasting_noise
from tests.engine.films import HEIGHT, WIDTH, clear_plate, film, overlap, wall


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
