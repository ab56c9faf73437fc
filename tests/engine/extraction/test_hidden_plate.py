"""A plate whose middle no frame shows clear, before which smoke drifts or stands."""

from dataclasses import replace

import numpy as np
import pytest

from smokelift.extraction import hidden_plate
from smokelift.extraction.hidden_plate import SomeFrames, in_turn, is_known, likeliest_plate, plate_and_source
from smokelift.extraction.plate import Plate
from smokelift.footage.images import Picture, area_average, blurred
from smokelift.footage.noise import EIGHT_BIT_NOISE

COLUMNS, ROWS, FRAMES, SIDE = 128, 106, 5, 64
SOURCE = np.array([0.6, 0.58, 0.55], np.float32)
X, Y = np.meshgrid(np.arange(0, 192, 1.5), np.arange(0, 159, 1.5))


@pytest.fixture(autouse=True)
def few_cells(monkeypatch) -> None:
    """Of two pixels along a side."""
    monkeypatch.setattr(hidden_plate, "SIDE", SIDE)


class Pictures:
    """A clip of linear pictures; what `SomeFrames` reads of one."""

    fps, size = 24.0, (COLUMNS, ROWS)

    def __init__(self, pictures: list[Picture], first: int = 0) -> None:
        self.pictures, self.numbers = pictures, range(first, first + len(pictures))

    def spread(self, count: int) -> range:
        return range(min(count, len(self.pictures)))

    def stored(self, frame: int) -> "Pictures":
        self.shown = self.pictures[frame]
        return self

    def averaged(self, columns: int, rows: int) -> Picture:
        return area_average(self.shown, columns, rows)


def wall(grain: float = 2.4) -> Picture:
    detail = blurred(np.random.default_rng(1).standard_normal((ROWS, COLUMNS, 3)).astype("f4"), grain)
    return np.maximum(0.25 * (1 + 0.4 * detail / detail.std()), 0.02).astype("f4")


def filmed(behind: Picture, centers: list[float], depth: float, source: Picture = SOURCE) -> Pictures:
    noise = np.random.default_rng(2)
    pictures = []
    for center in centers:
        clear = np.exp(-depth * np.exp(-((X - center) ** 2 + (Y - 80) ** 2) / 1000))[..., None]
        picture = clear * behind + (1 - clear) * source + 0.002 * noise.standard_normal(behind.shape)
        pictures.append(picture.astype("f4"))
    return Pictures(pictures)


def continued(behind: Picture) -> Plate:
    """The wall with a middle that is brighter and smoother than it is."""
    unknown = np.clip(1.5 - ((X - 96) ** 2 + (Y - 80) ** 2) / 1200, 0, 1).astype("f4")[..., None]
    image = behind + unknown * (blurred(behind, 4.0) + 0.08 - behind)
    errors = np.full((3, 3), 0.15**2, np.float32) + np.eye(3, dtype="f4") * 3e-3
    return Plate(image.astype("f4"), 1 - unknown[..., 0], EIGHT_BIT_NOISE, errors)


def after_turns(clip: Pictures, plate: Plate, source: Picture) -> Plate:
    frames = SomeFrames.of(clip, plate, range(FRAMES), np.zeros(FRAMES), SIDE)
    return frames.with_plate(plate, in_turn(frames, likeliest_plate(frames, source)))


def off(plate: Plate, behind: Picture) -> float:
    unknown = continued(behind).confidence < 0.5
    return float(np.sqrt(np.square((plate.image - behind)[unknown]).mean()))


def test_smoke_that_drifts_shows_what_is_behind_it() -> None:
    """What is known stays."""
    behind = wall()
    plate = continued(behind)
    better = after_turns(filmed(behind, list(np.linspace(40, 152, FRAMES)), 1.5), plate, SOURCE)
    assert off(better, behind) < 0.5 * off(plate, behind)
    assert (better.confidence >= plate.confidence - 1e-6).all()
    assert better.confidence[plate.confidence < 0.5].mean() > 0.6
    known = plate.confidence == 1
    assert np.array_equal(better.image[known], plate.image[known])


def test_what_no_mixture_with_the_continuation_explains_is_the_plate() -> None:
    """Red behind gray smoke that hides a part of it in each frame; what is around it is as gray as the smoke."""
    behind = wall()
    red = np.hypot(X - 96, Y - 80) < 30
    behind[red] *= np.array([1.4, 0.2, 0.1], "f4")
    plate = replace(continued(wall()), errors=0.03 * np.eye(3, dtype="f4"))
    better = after_turns(filmed(behind, list(np.linspace(40, 152, FRAMES)), 3.0), plate, SOURCE)
    assert off(better, behind) < 0.5 * off(plate, behind)


