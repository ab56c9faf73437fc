"""Garbage mattes: what they hide, how they are read, and that nothing is learned from what they hide."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from films import COUNT, HEIGHT, WIDTH, codes_apart, film, plate_of, puff, wall
from PIL import Image

from smokelift.footage.backdrop import find_backdrop
from smokelift.footage.clip import Clip, ClipError
from smokelift.footage.images import ImageError, linear_to_srgb
from smokelift.footage.mask import Mask, continued
from smokelift.footage.plate import Plate, known_plate
from smokelift.footage.steady import cleared, uncovered
from smokelift.output.images import write_image
from smokelift.output.video_file import write_video

SIDE = 44
"""Column from which on the mask of the block is black; smoke stays to the left of it."""


def block(n: int) -> tuple[slice, slice]:
    """Where a block is that falls beside the puff."""
    return slice(2 * n, 2 * n + 12), slice(46, 55)


def filmed(folder: Path, with_block: bool = True) -> Path:
    """Write a clip of a puff before a wall, and of a dark block that moves beside it; its pattern."""
    folder.mkdir()
    film(folder, wall(0.3, 0.5), puff, 0.8).close()
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
def mask(tmp_path: Path) -> Path:
    """White but for the block's columns."""
    return painted(tmp_path / "mask.png", np.where(np.arange(WIDTH) < SIDE, 255, 0) * np.ones((HEIGHT, 1)))


def test_the_nearer_of_black_and_white_counts_at_the_clips_size(tmp_path: Path) -> None:
    """As values are stored, not as light; a mask of another size is resized as a clean plate is."""
    file = painted(tmp_path / "mask.png", [[0, 120, 140, 255]])
    seen = Mask(file, 0, 0).seen(0, 8, 2)
    np.testing.assert_array_equal(seen, [[False] * 4 + [True] * 4] * 2)


def test_what_is_transparent_is_black(tmp_path: Path) -> None:
    white, clear = (255, 255, 255, 255), (255, 255, 255, 0)
    file = painted(tmp_path / "mask.png", np.array([[white, clear]]))
    np.testing.assert_array_equal(Mask(file, 0, 0).seen(0, 2, 1), [[True, False]])


