"""The background that a scene gives, what a camera sees of it, and what strokes over a frame say of it."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from smokelift.extraction.find_background import FoundBackground, find_background
from smokelift.extraction.given_background import background_picture, mean_of_frames, open_plates, read_background
from smokelift.extraction.hidden_plate import plate_and_source
from smokelift.extraction.matte import matte
from smokelift.extraction.plate import Plate, known_plate
from smokelift.footage.clip import Clip
from smokelift.footage.frame_source import ClipError
from smokelift.footage.image_files import ImageError
from smokelift.footage.images import srgb_to_linear
from smokelift.output.images import write_image
from smokelift.scene import Background, Camera, ClipSource, Scene, look_at_matrix
from smokelift.setup.first_estimate import sample_smoke
from tests.engine.films import (
    COUNT,
    HEIGHT,
    WIDTH,
    clip_of,
    codes_apart,
    film,
    overlap,
    pan,
    passing_wall,
    plate_of,
    puff,
    wall,
)

CAMERA = Camera.look_at((0, -4, 0), (0, 0, 0), fov_y_degrees=30, size=(WIDTH, HEIGHT))


@pytest.fixture
def folder(tmp_path) -> Path:
    """A clip of smoke before a passing wall, and the wall alone, frame by frame."""
    for name, smoke in (("clip", 1.0), ("plate", 0.0)):
        pan(tmp_path / name, passing_wall(), smoke).close()
    return tmp_path


def test_a_color_or_a_picture_is_one_plate_for_all_frames(folder) -> None:
    clip = pan(folder / "clip", passing_wall(), 1.0)
    color, picture = Background(color=(0.1, 0.2, 0.3)), Background(image=folder / "plate" / "frame_003.png")
    for background, behind, codes in ((color, (0.1, 0.2, 0.3), 0.1), (picture, passing_wall()[:, 6 : 6 + WIDTH], 6)):
        plate, _ = known_plate(read_background(background, None), clip)
        assert plate.at(0) is plate.at(COUNT - 1)
        assert codes_apart(plate.image, np.broadcast_to(behind, plate.image.shape)).max() < codes


def test_frames_of_the_clip_are_its_plate_as_they_were_filmed(tmp_path) -> None:
    """Also where a mask hides a part of them, and outside the frames in use; those that do not exist are refused."""
    filmed = np.random.default_rng(0).uniform(0.1, 0.9, (4, 24, 32, 3)).astype(np.float32)
    clip_of(tmp_path, filmed, ".exr").close()
    seen = np.zeros((24, 32), np.float32)
    seen[:, :20] = 1
    write_image(tmp_path / "mask.png", seen)
    for mask in (None, tmp_path / "mask.png"):
        with Clip.open(tmp_path / "frame_###.exr", frames=(1, 2), mask=mask) as clip:
            np.testing.assert_allclose(mean_of_frames((0, 3), clip), filmed[[0, 3]].mean(0), atol=1e-3)
            with pytest.raises(ClipError, match="frame 4"):
                mean_of_frames((4,), clip)


def test_pictures_are_a_plate_a_frame_and_are_cut_like_one(folder) -> None:
    clip = pan(folder / "clip", passing_wall(), 1.0)
    behind = read_background(Background(image=folder / "plate" / "frame_###.png"), CAMERA)
    plate, _ = known_plate(behind, clip)
    part = plate.through(lambda picture: picture[8:40]).through(lambda picture: picture[:, 4:])
    for n in (0, 9):
        np.testing.assert_array_equal(part.at(n).image, plate.at(n).image[8:40, 4:])
        np.testing.assert_array_equal(part.at(n).noise.total, plate.at(n).noise.total)


def test_a_numbered_picture_begins_a_sequence_before_a_moving_camera(folder) -> None:
    moving = replace(CAMERA, matrices=(CAMERA.matrix,) * COUNT)
    plates = open_plates(Background(image=folder / "plate" / "frame_000.png"), moving)
    assert len(plates) == COUNT


def test_a_camera_sees_its_own_plate_and_others_its_mean(folder) -> None:
    first = folder / "plate" / "frame_002.png"
    clip = ClipSource(folder / "clip" / "frame_###.png", frames=(2, 9))
    for image in (first, folder / "plate" / "frame_###.png"):
        scene = Scene(camera=CAMERA, clip=clip, background=Background(image=image))
        own = background_picture(scene)
        assert codes_apart(own, passing_wall()[:, 4 : 4 + WIDTH]).max() < 6
        turned = replace(CAMERA, matrix=look_at_matrix((1.0, -4.0, 1.0), (0.0, 0.0, 1.0), (0.0, 0.0, 1.0)))
        np.testing.assert_allclose(background_picture(scene, turned), own.reshape(-1, 3).mean(0), rtol=1e-5)
        part = background_picture(scene, CAMERA.cropped(2, 3, 10, 8))
        np.testing.assert_allclose(part, own[3:11, 2:12], rtol=1e-5)


def test_a_color_is_seen_by_every_camera_and_nothing_is_black() -> None:
    scene = Scene(background=Background(color=(0.1, 0.2, 0.3)))
    np.testing.assert_array_equal(background_picture(scene, CAMERA), np.float32([0.1, 0.2, 0.3]))
    np.testing.assert_array_equal(background_picture(Scene(camera=CAMERA)), np.zeros(3))


ROWS, COLUMNS = np.mgrid[:HEIGHT, :WIDTH]
GRADIENT = srgb_to_linear(np.stack([0.2 + 0.3 * COLUMNS / WIDTH, 0.25 + 0.2 * ROWS / HEIGHT, 0 * ROWS + 0.4], -1))
PLUME = 0.6 * np.clip(1.8 - np.abs(COLUMNS - 28) / 5, 0, 1) * (ROWS > 12)
"""Opacity of smoke that stands still."""

GREEN, RED, BLUE = (0, 255, 0, 255), (255, 0, 0, 255), (0, 0, 255, 255)


def strokes(folder: Path, *painted: tuple[np.ndarray, tuple[int, ...]]) -> Path:
    """Paint over nothing."""
    pixels = np.zeros((HEIGHT, WIDTH, 4), np.uint8)
    for where, color in painted:
        pixels[where] = color
    Image.fromarray(pixels).save(folder / "strokes.png")
    return folder / "strokes.png"


def painted(clip: Clip, *lines: tuple[np.ndarray, tuple[int, ...]], **given: object) -> tuple[FoundBackground, Plate]:
    found = find_background(clip, None, Background(strokes=strokes(clip.path.parent, *lines), **given))
    return found, found.plate


def opacity_errors(found: FoundBackground, smoke: np.ndarray, truth: np.ndarray, number: int = 12) -> float:
    """The root mean square error of the opacity of white smoke, by what it changes of the plate that was found."""
    plate = found.plate.at(number).image
    shown = ((found.clip.frame(number) - plate) / (1 - plate)).mean(-1)
    return float(np.sqrt(np.mean(np.square(shown - smoke)[truth])))


def test_one_green_stroke_finds_smoke_that_stands_still(tmp_path) -> None:
    """Without it the plume is the plate's, and none of the smoke is found."""
    clip, there = film(tmp_path, GRADIENT, lambda _: PLUME, 1.0), PLUME > 0
    without = find_background(clip, None, None)
    found, plate = painted(clip, (there, GREEN))
    assert opacity_errors(without, PLUME, there) > 0.4
    assert opacity_errors(found, PLUME, there) < 0.01
    assert (plate.confidence == ~there).all()
    assert codes_apart(plate.image, GRADIENT).max() < 5
    assert 0.001 < np.sqrt(plate.errors[0, 0]) < 0.05
    thick = PLUME > 0.3
    assert matte(without.clip.frame(5), without.plate.at(0)).mask[thick].mean() < 0.01
    assert matte(found.clip.frame(5), plate).mask[thick].all()
    with Image.open(tmp_path / "strokes.png") as picture:  # of another size
        picture.resize((WIDTH * 3, HEIGHT * 3)).save(tmp_path / "strokes.png")
    scaled = find_background(clip, None, Background(strokes=tmp_path / "strokes.png"))
    np.testing.assert_array_equal(scaled.plate.confidence, plate.confidence)


