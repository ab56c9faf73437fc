"""Whether the camera of a clip turned, and how."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from turning_camera import COUNT, LENS, clip_of, off, pan, pictures, shake, wall

from smokelift.footage.turning import Turns, file_turns, find_turns
from smokelift.scene import Camera
from smokelift.scene.projection import project


@pytest.mark.parametrize("turns", [shake(3), pan(60)], ids=["shake", "pan"])
def test_turns_are_found_behind_smoke(turns: Rotation) -> None:
    """To a tenth of a pixel in every corner of every frame."""
    frames, _ = pictures(wall(), turns, smoke=0.9)
    found = find_turns(clip_of(frames), LENS)
    assert found is not None
    assert off(found.rotations, turns) < 0.1
    assert found.farthest == pytest.approx(Turns(LENS, turns).farthest, abs=0.1)


@pytest.mark.parametrize(("smoke", "noise"), [(0.0, 1.0), (1.0, 1.0), (1.0, 12.0)])
def test_a_still_camera_stays_still(smoke: float, noise: float) -> None:
    """However the smoke moves before it, and however noisy it is."""
    frames, _ = pictures(wall(), Rotation.identity(COUNT), smoke, noise)
    assert find_turns(clip_of(frames), LENS) is None


def test_some_frames_prove_that_a_camera_stands_still(monkeypatch: pytest.MonkeyPatch) -> None:
    """Most are not examined."""
    frames, _ = pictures(wall(), Rotation.identity(COUNT), smoke=1.0)
    clip, looks = clip_of(np.repeat(frames, 4, axis=0)), set[int]()
    monkeypatch.setattr(clip, "frame", lambda n, frame=clip.frame: looks.add(n) or frame(n))
    assert find_turns(clip, LENS) is None
    assert len(looks) <= 12


@pytest.mark.parametrize("first", [2, COUNT - 2])
def test_a_camera_that_moves_for_a_moment_is_found(first: int) -> None:
    """Whenever that is."""
    angles = np.zeros((COUNT, 3))
    angles[first : first + 2, 1] = 0.02
    frames, _ = pictures(wall(), Rotation.from_rotvec(angles), smoke=0.9)
    assert find_turns(clip_of(frames), LENS) is not None


def test_smoke_before_one_colour_is_no_camera() -> None:
    """Its texture is all there is, and rises."""
    frames, _ = pictures(np.full_like(wall(), 0.02), shake(3), smoke=1.0)
    assert find_turns(clip_of(frames), LENS) is None


def test_a_longer_lens_is_tried_where_the_first_explains_nothing() -> None:
    turns = pan(60)
    frames, _ = pictures(wall(), turns, smoke=0.9)
    wide, long = (replace(LENS, focal=(scale * 200, scale * 200)) for scale in (0.4, 1.2))
    found = find_turns(clip_of(frames), wide, long)
    assert found is not None
    assert found.lens == long


def test_one_frame_shows_no_motion() -> None:
    frames, _ = pictures(wall(), Rotation.identity(1))
    assert find_turns(clip_of(frames), LENS) is None


def test_a_camera_carries_the_turns() -> None:
    """A point of the world lies where its direction does in each frame."""
    turns = Turns(LENS, shake(10))
    mean = Camera.look_at((1, -4, 1), (0, 0, 0.8), fov_y_degrees=2 * np.degrees(np.arctan(0.3)), size=LENS.size)
    moving = turns.carried(mean)
    assert moving.matrix == moving.matrices[0]
    point = np.array([[0.1, 0.2, 0.6]])
    where, _ = project(mean, point)
    for frame, turn in enumerate(turns.rotations):
        seen, _ = project(moving.at(frame), point)
        np.testing.assert_allclose(LENS.pixels(turn.apply(LENS.rays(seen))), where, atol=1e-6)


def test_the_rest_of_the_file_is_followed_in_the_clips_pose() -> None:
    """Before it and after it, to a tenth of a pixel."""
    turns = pan(60)
    frames, _ = pictures(wall(), turns, smoke=0.9)
    clip, own = clip_of(frames).part(4, 7), turns[4:8]
    found = file_turns(clip, Turns(LENS, own.mean().inv() * own))
    assert sorted(found) == list(range(len(turns)))
    assert off(Rotation.concatenate([found[n] for n in range(len(turns))]), own.mean().inv() * turns) < 0.1


def test_a_cut_ends_what_is_followed() -> None:
    turns = shake(3)
    frames, _ = pictures(wall(), turns)
    frames[9:] = frames[9:, ::-1]
    found = file_turns(clip_of(frames).part(3, 6), Turns(LENS, turns[3:7]))
    assert sorted(found) == list(range(9))
