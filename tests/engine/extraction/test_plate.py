"""The plate of a background that is known, once or frame by frame, and clips brought to it."""

from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from smokelift import Background, Clip
from smokelift.extraction.find_background import find_background
from smokelift.extraction.matte import matte
from smokelift.extraction.plate import FINEST, finest_detail, known_plate, without_noise_light
from smokelift.footage.images import srgb_to_linear
from smokelift.output.images import write_image
from tests.engine.films import (
    COUNT,
    HEIGHT,
    WIDTH,
    codes_apart,
    encode,
    film,
    overlap,
    pan,
    passing_wall,
    plate_of,
    puff,
    wall,
)


def test_what_does_not_fit_is_refused(tmp_path) -> None:
    write_image(tmp_path / "still.png", wall(0.2, 0.8))
    clip = Clip.open(tmp_path / "still.png")
    plate = plate_of(clip)
    for picture in (clip.frame(0)[1:], clip.frame(0) * np.nan):
        with pytest.raises(ValueError):
            matte(picture, plate)
    for background in ((1.0, 2.0), np.full((4, 4, 3), np.nan), np.ones((4, 4))):
        with pytest.raises(ValueError):
            known_plate(background, clip)


def test_a_plate_for_every_frame_of_the_clips_file(tmp_path) -> None:
    """Each frame has its own, the noise is that of the difference, and the smoke is found before it."""
    wide = passing_wall()
    pan(tmp_path / "clip", wide, 1.0)
    plates = pan(tmp_path / "plate", wide, 0.0)
    for first in (0, 4):
        clip = Clip.open(tmp_path / "clip" / "frame_###.png", fps=24, frames=(first, 20))
        changing, _ = known_plate(plates, clip)
        for n in (4, 12, 20):
            plate = changing.at(n - first)
            assert codes_apart(plate.image, wide[:, 2 * n : 2 * n + WIDTH]).max() < 6
            assert plate.noise.total.mean() < 2.5 / 255
            mask = matte(clip.frame(n - first), plate).mask
            assert mask[puff(n) > 0.3].mean() > 0.95
            assert mask[puff(n) == 0.0].mean() < 0.08
    few = Clip.open(tmp_path / "plate" / "frame_###.png", fps=24, frames=(0, 12))
    with pytest.raises(ValueError, match="13 of the frames 0 to 20"):
        known_plate(few, clip)