def test_nothing_that_is_painted_red_is_smoke(tmp_path) -> None:
    """A ball that swings before a wall, beside a puff that rises; a frame that is darker as well."""
    tiles, box = wall(0.2, 0.5), (COLUMNS > 40) & (ROWS < 30)

    def opacity(n: int) -> np.ndarray:
        ball = np.hypot(ROWS - 15, COLUMNS - 48 - 3 * np.sin(n)) < 5
        return np.where(box, ball, np.roll(puff(n), -14, axis=1))

    steady = film(tmp_path, tiles, opacity, 0.8)
    clip = steady.changed(lambda n, shown: shown * (0.6 if n == 3 else 1))
    found, plate = painted(clip, (box, RED))
    assert (plate.confidence[box] == 1).all()
    median = np.median([steady.frame(number) for number in steady.spread(15)], axis=0)
    assert codes_apart(plate.image, median)[box].max() < 5
    without = find_background(clip, None, None)
    for number in (3, 12):
        masks = [matte(each.clip.frame(number), each.plate.at(0)).mask for each in (found, without)]
        assert not masks[0][box].any() and masks[1][box].any()
        np.testing.assert_array_equal(masks[0][:, :28], masks[1][:, :28])
        assert overlap(masks[0][:, :40], np.roll(puff(number), -14, axis=1)[:, :40] > 0.05) > 0.7


