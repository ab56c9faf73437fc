"""What is said of a background that was found."""

from __future__ import annotations

import numpy as np
import pytest

from smokelift.footage.clip import Clip
from smokelift.footage.noise import EIGHT_BIT_NOISE
from smokelift.footage.plate import Plate
from smokelift.output.images import write_image
from smokelift.setup.background import find_plates, smoke_in_plate
from smokelift.setup.smoke import SmokeSamples


def before(floor: float, folder) -> Clip:
    """A clip of a puff that rises before black, above a floor of a brightness."""
    rows, columns = np.mgrid[:72, :56]
    for n in range(12):
        smoke = 0.6 * np.clip(1.5 - np.hypot(rows - 60 + 4 * n, columns - 28) / 9, 0, 1)
        smoke[66:] = floor
        write_image(folder / f"frame_{n:02d}.png", smoke)
    return Clip.open(folder / "frame_##.png", fps=24)


@pytest.mark.parametrize(("unknown_rows", "said"), [(0, False), (20, False), (60, True)])
def test_smoke_that_may_be_in_the_plate_is_said(unknown_rows, said) -> None:
    """Where most of the smoke has no background that was ever seen."""
    confidence = np.ones((100, 50), np.float32)
    confidence[:unknown_rows] = 0
    covered = np.zeros((100, 50), np.bool_)
    covered[10:80] = True
    colours = np.zeros((0, 3), np.float32)
    plate = Plate(np.zeros((100, 50, 3), np.float32), confidence, EIGHT_BIT_NOISE)
    notes = smoke_in_plate(plate, SmokeSamples(1.0, (0, 0, 50, 100), covered, colours, colours, (0,), 0.0))
    assert bool(notes) is said
    assert not said or "75% of where smoke is or may be" in notes[0]


def test_one_colour_is_said(tmp_path) -> None:
    """Behind a puff before black."""
    found = find_plates(before(0.0, tmp_path), None, None)
    assert found.notes == ("Background not given: it is black.",)


def test_what_never_changes_before_one_colour_is_said(tmp_path) -> None:
    """It may be a floor, or smoke that stands still."""
    (note,) = find_plates(before(0.3, tmp_path), None, None).notes
    assert "it is black, but for" in note
    assert "If that is smoke" in note