@pytest.mark.parametrize("pixels", ["yuv420p", "yuv422p", "yuv444p"])
def test_a_given_plate_has_the_colors_of_the_clips_file(tmp_path, pixels) -> None:
    """A video with one color for several pixels shows saturated edges elsewhere than the picture that was filmed."""
    codes = np.full((HEIGHT, WIDTH, 3), 90, np.uint8)
    codes[HEIGHT // 3 : 2 * HEIGHT // 3 + 1, WIDTH // 3 : 2 * WIDTH // 3 + 1] = (20, 40, 220)
    smoky = codes.copy()
    smoky[HEIGHT // 2 :, : WIDTH // 2] = codes[HEIGHT // 2 :, : WIDTH // 2] // 4 + 170
    path = encode(tmp_path / "clip.mp4", [codes] + [smoky] * 11, pixels=pixels)
    picture = srgb_to_linear(codes / np.float32(255))
    picture[0, 0] = 3.0  # a lamp, brighter than the file's white
    with Clip.open(path) as clip:
        (plate, _), filmed = known_plate(picture, clip), clip.frame(0)
        off = [np.sqrt(np.mean(codes_apart(each[1:], filmed[1:]) ** 2)) for each in (picture, plate.image)]
        assert off[1] <= 0.2 * off[0]
        assert plate.image[0, 0].min() > 2.5
        np.testing.assert_array_equal(known_plate(picture, clip, filmed=True)[0].image, picture)


@pytest.mark.parametrize("codes", [0.0, 13.0, 51.0])
def test_smoke_is_found_before_a_noisy_black(tmp_path, codes) -> None:
    """Noise that is clipped at black raises its mean, which is neither smoke nor a lack of certainty."""
    clip = film(tmp_path, np.zeros((HEIGHT, WIDTH, 3), np.float32), puff, 0.5, codes)
    plate, _ = known_plate((0.0, 0.0, 0.0), clip)
    assert plate.confidence.min() == 1.0
    np.testing.assert_allclose(codes_apart(plate.image, np.zeros_like(plate.image)), 0.4 * codes, rtol=0.1)
    assert plate.noise.lasting.max() * 255 < max(0.15 * codes, 1.001)
    quiet = without_noise_light(clip, plate.noise)
    behind = replace(known_plate((0.0, 0.0, 0.0), quiet)[0], noise=plate.noise)
    for n in (8, 12):
        for picture, known in ((clip.frame(n), plate), (quiet.frame(n), behind)):
            mask = matte(picture, known).mask
            assert mask[puff(n) > 0.5].mean() > 0.95
            assert mask[puff(n) == 0.0].mean() < 0.1


def test_every_frame_gets_the_exposure_of_its_background(tmp_path) -> None:
    """After a step in the middle and in a flash, and the smoke of no frame is lost."""
    truth = wall(0.2, 0.5)
    clip = film(tmp_path, truth, puff, 0.6)
    changing = clip.changed(lambda n, picture: picture * (1.5 if n == 4 else 1.0 if n < COUNT // 2 else 0.7))
    _, even = known_plate(truth, changing)
    found = find_background(changing, None, None)
    for n, gain in ((4, 1.5), (8, 1.0), (20, 0.7)):
        assert np.median(codes_apart(even.frame(n), clip.frame(n))) < 1.5
        np.testing.assert_allclose(even.gain(n), gain, rtol=0.02)
        assert overlap(matte(found.clip.frame(n), found.plate).mask, puff(n) > 0.05) > 0.7


def test_noise_does_not_brighten_a_clip(tmp_path) -> None:
    """The mean of noisy sRGB values is brighter in linear light, and what is brighter would count as smoke."""
    truth = wall(0.2, 0.6)
    noisy = film(tmp_path, truth, lambda n: np.zeros(truth.shape[:2]), 0.6, 25.0)
    quiet = without_noise_light(noisy, known_plate(truth, noisy)[0].noise)
    before, after = (np.mean(list(clip), axis=(0, 1, 2)) - truth.mean((0, 1)) for clip in (noisy, quiet))
    assert before.min() > 0.005
    assert np.abs(after).max() < 0.1 * before.min()


@pytest.mark.parametrize(("quantizer", "finest"), [(10.0, 2.0), (18.0, 2.0), (28.0, 4.0), (50.0, 8.0), (None, 2.83)])
def test_a_coarse_codec_keeps_coarse_detail_alone(monkeypatch, quantizer, finest) -> None:
    monkeypatch.setattr("smokelift.extraction.plate.median_quantizer", lambda path: quantizer)
    assert finest_detail(SimpleNamespace(path=Path("clip.mp4"))) == pytest.approx(finest, abs=0.01)
    assert finest_detail(SimpleNamespace(path=Path("clip_####.png"))) == 2.0


@pytest.mark.parametrize("how", ["picture", "frame", "color", "found"])
def test_a_codec_tells_of_given_pictures_alone(tmp_path, monkeypatch, how) -> None:
    """One color has no detail, and a plate that many frames show has lost what they have."""
    monkeypatch.setattr("smokelift.extraction.find_background.finest_detail", lambda clip: 5.0)
    behind = wall(0.1, 0.5)
    write_image(tmp_path / "wall.png", behind)
    given = {
        "picture": Background(image=tmp_path / "wall.png"),
        "frame": Background(frame=(0,)),
        "color": Background(color=(0.1, 0.1, 0.1)),
        "found": None,
    }[how]
    plate = find_background(film(tmp_path, behind, puff, 0.6), None, given).plate
    assert plate.finest == (5.0 if how in ("picture", "frame") else FINEST)
