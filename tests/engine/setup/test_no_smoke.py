"""What is said of clips in which no smoke is found."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from smokelift.footage.clip import Clip
from smokelift.footage.noise import lasting_noise
from smokelift.footage.plate import Plate
from smokelift.output.images import write_image
from smokelift.setup.no_smoke import nothing_seen, what_helps
from smokelift.setup.smoke import sample_smoke


@pytest.fixture
def wall(tmp_path):
    """A clip of four frames of a grey wall, and its plate."""
    picture = np.full((24, 32, 3), 0.2, np.float32)
    for n in range(4):
        write_image(tmp_path / f"wall_{n}.png", picture)
    with Clip.open(tmp_path / "wall_#.png") as clip:
        yield clip, Plate(clip.frame(0), np.ones((24, 32), np.float32), lasting_noise(1 / 255))


def test_how_many_frames_were_looked_at_is_said(wall) -> None:
    """And what helps."""
    clip, plate = wall
    said, advice = nothing_seen(clip, plate, sample_smoke(clip, plate), given=False, cuts=())
    assert "No smoke found in the 4 frames that were looked at" in said
    assert "give a clean plate, or a colour" in advice


def test_nothing_is_said_of_smoke(wall) -> None:
    """Where the plate is darker than the clip."""
    clip, plate = wall
    image = plate.image.copy()
    image[6:18, 8:24] *= 0.5
    dark = replace(plate, image=image)
    assert nothing_seen(clip, dark, sample_smoke(clip, dark), given=False, cuts=()) == ()


def test_the_background_that_is_given_is_doubted(wall) -> None:
    """Nothing else is asked for."""
    assert "Check the background that is given" in what_helps(*wall, given=True, cuts=())


def test_a_cut_is_said_before_all_else(wall) -> None:
    """No background fits both of its sides."""
    clip, plate = wall
    said = nothing_seen(clip, plate, sample_smoke(clip, plate), given=True, cuts=("There is a cut.",))
    assert said[1:] == ("There is a cut.",)


def test_one_frame_shows_no_background(wall) -> None:
    """A photograph of smoke."""
    clip, plate = wall
    assert "One frame alone does not show" in what_helps(clip.part(2, 2), plate, given=False, cuts=())


@pytest.mark.parametrize(("codes", "moves"), [(5, False), (20, True)])
def test_a_background_that_changes_may_be_that_of_a_camera_that_moves(wall, codes, moves) -> None:
    """More than noise does."""
    clip, plate = wall
    said = what_helps(clip, replace(plate, noise=lasting_noise(codes / 255)), given=False, cuts=())
    assert ("track it in Blender" in said) is moves
    assert (f"by {codes} of 255" in said) is moves
