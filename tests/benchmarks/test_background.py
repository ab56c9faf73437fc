"""Clips before known backgrounds: what they show, and the figures of a background and of a run."""

import numpy as np
import pytest

from benchmarks.background.__main__ import plate_score as score
from benchmarks.background.cases import CASES, with_column
from benchmarks.baked import Baked
from benchmarks.measure import optical_mass
from smokelift.extraction.plate import known_plate
from smokelift.footage.images import linear_to_srgb
from tests.benchmarks.ball import cameras, scene

COUNT, GRID, SIZE = 40, (8, 8, 12), (32, 48)


@pytest.fixture(scope="module")
def ball() -> Baked:
    """A ball of smoke that grows, seen from two sides."""
    x, y, z = np.meshgrid(*((np.arange(n) + 0.5) / n - 0.5 for n in GRID), indexing="ij")
    grows = 0.05 + 0.05 * np.arange(COUNT)[:, None, None, None] / COUNT
    densities = np.maximum(1 - (x**2 + y**2 + z**2) / grows, 0).astype(np.float32)
    return Baked("ball", scene(GRID, SIZE, 3), cameras(SIZE), {}, densities).pictured()


@pytest.mark.parametrize("name", ["wall, given", "wall, 12 frames", "both ways"])
def test_a_clip_shows_smoke_before_its_background(ball, name) -> None:
    case = CASES[name]
    clip, clean = case.clip(ball.front), case.clean(ball.front)
    assert len(clip) == len(clean)
    assert np.abs(linear_to_srgb(clip.frame(8)) - linear_to_srgb(clean[8])).max() < 0.51 / 255


def test_a_column_adds_mass_and_is_there_in_all_frames(ball) -> None:
    column = with_column(ball)
    least = (1 - column.front.transmittance).min(0)
    assert (least > 0.3).any(axis=1).mean() > 0.75  # in every row that shows the box
    assert optical_mass(column.scene, column.densities) > 1.2 * optical_mass(ball.scene, ball.densities)
    assert column.front.radiance[0] != pytest.approx(column.front.radiance[-1], abs=0.01)


def test_the_true_background_has_no_error_and_a_bright_one_takes_light(ball) -> None:
    case = CASES["wall, given"]
    clip, background, clean = case.clip(ball.front), case.background(ball.front), case.clean(ball.front)
    plate, shown = known_plate(background, clip)
    true = score(shown, plate, background, clean)
    assert true["plate"] < 0.5 and true["lost"] < 0.01 and true["missed"] < 0.01
    plate, shown = known_plate(background + np.float32(0.05), clip)
    wrong = score(shown, plate, background, clean)
    assert wrong["plate"] > 5 and wrong["lost"] > 0.2