def test_what_is_painted_blue_is_behind_and_continued(tmp_path) -> None:
    """Smoke stands before a bright stripe of its width, and leaves a gap in most of the frames, or never."""
    stripe = GRADIENT + 0.2 * np.exp(-(((COLUMNS - 28) / 6) ** 2))[..., None]
    gap = (PLUME > 0) & (ROWS > 30) & (ROWS < 40)
    clip = film(tmp_path, stripe, lambda n: np.where(gap & (n % 5 > 0), 0, PLUME), 1.0)
    green = (PLUME > 0) & ~gap
    _, alone = painted(film(tmp_path / "closed", stripe, lambda _: PLUME, 1.0), (PLUME > 0, GREEN))
    _, plate = painted(clip, (green, GREEN), (gap, BLUE))
    assert (plate.confidence[gap] == 1).all() and (plate.confidence[green] == 0).mean() > 0.9
    assert codes_apart(plate.image, stripe)[gap].max() < 3
    near = green & (np.abs(ROWS - 35) < 9)
    assert codes_apart(plate.image, stripe)[near].mean() < 0.6 * codes_apart(alone.image, stripe)[near].mean()


def test_a_given_plate_is_changed_in_the_strokes_alone(tmp_path) -> None:
    clip = film(tmp_path, GRADIENT, puff, 1.0)
    moved = (ROWS < 12) & (COLUMNS < 12)
    plate = np.where(moved[..., None], 0.9, GRADIENT)
    write_image(tmp_path / "plate.exr", plate, half=False)
    found, mended = painted(clip, (moved, BLUE), image=tmp_path / "plate.exr")
    assert codes_apart(mended.image, GRADIENT)[moved].max() < 2
    np.testing.assert_allclose(mended.image[~moved], plate[~moved], rtol=1e-6)
    assert found.kind == "given" and (mended.confidence == 1).all()


def test_the_edge_of_two_strokes_is_none(tmp_path) -> None:
    clip = film(tmp_path, GRADIENT, puff, 1.0)
    edge = ((ROWS < 20, GREEN), (ROWS == 20, (128, 128, 0, 255)), (ROWS > 20, BLUE))
    found, _ = painted(clip, *edge)
    assert not found.strokes.other.any()
    np.testing.assert_array_equal(found.strokes.smoke | found.strokes.behind, ROWS != 20)


def test_a_stroke_says_nothing_of_what_is_unknown_elsewhere(tmp_path) -> None:
    random = np.random.default_rng(0)
    flicker = [random.uniform(0.4, 0.9) for _ in range(COUNT)]
    restless = np.abs(COLUMNS - 10) < 5
    clip = film(tmp_path, wall(0.2, 0.5), lambda n: np.where(restless, flicker[n], 0), 0.7)
    before = plate_of(clip)
    unknown = before.confidence == 0
    assert unknown[:, 8:12].all() and not unknown[:, 30:].any()
    _, plate = painted(clip, ((COLUMNS > 40) & (ROWS > 40), GREEN))
    assert codes_apart(plate.image, before.image)[unknown].max() < 3


