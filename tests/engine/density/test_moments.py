"""The moments of a clip: on one screen, and how far apart two of them look unlike."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy import ndimage

from smokelift.density.moments import Moments, unlike_offset
from smokelift.density.turntable import Turntable
from smokelift.footage.clip import Clip
from smokelift.scene import Camera, Domain
from smokelift.setup.prepare import prepare_shot

SCREEN = 48, 40


def changing(frames: int, life: float) -> np.ndarray:
    """Pictures of smoke whose detail rises and is another one after so many frames."""
    random = np.random.default_rng(0)
    noise = ndimage.gaussian_filter(random.normal(size=(frames + 30, *SCREEN)), (life, 1.5, 1.5))
    noise /= noise.std()
    risen = np.stack([np.roll(picture, -n, axis=0) for n, picture in enumerate(noise[15 : 15 + frames])])
    bell = np.outer(np.hanning(SCREEN[0]), np.hanning(SCREEN[1]))
    return (bell * np.maximum(1 + 0.6 * risen, 0)).astype(np.float16)


def test_smoke_that_changes_faster_is_unlike_itself_sooner() -> None:
    """Moving on is no change."""
    fast, slow = (unlike_offset(changing(40, life)) for life in (1.0, 4.0))
    assert 1 < fast < slow <= 20


@pytest.mark.parametrize("frames", [1, 2, 3, 24])
def test_a_clip_that_never_changes_lends_from_next_door(frames) -> None:
    """However short it is: nothing further away would be less alike."""
    still = np.repeat(changing(1, 1.0), frames, axis=0)
    assert unlike_offset(still) == min(1, frames // 2)


def test_smoke_that_comes_back_lends_from_where_it_is_least_alike() -> None:
    """Half a period away, or some periods and a half."""
    there, back = changing(2, 0.1).astype(np.float64)
    period = [there + (back - there) * (1 - np.cos(2 * np.pi * n / 8)) / 2 for n in range(8)]
    assert unlike_offset(np.stack(period * 8).astype(np.float16)) % 8 in (3, 4, 5)


def test_smoke_that_keeps_its_shape_lends_from_where_that_shows() -> None:
    """A part that stays holds the likeness up; then the first moment is taken from which on nothing is gained."""
    pictures = changing(120, 1.0) + 2 * np.repeat(changing(1, 1.0), 120, axis=0)
    assert 2 <= unlike_offset(pictures) <= 8


def test_frames_without_smoke_say_nothing() -> None:
    """They neither look like others nor unlike them."""
    pictures = changing(24, 2.0)
    assert unlike_offset(np.zeros_like(pictures)) == 12
    with_gap = pictures.copy()
    with_gap[10] = 0
    assert abs(unlike_offset(with_gap) - unlike_offset(pictures)) <= 2


def moments(count: int) -> Moments:
    """Moments whose pictures say their number."""
    camera = Camera.look_at((0, -4, 0.8), (0, 0, 0.8), fov_y_degrees=27, size=(40, 56))
    turntable = Turntable.before(camera, Domain((-0.6, -0.6, 0), (0.6, 0.6, 1.6), (24, 24, 32)))
    pictures = np.ones((count, 4, 4), np.float16) * np.arange(count, dtype=np.float16)[:, None, None]
    return Moments(turntable, pictures, 6)


@pytest.mark.parametrize("offset", [2, 6, 12])
def test_what_is_lent_is_so_many_frames_away_and_changes_slowly(offset) -> None:
    """From later moments at first, from earlier ones at last, never the moment itself."""
    lent = [moments(24).apart(number, offset) for number in range(24)]
    shares = np.array([[share for share, _ in pair] for pair in lent])
    np.testing.assert_allclose(shares.sum(1), 1)
    assert (np.diff(shares[:, 0]) <= 0).all()
    assert np.abs(np.diff(shares[:, 0])).max() <= 1 / offset + 1e-9
    for number, pair in enumerate(lent):
        for (share, picture), way in zip(pair, (offset, -offset), strict=True):
            wanted = min(max(number + way, 0), 23)
            assert picture.flat[0] == wanted
            assert share <= 0.5 or wanted == number + way


def test_a_clip_of_one_frame_lends_itself() -> None:
    """There is no other."""
    assert {float(picture.flat[0]) for _, picture in moments(1).apart(0, 0)} == {0.0}


def test_the_pictures_are_those_of_the_clip(plume, draft, tracked) -> None:
    """As optical depth, upright, of a camera that stands or moves; a frame that shows nothing is empty."""
    for scene in (plume.scene, tracked):
        with Clip.open(scene.clip) as clip:
            shot = prepare_shot(clip, scene, draft)
            found = Moments.of(shot)
        assert found is not None
        assert found.pictures.shape == (shot.length, *found.turntable.shape)
        rows = np.arange(found.turntable.shape[0])
        middles = [float(picture.sum(1) @ rows / picture.sum()) for picture in found.pictures.astype(float)]
        np.testing.assert_allclose(np.diff(middles), -1.5, atol=0.5)


def test_a_clip_without_smoke_has_no_moments(plume, draft, tmp_path) -> None:
    """None, and no error."""
    empty = plume.write(tmp_path, [np.zeros_like(plume.densities[0])] * 2)
    scene = replace(plume.scene, clip=empty.clip)
    with Clip.open(scene.clip) as clip:
        assert Moments.of(prepare_shot(clip, scene, draft)) is None
