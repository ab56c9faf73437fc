"""Garbage mattes: what they hide, how they are read, and that nothing is learned from what they hide."""

from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from smokelift import Background, Clip
from smokelift.extraction.find_background import find_background
from smokelift.extraction.plate import Plate, cleared, known_plate, uncovered
from smokelift.footage.frame_source import ClipError
from smokelift.footage.image_files import ImageError
from smokelift.footage.mask import Mask
from smokelift.output.images import write_image, write_video
from tests.engine.films import COUNT, HEIGHT, WIDTH, codes_apart, film, plate_of, puff, wall

SIDE = 44
"""Column from which on the mask of the block is black; smoke stays to the left of it."""


def block(n: int) -> tuple[slice, slice]:
    """Where a block is that falls beside the puff."""
    return slice(2 * n, 2 * n + 12), slice(46, 55)


def filmed(folder: Path, with_block: bool = True, drift: float = 0.0) -> Path:
    """Write a clip of a puff before a wall, and of a dark block that moves beside it; its pattern.

    It gets brighter by the fraction ``drift``.
    """
    clip = film(folder, wall(0.3, 0.5), puff, 0.8)
    for n, shown in enumerate(clip) if drift else ():
        write_image(folder / f"frame_{n:03d}.png", shown * np.float32(1 + drift * n / (COUNT - 1)))
    for n in range(COUNT) if with_block else ():
        file = folder / f"frame_{n:03d}.png"
        codes = np.array(Image.open(file))
        codes[block(n)] = 20
        Image.fromarray(codes).save(file)
    return folder / "frame_###.png"


def painted(file: Path, values: np.ndarray) -> Path:
    """Write values (rows, columns) or (rows, columns, channels) from 0 to 255 as a mask."""
    Image.fromarray(np.asarray(values, np.uint8)).save(file)
    return file


@pytest.fixture
def mask(tmp_path) -> Path:
    """White but for the block's columns."""
    return painted(tmp_path / "mask.png", np.where(np.arange(WIDTH) < SIDE, 255, 0) * np.ones((HEIGHT, 1)))


@pytest.mark.parametrize(
    ("values", "shown"),
    [([[0, 120, 140, 255]], [0, 0, 1, 1]), ([[(255, 255, 255, 255)] * 2 + [(255, 255, 255, 0)] * 2], [1, 1, 0, 0])],
    ids=["gray", "transparent"],
)
def test_the_nearer_of_black_and_white_counts_at_the_clips_size(tmp_path, values, shown) -> None:
    seen = Mask.open(painted(tmp_path / "mask.png", np.array(values)), range(1), (80, 20)).seen(0, 8, 2)
    np.testing.assert_array_equal(seen, [np.repeat(np.array(shown, bool), 2)] * 2)