def test_green_keeps_what_clear_moments_show(tmp_path) -> None:
    """Smoke sways before a wall of tiles: over all of it or none, the strokes leave what frames show as it was."""
    tiles = wall(0.2, 0.5)
    clip = film(tmp_path, tiles, lambda n: np.roll(PLUME, round(16 * np.sin(n)), axis=1), 0.9)
    passed = (np.abs(COLUMNS - 28) < 20) & (ROWS > 14)
    before, (_, plate) = plate_of(clip), painted(clip, (passed, GREEN))
    shown = passed & (before.confidence == 1) & (PLUME == 0)
    assert shown.mean() > 0.2 and (plate.confidence[shown] == 1).mean() > 0.9
    assert codes_apart(plate.image, tiles)[shown].mean() < 1.1 * codes_apart(before.image, tiles)[shown].mean()


@pytest.mark.parametrize("given", [None, (0.0, 0.0, 0.0)])
def test_green_before_black_is_before_black(tmp_path, given) -> None:
    """Also where smoke stands still, which is an object before black without the stroke."""
    clip = film(tmp_path, np.zeros((HEIGHT, WIDTH, 3)), lambda n: np.where(ROWS > 60, PLUME, puff(n)), 0.6, noise=0)
    _, plate = painted(clip, (np.ones((HEIGHT, WIDTH), np.bool_), GREEN), color=given)
    assert (plate.confidence == 1).all() and (plate.image == plate.image[0, 0]).all()
    assert plate.image.max() < 1e-3


def test_green_leaves_a_clean_plate_as_it_is(tmp_path) -> None:
    """Over some of the picture or all of it: smoke is there, and what is behind it is known."""
    clip = film(tmp_path, wall(0.2, 0.5), puff, 0.9)
    write_image(tmp_path / "plate.exr", wall(0.2, 0.5), half=False)
    known = find_background(clip, None, Background(image=tmp_path / "plate.exr")).plate
    for where in (np.hypot(ROWS - 40, COLUMNS - 28) < 20, ROWS >= 0):
        _, plate = painted(clip, (where, GREEN), image=tmp_path / "plate.exr")
        np.testing.assert_array_equal(plate.image, known.image)
        assert (plate.confidence == 1).all()


def test_a_named_frame_shows_what_is_behind_green(tmp_path) -> None:
    """Also outside of the frames in use, in all of which smoke sways where the stroke is."""
    tiles = wall(0.2, 0.5)
    clip = film(tmp_path, tiles, lambda n: np.roll(PLUME, round(4 * np.sin(n)), axis=1) * (n > 0), 0.9).part(6, 20)
    where = (np.abs(COLUMNS - 28) < 16) & (ROWS > 10)
    found, _ = painted(clip, (where, GREEN), frame=(0,))
    smoky = sample_smoke(found.clip, found.plate).smoky
    plate, _ = plate_and_source(found.clip, found.uncut_clip(found.clip), found.plate, smoky)
    assert codes_apart(plate.image, tiles)[where].mean() < 4


def test_strokes_that_say_nothing_are_refused(tmp_path) -> None:
    clip, white, yellow = film(tmp_path, GRADIENT, puff, 1.0), (255, 255, 255, 255), (255, 255, 0, 255)
    for lines, width, named in (
        ((), 1, "strokes.png"),
        (((ROWS < 20, white),), 1, "strokes.png"),
        (((ROWS < 20, yellow),), 1, "strokes.png"),
        (((ROWS < 20, yellow), (ROWS > 30, GREEN)), 1, "strokes.png"),
        (((ROWS < 20, white),), 2, f"{2 * WIDTH} x {HEIGHT}"),
    ):
        file = strokes(tmp_path, *lines)
        with Image.open(file) as picture:
            picture.resize((WIDTH * width, HEIGHT)).save(file)
        with pytest.raises(ClipError, match=named):
            find_background(clip, None, Background(strokes=file))
    everywhere = strokes(tmp_path, (ROWS >= 0, GREEN))
    with pytest.raises(ClipError):
        find_background(clip, None, Background(frame=(0,), strokes=everywhere))
    with pytest.raises(ImageError, match=r"no\.png"):
        find_background(clip, None, Background(strokes=tmp_path / "no.png"))
    with pytest.raises(ValueError):
        find_background(clip, None, Background(image=clip.path, strokes=strokes(tmp_path, (PLUME > 0, GREEN))))
