"""Exposure that flickers in front of black is told from smoke, and from flames, that change."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from films import HEIGHT, WIDTH, film, puff

from smokelift.footage.clip import Clip
from smokelift.footage.flicker import Array, evened, flicker_gains, flickers, gains_of_light
from smokelift.footage.plate import known_plate

FRAMES = 24
TIMES = np.arange(FRAMES)
EXPOSURES = 1 + 0.1 * np.random.default_rng(2).uniform(-1, 1, FRAMES)
UP_AND_DOWN = 1 + 0.1 * (-1.0) ** TIMES


def plume() -> Array:
    """The light (frames, blocks) of smoke that grows in each block in its own way."""
    phases = np.linspace(0, 3, 16)
    return 1 + 0.05 * TIMES[:, None] + 0.3 * np.sin(TIMES[:, None] / 6 + phases)


def jitter(gains: Array, true: Array) -> float:
    """The largest difference from one frame to the next that is left."""
    return float(np.abs(np.diff(np.log(gains / true))).max())


@pytest.mark.parametrize("exposures", [EXPOSURES, UP_AND_DOWN])
def test_the_exposure_of_every_frame_is_found(exposures: Array) -> None:
    light = plume() * exposures[:, None]
    assert flickers(light)
    assert jitter(np.ones(FRAMES), exposures) > 0.1
    assert jitter(gains_of_light(light.sum(1)), exposures) < 0.03


def test_smoke_that_changes_is_no_flicker() -> None:
    assert not flickers(plume())
    assert np.abs(np.diff(np.log(gains_of_light(plume().sum(1))))).max() < 0.005


@pytest.mark.parametrize("seed", range(4))
def test_flames_are_no_flicker(seed: int) -> None:
    """Each part flickers by itself."""
    assert not flickers(plume() * (1 + 0.3 * np.random.default_rng(seed).uniform(-1, 1, (FRAMES, 16))))


def test_frames_that_are_shown_twice_are_no_flicker() -> None:
    growing = np.repeat(1.08 ** np.arange(FRAMES // 2), 2)[:, None] * np.ones(16)
    assert not flickers(growing)
    assert flickers(growing * EXPOSURES[:, None])


def test_a_burst_is_the_smoke_s_and_what_flickers_around_it_is_not() -> None:
    light = np.where(TIMES < 12, 1, 5) * (1 + 0.02 * TIMES) * EXPOSURES
    assert jitter(gains_of_light(light), EXPOSURES) < 0.06


def test_frames_without_smoke_have_no_exposure() -> None:
    light = np.where(TIMES < 12, 0, 1 + 0.02 * TIMES) * EXPOSURES
    gains = gains_of_light(light)
    assert (gains[:12] == 1).all()
    assert jitter(gains[12:], EXPOSURES[12:]) < 0.06
    assert (gains_of_light(np.zeros(FRAMES)) == 1).all()


def flickering(folder: Path, behind: float) -> tuple[Clip, Clip]:
    """A steady clip of a puff before one colour, and the same with exposures."""
    clip = film(folder, np.full((HEIGHT, WIDTH, 3), behind, np.float32), puff, 0.6)
    return clip, clip.changed(lambda n, picture: picture * np.float32(UP_AND_DOWN[n % FRAMES]))


def test_a_clip_before_black_is_evened_out(tmp_path: Path) -> None:
    steady, clip = flickering(tmp_path, 0.0)
    plate = known_plate((0.0,) * 3, clip)
    gains = flicker_gains(clip, plate, len(clip) // 2)
    assert gains is not None
    even = evened(clip, gains)
    before, after = (
        np.log([changed.frame(n).sum() / steady.frame(n).sum() for n in range(8, 16)]) for changed in (clip, even)
    )
    assert np.abs(np.diff(before)).min() > 0.15
    assert np.abs(np.diff(after)).max() < 0.03


def test_clips_that_do_not_flicker_or_show_their_background_stay_as_they_are(tmp_path: Path) -> None:
    steady, _ = flickering(tmp_path, 0.0)
    assert flicker_gains(steady, known_plate((0.0,) * 3, steady), len(steady) // 2) is None
    _, clip = flickering(tmp_path, 0.2)
    assert flicker_gains(clip, known_plate((0.2,) * 3, clip), len(clip) // 2) is None
