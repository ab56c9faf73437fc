"""The focal length of a camera that turns."""

from __future__ import annotations

from dataclasses import replace

import pytest
from scipy.spatial.transform import Rotation
from turning_camera import LENS, clip_of, pan, pictures, shake, wall

from smokelift.footage.alignment import Lens
from smokelift.footage.focal_length import FocalLength, focal_length
from smokelift.footage.turning import Turns, find_turns


def supposed(scale: float) -> Lens:
    return FocalLength(scale, 0.0).of(LENS)


@pytest.mark.parametrize("scale", [0.7, 1.5])
def test_it_is_found_from_a_wrong_one(scale: float) -> None:
    """Behind smoke, within what it says of itself."""
    frames, _ = pictures(wall(), pan(30), smoke=0.5)
    turns = find_turns(clip_of(frames), supposed(scale))
    assert turns is not None
    found = focal_length(clip_of(frames), turns)
    assert found is not None
    assert found.determined
    assert found.of(turns.lens).focal[0] == pytest.approx(LENS.focal[0], rel=max(3 * found.deviation, 0.01))


def test_what_hardly_turns_does_not_tell() -> None:
    frames, _ = pictures(wall(), shake(3), smoke=0.9)
    found = focal_length(clip_of(frames), Turns(LENS, shake(3)))
    assert found is None or not found.determined


def test_smoke_alone_does_not_tell() -> None:
    """Where what is seen is not what turned, the pairs do not agree."""
    frames, _ = pictures(wall(), Rotation.identity(len(pan(30))), smoke=1.0, noise=6.0)
    found = focal_length(clip_of(frames), Turns(LENS, pan(30)))
    assert found is None or not found.determined


def test_a_lens_keeps_all_but_its_focal_length() -> None:
    assert FocalLength(0.5, 0.01).of(LENS) == replace(LENS, focal=(100.0, 100.0))