@pytest.mark.parametrize("kind", ["pictures", "video"])
def test_a_mask_a_frame_belongs_to_the_frames_of_the_file(tmp_path, kind) -> None:
    clip = filmed(tmp_path / "clip")
    pictures = [np.repeat((np.arange(WIDTH) < 16 + n)[None, :, None], HEIGHT, 0) * np.ones(3) for n in range(COUNT)]
    if kind == "video":
        file = tmp_path / "mask.mp4"
        write_video(file, (picture.astype(np.float32) for picture in pictures), 24)
    else:
        for n, picture in enumerate(pictures):
            write_image(tmp_path / f"mask_{n:02d}.png", picture)
        file = tmp_path / "mask_##.png"
    with Clip.open(clip, frames=(10, 15), mask=file) as part:
        for n in (0, 5):
            seen = part.seen(n, WIDTH, HEIGHT)
            assert abs(int(seen[HEIGHT // 2].sum()) - (16 + 10 + n)) <= (kind == "video")
        assert part.whole().seen(0, WIDTH, HEIGHT)[0].sum() <= 17


def test_a_shorter_sequence_of_masks_shortens_what_is_looked_at(tmp_path) -> None:
    clip = filmed(tmp_path / "clip")
    for n in range(8):
        painted(tmp_path / f"mask_{n}.png", np.full((HEIGHT, WIDTH), 255))
    with Clip.open(clip, frames=(2, 7), mask=tmp_path / "mask_#.png") as part:
        assert len(part.whole()) == 8
    with pytest.raises(ClipError, match=r"mask_#\.png: .* 8 of .* 0 to 23"):
        Clip.open(clip, mask=tmp_path / "mask_#.png")


@pytest.mark.parametrize(
    ("values", "named"),
    [
        ({}, "mask.png"),
        ({"mask.png": np.zeros((4, 4))}, "mask.png"),
        ({"mask.png": np.where(np.arange(WIDTH) == SIDE, 255, 0) * np.ones((HEIGHT, 1))}, "mask.png"),
        ({"mask.png": None}, "mask.png"),
        ({"mask.png": np.full((HEIGHT, 2 * WIDTH), 255)}, f"{2 * WIDTH} x {HEIGHT}"),
        ({f"mask_{n:02d}.png": np.full((4, 4), 255) for n in range(COUNT) if n != 3}, "mask_03.png"),
    ],
)
def test_a_wrong_mask_is_refused(tmp_path, values, named) -> None:
    for name, value in values.items():
        if value is None:
            (tmp_path / name).write_text("no picture")
        else:
            painted(tmp_path / name, value)
    mask = tmp_path / ("mask_##.png" if len(values) > 1 else "mask.png")
    with pytest.raises((ClipError, ImageError), match=named):
        Clip.open(filmed(tmp_path / "clip"), mask=mask)


def test_frames_are_continued_where_they_are_hidden(tmp_path, mask) -> None:
    file = filmed(tmp_path / "clip")
    with Clip.open(file) as plain, Clip.open(file, mask=mask) as clip:
        for n in (0, 12):
            np.testing.assert_array_equal(clip.frame(n)[:, :SIDE], plain.frame(n)[:, :SIDE])
            assert codes_apart(clip.frame(n), plain.frame(n))[block(n)].max() > 50
            assert codes_apart(clip.frame(n), wall(0.3, 0.5))[:, SIDE:].max() < 60
        assert np.isnan(clip.as_seen(3, clip.frame(3))[:, SIDE:]).all()
        assert plain.seen(3, WIDTH, HEIGHT) is None


def test_background_and_noise_are_those_of_what_is_seen(tmp_path, mask) -> None:
    """A block that moves over half of the picture changes neither; without the mask it is in both."""
    with Clip.open(filmed(tmp_path / "clean", with_block=False)) as clean:
        expected = plate_of(clean)
    file = filmed(tmp_path / "clip")
    with Clip.open(file, mask=mask) as clip:
        found = plate_of(clip)
        before, _ = known_plate(wall(0.3, 0.5), clip)
    assert codes_apart(found.image, expected.image)[:, :SIDE].max() < 4
    for plate in (found, before):
        np.testing.assert_allclose(plate.noise.total, expected.noise.total, rtol=0.25)


@pytest.mark.parametrize("frames", [None, (10, 12)])
def test_a_cleared_clip_shows_its_background_at_one_exposure(tmp_path, mask, frames) -> None:
    """The exposure is measured beside the mask; also beside the frames that are used, as the plate is found there."""
    file = filmed(tmp_path / "clip")
    plate = Plate(wall(0.3, 0.5).astype(np.float32) / 2, np.ones((HEIGHT, WIDTH), np.float32), None)
    with Clip.open(file, mask=mask, frames=frames) as clip:
        exposed = clip.exposed(plate.gain)
        shown = cleared(exposed, plate)
        for number in (0, COUNT - 1):
            np.testing.assert_array_equal(shown.whole().frame(number)[:, SIDE:], plate.image[:, SIDE:])
        np.testing.assert_allclose(shown.gain(2), 2, rtol=0.02)
        np.testing.assert_allclose(shown.frame(2)[:, :SIDE], clip.frame(2)[:, :SIDE] / shown.gain(2), rtol=1e-6)
    with Clip.open(file) as clip:
        assert cleared(clip, plate) is clip


@pytest.mark.parametrize("drift", [0.0, 0.3])
def test_what_is_hidden_all_the_time_is_shown_as_it_was_filmed(tmp_path, mask, drift) -> None:
    file = filmed(tmp_path / "clip", with_block=False, drift=drift)
    with Clip.open(file, mask=mask) as clip:
        found = plate_of(clip)
        middle = float(np.median(found.image / wall(0.3, 0.5)))
        assert middle == pytest.approx(1 + drift / 2, abs=0.05)
        assert codes_apart(found.image / middle, wall(0.3, 0.5)).max() < 5
        assert found.confidence[:, SIDE + 4 :].mean() > 0.9
        given = find_background(clip, None, Background(color=(0.1, 0.1, 0.1))).plate.at(0)
        np.testing.assert_allclose(given.image, 0.1, atol=1e-6)
    with Clip.open(file) as clip:
        assert uncovered(found, clip) is found


def test_what_a_tight_mask_hides_is_still_background(tmp_path) -> None:
    """Where smoke never leaves what the mask shows, the picture around it tells what is behind, not black."""
    truth = wall(0.3, 0.5)
    film(tmp_path, truth, lambda n: np.clip(1.4 * puff(12 + 0.3 * np.sin(n)), 0, 1), 0.8).close()
    smoky = np.mean([puff(12 + 0.3 * np.sin(n)) for n in range(COUNT)], 0) > 0.1
    write_image(tmp_path / "mask.png", np.repeat(smoky[..., None], 3, 2).astype(np.float32))
    with Clip.open(tmp_path / "frame_###.png", mask=tmp_path / "mask.png") as clip:
        found = find_background(clip, None, None)
    assert found.kind == "picture"
    plate = found.plate.at(0)
    assert plate.confidence.mean() > 0.5
    assert np.percentile(codes_apart(plate.image, truth)[~smoky], 95) < 5