def test_a_post_goes_on_behind_smoke_from_above_and_below() -> None:
    """A bright post before a dark sky, which is what lies on its sides."""
    behind = np.full((ROWS, COLUMNS, 3), 0.03, "f4") * (1 + 0.2 * wall() / wall().mean())
    behind[abs(X - 96) < 12] = 0.5, 0.4, 0.25
    plate = replace(continued(behind), errors=0.01 * np.eye(3, dtype="f4"))
    plate.image[plate.confidence < 0.5] = 0.03
    better = after_turns(filmed(behind, list(np.linspace(70, 122, FRAMES)), 3.0), plate, SOURCE)
    assert off(better, behind) < 0.5 * off(plate, behind)


def test_detail_is_that_of_frames_that_show_most_of_it() -> None:
    """Smoke as bright as the wall changes its contrast alone, and that is finer than what is extracted."""
    behind = wall(0.8)
    color = behind.mean((0, 1))
    plate = continued(behind)
    plate = replace(plate, image=behind + (1 - plate.confidence)[..., None] * (blurred(behind, 6.0) - behind))
    pictures = filmed(behind, [96.0, 120.0, 144.0, 168.0, 192.0], 3.0, color)
    better = after_turns(pictures, plate, color)
    assert off(better, behind) < 0.5 * off(plate, behind)


def test_detail_of_smoke_is_not_that_of_a_smooth_wall() -> None:
    """Billows that stay within the middle, before a wall that has none wherever it is seen."""
    behind = np.repeat((0.05 + 0.5 * X / 192)[..., None], 3, 2).astype("f4")
    plate = replace(continued(behind), image=behind + (1 - continued(behind).confidence)[..., None] * 0.05)
    pictures = []
    for seed in range(FRAMES):
        billows = np.roll(wall(3.0)[..., :1], 7 * seed, 0)
        clear = np.exp(-4 * billows / billows.mean() * np.exp(-((X - 96) ** 2 + (Y - 80) ** 2) / 1500)[..., None])
        pictures.append((clear * behind + (1 - clear) * SOURCE).astype("f4"))
    better = after_turns(Pictures(pictures), plate, SOURCE)
    middle = np.hypot(X - 96, Y - 80) < 25
    assert (better.image - blurred(better.image, 6.0))[middle].std() < 0.02


def test_frames_are_likeliest_with_the_smokes_own_source() -> None:
    behind = wall()
    clip = filmed(behind, list(np.linspace(40, 152, FRAMES)), 3.0)
    frames = SomeFrames.of(clip, continued(behind), range(FRAMES), np.zeros(FRAMES), SIDE)
    own, dim, bright = (likeliest_plate(frames, factor * SOURCE).loss for factor in np.float32((1, 0.4, 2.5)))
    assert own < min(dim, bright)


def test_the_source_is_found_again_from_the_plate_after_the_turns() -> None:
    """Most of the plate is too red at first, and J, found before it, three times as bright as it is."""
    behind = wall()
    unknown = np.clip(1.5 - ((X - 96) ** 2 + (Y - 80) ** 2) / 4000, 0, 1).astype("f4")[..., None]
    red = np.maximum(behind + unknown * (blurred(behind, 4.0) + np.array((0.3, 0, -0.1), "f4") - behind), 0.02)
    errors = np.full((3, 3), 0.09, "f4") + 0.03 * np.eye(3, dtype="f4")
    plate = Plate(red.astype("f4"), 1 - unknown[..., 0], EIGHT_BIT_NOISE, errors)
    clip = filmed(behind, list(np.linspace(70, 122, FRAMES)), 3.0, 0.2 * SOURCE)
    _, found = plate_and_source(clip, clip, plate, (2, 1, 3, 0, 4))
    assert found == pytest.approx(0.2 * SOURCE, rel=0.25)


def test_thick_smoke_that_stays_leaves_a_plate_as_it_was() -> None:
    behind = wall()
    plate = continued(behind)
    same = after_turns(filmed(behind, [96.0] * FRAMES, 6.0), plate, SOURCE)
    assert off(same, behind) < 1.1 * off(plate, behind)
    middle = np.hypot(X - 96, Y - 80) < 16
    assert same.confidence[middle].max() < 0.5


@pytest.mark.parametrize("change", [{"confidence": np.ones((ROWS, COLUMNS), "f4")}, {"errors": np.zeros((3, 3), "f4")}])
def test_a_plate_without_errors_is_known(change) -> None:
    plate = continued(wall())
    assert is_known(replace(plate, **change)) and not is_known(plate)


def test_what_moves_is_where_the_frames_in_use_show_it() -> None:
    """A post that stood before the middle until a second before the last two frames, in which smoke is thin."""
    behind, post = wall(), wall()
    post[abs(X - 96) < 12] *= np.array([0.2, 0.3, 1.5], "f4")
    centers = list(np.linspace(40, 152, FRAMES))
    clip = filmed(post, centers, 0.7)
    clip.fps, clip.pictures[-2:] = 1.0, filmed(behind, centers[-2:], 0.7).pictures
    plate = continued(behind)
    better, _ = plate_and_source(Pictures(clip.pictures[-2:], FRAMES - 2), clip, plate, (0, 1))
    assert off(better, behind) < 0.5 * off(plate, behind)