@pytest.mark.parametrize("kind", ["pictures", "video"])
def test_a_mask_a_frame_belongs_to_the_frames_of_the_file(tmp_path: Path, kind: str) -> None:
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
            assert seen is not None
            assert abs(int(seen[HEIGHT // 2].sum()) - (16 + 10 + n)) <= (kind == "video")
        assert part.whole().seen(0, WIDTH, HEIGHT)[0].sum() <= 17


def test_a_shorter_sequence_of_masks_shortens_what_is_looked_at(tmp_path: Path) -> None:
    """Frames without a mask say nothing; and are refused where they are asked for."""
    clip = filmed(tmp_path / "clip")
    for n in range(8):
        painted(tmp_path / f"mask_{n}.png", np.full((HEIGHT, WIDTH), 255))
    with Clip.open(clip, frames=(2, 7), mask=tmp_path / "mask_#.png") as part:
        assert len(part.whole()) == 8
    with pytest.raises(ClipError, match=r"mask_#\.png: has masks for 8 of the frames 0 to 23 that are needed"):
        Clip.open(clip, mask=tmp_path / "mask_#.png")


def lacks(folder: Path) -> Path:
    return folder / "none.png"


def is_black(folder: Path) -> Path:
    return painted(folder / "black.png", np.zeros((4, 4)))


def is_a_line(folder: Path) -> Path:
    return painted(folder / "line.png", np.where(np.arange(WIDTH) == SIDE, 255, 0) * np.ones((HEIGHT, 1)))


def is_text(folder: Path) -> Path:
    (folder / "mask.png").write_text("no picture")
    return folder / "mask.png"


def is_wide(folder: Path) -> Path:
    return painted(folder / "wide.png", np.full((HEIGHT, 2 * WIDTH), 255))


def has_a_hole(folder: Path) -> Path:
    for n in (0, 1, 2, 4, 5, *range(6, COUNT)):
        painted(folder / f"mask_{n:02d}.png", np.full((4, 4), 255))
    return folder / "mask_##.png"


@pytest.mark.parametrize(
    ("wrong", "said"),
    [
        (lacks, r"none\.png: no such file"),
        (is_black, r"black\.png: this mask is black everywhere"),
        (
            is_a_line,
            r"line\.png: this mask leaves too little of the picture white; leave a square of 2 x 2 pixels",
        ),
        (is_text, r"mask\.png: cannot be read"),
        (is_wide, rf"wide\.png: this mask is {2 * WIDTH} x {HEIGHT} pixels, another shape than the clip's"),
        (has_a_hole, r"mask_03\.png: this mask is missing; give one for every frame, or one picture for all"),
    ],
)
def test_a_wrong_mask_is_refused(tmp_path: Path, wrong: Callable[[Path], Path], said: str) -> None:
    with pytest.raises((ClipError, ImageError), match=said):
        Clip.open(filmed(tmp_path / "clip"), mask=wrong(tmp_path))


def test_frames_outside_the_clip_are_said_before_its_masks(tmp_path: Path) -> None:
    for n in range(COUNT):
        painted(tmp_path / f"mask_{n:02d}.png", np.full((HEIGHT, WIDTH), 255))
    with pytest.raises(ClipError, match="frames 90 to 95 were asked for"):
        Clip.open(filmed(tmp_path / "clip"), frames=(90, 95), mask=tmp_path / "mask_##.png")


def test_frames_are_continued_where_they_are_hidden(tmp_path: Path, mask: Path) -> None:
    """As their surroundings are, whatever is there; all the rest stays."""
    file = filmed(tmp_path / "clip")
    with Clip.open(file) as plain, Clip.open(file, mask=mask) as clip:
        for n in (0, 12):
            np.testing.assert_array_equal(clip.frame(n)[:, :SIDE], plain.frame(n)[:, :SIDE])
            assert codes_apart(clip.frame(n), plain.frame(n))[block(n)].max() > 50
            assert codes_apart(clip.frame(n), wall(0.3, 0.5))[:, SIDE:].max() < 60
        assert np.isnan(clip.as_seen(3, clip.frame(3))[:, SIDE:]).all()
        assert plain.seen(3, WIDTH, HEIGHT) is None


def test_what_is_far_from_all_that_is_seen_has_its_colour() -> None:
    seen = np.zeros((40, 900), np.bool_)
    seen[:, :40] = True
    picture = np.where(seen[..., None], np.float32(0.3), np.float32(0.9)) * np.ones(3, np.float32)
    np.testing.assert_allclose(continued(picture, seen), 0.3, rtol=1e-3)


def test_what_is_hidden_speaks_for_no_background_of_one_colour(tmp_path: Path) -> None:
    """Most of a wall's picture is hidden, and as continued it never changes; before grey, grey is found."""
    file = painted(tmp_path / "mask.png", np.where(np.arange(WIDTH) < 20, 255, 0) * np.ones((HEIGHT, 1)))
    for name, behind in (("wall", wall(0.2, 0.5)), ("grey", np.full((HEIGHT, WIDTH, 3), 0.2))):
        (tmp_path / name).mkdir()
        film(tmp_path / name, behind, lambda n: np.zeros((HEIGHT, WIDTH)), 0.8).close()
        with Clip.open(tmp_path / name / "frame_###.png", mask=file) as clip:
            found = find_backdrop(clip, None, None)
        assert found.source == ("picture" if name == "wall" else "colour")
        assert np.median(codes_apart(found.plates.at(0).image, behind)[:, :20]) < 2


def test_codes_are_continued_as_light_is(tmp_path: Path) -> None:
    """Videos are kept in the codes that they are stored in."""
    rows, columns = np.mgrid[:64, :96]
    picture = np.stack([0.2 + 0.004 * columns, 0.3 + 0.003 * rows, 0.4 + 0 * rows], -1).astype(np.float32)
    hole = (slice(20, 40), slice(30, 60))
    spoiled = picture.copy()
    spoiled[hole] = 1
    write_video(tmp_path / "clip.mp4", [spoiled] * 3, 24)
    values = np.full((64, 96), 255)
    values[16:44, 26:64] = 0
    with Clip.open(tmp_path / "clip.mp4", mask=painted(tmp_path / "mask.png", values)) as clip:
        assert np.abs(linear_to_srgb(clip.frame(1)) - linear_to_srgb(picture))[hole].max() < 0.03


def test_background_and_noise_are_those_of_what_is_seen(tmp_path: Path, mask: Path) -> None:
    """A block that moves over half of the picture changes neither; without the mask it is in both."""
    with Clip.open(filmed(tmp_path / "clean", with_block=False)) as clean:
        expected = plate_of(clean)
    file = filmed(tmp_path / "clip")
    with Clip.open(file, mask=mask) as clip:
        found = plate_of(clip)
        before = known_plate(wall(0.3, 0.5), clip)
    assert codes_apart(found.image, expected.image)[:, :SIDE].max() < 4
    for plate in (found, before):
        np.testing.assert_allclose(plate.noise.total, expected.noise.total, rtol=0.25)


def test_large_masks_do_not_hide_the_noise(tmp_path: Path) -> None:
    """What is continued is smooth, and would make a noisy clip clean."""
    (tmp_path / "clip").mkdir()
    film(tmp_path / "clip", wall(0.3, 0.5), lambda n: np.zeros((HEIGHT, WIDTH)), 0.8, noise=4.0).close()
    small = painted(tmp_path / "mask.png", np.where(np.arange(WIDTH) < 16, 255, 0) * np.ones((HEIGHT, 1)))
    with Clip.open(tmp_path / "clip" / "frame_###.png", mask=small) as clip:
        for plate in (plate_of(clip), known_plate(wall(0.3, 0.5), clip)):
            np.testing.assert_allclose(255 * plate.noise.total, 4, rtol=0.2)


def test_a_cleared_clip_shows_its_background_as_it_is_exposed(tmp_path: Path, mask: Path) -> None:
    file = filmed(tmp_path / "clip")
    plate = Plate(wall(0.3, 0.5).astype(np.float32) / 2, np.ones((HEIGHT, WIDTH), np.float32), None)
    with Clip.open(file, mask=mask) as clip:
        shown = cleared(clip, plate)
        assert codes_apart(shown.frame(0), 2 * plate.image)[:, SIDE:].max() < 3
        np.testing.assert_array_equal(shown.frame(5)[:, :SIDE], clip.frame(5)[:, :SIDE])
    with Clip.open(file) as clip:
        assert cleared(clip, plate) is clip


def test_what_is_hidden_all_the_time_is_shown_as_it_was_filmed(tmp_path: Path, mask: Path) -> None:
    """Behind the result there would be a blur; where the background is known it stays."""
    file = filmed(tmp_path / "clip", with_block=False)
    with Clip.open(file, mask=mask) as clip:
        found = plate_of(clip)
        assert codes_apart(found.image, wall(0.3, 0.5)).max() < 4
        assert not found.confidence[:, SIDE:].any()
        given = known_plate(np.full(3, 0.1), clip)
        np.testing.assert_array_equal(uncovered(given, clip).image, given.image)
    with Clip.open(file) as clip:
        assert uncovered(found, clip) is found
