"""What is found to stand behind the smoke."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scipy import ndimage

from smokelift import Camera, Clip
from smokelift.extraction.find_background import FoundBackground, color_around, find_background
from smokelift.extraction.matte import matte
from smokelift.footage.images import srgb_to_linear
from smokelift.output.images import write_image
from smokelift.scene import Background
from tests.engine.films import COUNT, HEIGHT, WIDTH, clip_of, codes_apart, film, pan, plate_of, puff, wall


def spreading_ink(n: int) -> np.ndarray:
    """Return the opacity of ink that spreads from above, faster at first, and stays."""
    rows, columns = np.mgrid[:HEIGHT, :WIDTH]
    return np.clip((62 * np.sqrt(n / COUNT) - rows - 6 * np.cos(columns / 4)) / 6, 0, 1) if n else 0.0 * rows


def fog(folder: Path, frames: tuple[int, int] | None = None, haze: float | None = None) -> Clip:
    """Billows that fill the picture and drift by two pixels per frame, and pure black at both ends of the file.

    With haze (sRGB) they never leave, and it is added to them.
    """
    count, rows, columns = 60, 90, 120
    random = np.random.default_rng(5)
    wide = sum(
        width * ndimage.gaussian_filter(random.standard_normal((rows, columns + 2 * count)), width, mode="wrap")
        for width in (6, 12, 24)
    )
    wide = (wide - wide.min()) / np.ptp(wide)
    amount = (
        np.clip(np.minimum(np.arange(count), np.arange(count)[::-1]) / 12, 0, 1) if haze is None else np.ones(count)
    )
    shown = (srgb_to_linear(0.7 * amount[n] * wide[:, 2 * n : 2 * n + columns] + (haze or 0)) for n in range(count))
    return clip_of(folder, shown, frames=frames)


@pytest.mark.parametrize(
    ("how", "kind"),
    [
        ({}, "color"),
        ({"frames": (24, 35)}, "color"),
        ({"haze": 0.0}, "black for want of a picture"),
        ({"haze": 0.15}, "black for want of a picture"),
    ],
    ids=["whole", "middle", "never leaves", "never leaves a haze"],
)
def test_fog_that_fills_black_is_no_noise(tmp_path, how, kind) -> None:
    """Most of its light is in the matte, also where no pixel is ever clear."""
    with fog(tmp_path, **how) as clip:
        found = find_background(clip, None, None)
        assert found.kind == kind
        plate = found.plate.at(0)
        if kind == "color":
            assert plate.image.max() == 0
            assert plate.noise.total.max() < 2 / 255
        picture = clip.frame(len(clip) // 2)
        probability = matte(picture, found.plate.at(len(clip) // 2)).probability[..., None]
        assert (probability * picture).sum() > 0.98 * picture.sum()


def test_faint_fog_before_one_color_is_no_noise(tmp_path) -> None:
    random = np.random.default_rng(2)
    rows, columns = np.mgrid[:HEIGHT, :WIDTH]
    fog = (6 * np.clip(np.sin(rows / 9 + n / 2) * np.sin(columns / 11 - n / 3), 0, 1) for n in range(COUNT))
    faint = ((60 + each + random.normal(0, 1, rows.shape)) / 255 for each in fog)
    with clip_of(tmp_path, (srgb_to_linear(each) for each in faint)) as clip:
        found = find_background(clip, None, None)
    assert found.kind == "color"
    assert found.plate.noise.lasting.max() * 255 < 1.3


def test_a_trimmed_clip_has_the_background_of_its_file(tmp_path) -> None:
    """Twelve frames in which smoke hardly leaves its place before the wall, of a file that shows the wall."""
    truth = wall(0.2, 0.5)

    film(tmp_path, truth, lambda n: puff(8 + (n - 10) / 3) if 10 <= n < 22 else np.zeros((HEIGHT, WIDTH)), 0.6)
    trimmed = Clip.open(tmp_path / "frame_###.png", fps=24, frames=(11, 20))
    plate = plate_of(trimmed)
    assert np.percentile(codes_apart(plate.image, truth), 95) < 5


def test_what_follows_a_cut_is_not_behind_the_smoke(tmp_path) -> None:
    """A shot that stands still, and after it pictures of which none is like the next."""
    truth, random = wall(0.2, 0.5), np.random.default_rng(3)
    film(tmp_path, truth, puff, 0.6)
    for n in range(14, COUNT):
        shown = np.kron(random.uniform(0, 0.6, (HEIGHT // 8, WIDTH // 8, 3)), np.ones((8, 8, 1)))
        write_image(tmp_path / f"frame_{n:03d}.png", srgb_to_linear(shown))
    clip = Clip.open(tmp_path / "frame_###.png", fps=24, frames=(4, 8))
    found = find_background(clip, None, None)
    assert found.uncut_span == (0, 13)
    assert np.percentile(codes_apart(found.plate.at(0).image, truth), 95) < 8


@pytest.mark.parametrize(("color", "ink"), [(1.0, 0.0), (0.2, 0.7)], ids=["black on white", "bright on gray"])
def test_ink_that_stays_is_not_what_it_hides(tmp_path, color, ink) -> None:
    truth = np.full((HEIGHT, WIDTH, 3), color)
    clip = film(tmp_path, truth, spreading_ink, ink)
    plate = plate_of(clip)
    assert (plate.confidence == 1).all()
    assert codes_apart(plate.image, truth).max() < 2
    last = spreading_ink(COUNT - 1)
    mask = matte(clip.frame(COUNT - 1), plate).mask
    assert mask[last > 0.5].all()
    assert mask.mean() < (last > 0).mean() + 0.1


def test_a_clip_that_fades_in_from_black_is_not_before_black(tmp_path) -> None:
    truth = np.full((HEIGHT, WIDTH, 3), 0.4)
    truth[:10] = 0
    plate = plate_of(film(tmp_path, truth, lambda n: np.full((HEIGHT, WIDTH), max(1 - n / 2, 0)), 0.0))
    assert np.median(codes_apart(plate.image, truth)) < 2


def mist(n: int) -> np.ndarray:
    """Return the opacity of mist over two thirds of the picture that hardly moves."""
    rows, columns = np.mgrid[:HEIGHT, :WIDTH]
    depth = np.clip(rows / HEIGHT - 0.33, 0, 0.67) / 0.67
    return 0.5 * depth**2 * (3 - 2 * depth) * (1 + 0.2 * np.sin(columns / 9 + 0.02 * n))


def test_mist_that_hardly_moves_is_before_the_black_that_it_fades_into(tmp_path) -> None:
    clip = film(tmp_path, np.zeros((HEIGHT, WIDTH, 3)), mist, 0.4, 0.5)
    plate = plate_of(clip)
    assert (plate.confidence == 1).all()
    assert not plate.image.any()
    assert matte(clip.frame(12), plate).mask[HEIGHT * 2 // 3 :].all()


@pytest.mark.parametrize("lit", [False, True], ids=["bars", "spot"])
def test_what_has_edges_is_no_mist(tmp_path, lit) -> None:
    truth = wall(0.2, 0.5)
    truth[:10] = 0
    truth[-10:] = 0
    if lit:
        rows, columns = np.mgrid[:HEIGHT, :WIDTH]
        truth = wall(0.2, 0.5) * np.exp(-((rows - 36) ** 2 + (columns - 28) ** 2) / 150)[..., None]
    plate = plate_of(film(tmp_path, truth, puff, 0.6, 0.5))
    middle = np.s_[28:44, 20:36]
    assert codes_apart(plate.image, truth)[middle].max() < 30
    assert plate.image[middle].min() > 0


@pytest.mark.parametrize("color", [(0.0, 0.0, 0.0), (0.1, 0.3, 0.05)], ids=["black", "green"])
def test_one_color_behind_a_moving_camera_is_found(tmp_path, color) -> None:
    clip = pan(tmp_path, np.broadcast_to(color, (HEIGHT, WIDTH + 2 * COUNT, 3)), 1.0)
    cameras = [Camera.look_at((0, -3, 0.01 * n), (0, 0, 0), fov_y_degrees=40, size=clip.size) for n in range(COUNT)]
    moving = replace(cameras[0], matrices=tuple(each.matrix for each in cameras))
    assert find_background(clip, moving, None).background.color == pytest.approx(color, abs=0.003)


def test_a_single_picture_has_a_color_around_it() -> None:
    """In noise, too, behind smoke that covers most of it and comes in from one side; not a wall, and no black bars."""
    picture = np.full((60, 80, 3), 0.2, np.float32)
    picture += np.random.default_rng(0).normal(0, 0.004, picture.shape).astype(np.float32)
    picture[5:, 10:70] = np.linspace(0.3, 0.9, 60)[:, None]
    assert color_around(picture) == pytest.approx((0.2, 0.2, 0.2), abs=0.002)
    picture[:, 10:70] = np.linspace(0.3, 0.9, 60)[:, None]
    assert color_around(picture) is None
    bars = np.kron(np.random.default_rng(0).uniform(0.1, 0.6, (12, 16, 1)), np.ones((5, 5, 3))).astype(np.float32)
    assert color_around(bars) is None
    bars[:10] = bars[-10:] = 0
    assert color_around(bars) is None


SKY = np.linspace(0.35, 0.6, HEIGHT)[:, None, None] ** np.array([1.6, 1.2, 0.7]) * np.ones((1, WIDTH, 1))
"""A sky that brightens downwards, linear."""

FOREST = 3 * HEIGHT // 4
"""First row of a forest below it."""


def hinted(
    folder: Path, plate: np.ndarray, color: np.ndarray, visible: np.ndarray, strokes: Path | None = None
) -> tuple[Clip, FoundBackground]:
    """Return a clip of thick smoke in the middle of a plate, and its background by a color, a mask, and strokes."""
    rows, columns = np.mgrid[:HEIGHT, :WIDTH]
    smoke = np.clip(1.5 - np.hypot(rows - 0.42 * HEIGHT, columns - WIDTH / 2) / 8, 0, 1)
    film(folder, plate, lambda n: smoke * (1 - n / COUNT / 4), 0.8).close()
    write_image(folder / "mask.png", visible.astype(np.float32))
    clip = Clip.open(folder / "frame_###.png", mask=folder / "mask.png")
    red, green, blue = map(float, color)
    return clip, find_background(clip, None, Background(color=(red, green, blue), strokes=strokes))


def test_a_color_goes_on_as_the_sky_beside_a_mask_does(tmp_path) -> None:
    """The sky that a generous mask leaves free is no smoke, and the forest beside the mask is not behind the smoke."""
    plate, visible = SKY.copy(), np.zeros((HEIGHT, WIDTH), np.bool_)
    plate[FOREST:] = wall(0.1, 0.3)[FOREST:] * (0.5, 1, 0.4)
    visible[6:FOREST, 8:-8] = True
    clip, found = hinted(tmp_path, plate, SKY[visible].mean(0), visible)
    with clip:
        assert codes_apart(found.plate.image, SKY)[visible].mean() < 4
        shown = matte(found.clip.frame(0), found.plate)
        far = np.hypot(*(np.mgrid[:HEIGHT, :WIDTH] - np.array([0.42 * HEIGHT, WIDTH / 2])[:, None, None])) > 18
        assert shown.mask[~far].any()
        assert not shown.mask[visible & far].any()


def test_before_one_color_nothing_changes_beside_a_mask(tmp_path) -> None:
    plate, visible = np.broadcast_to((0.2, 0.4, 0.6), (HEIGHT, WIDTH, 3)), np.zeros((HEIGHT, WIDTH), np.bool_)
    visible[6:-6, 8:-8] = True
    clip, found = hinted(tmp_path, plate, plate[0, 0], visible)
    clip.close()
    assert codes_apart(found.plate.image, plate)[visible].max() < 1


def test_a_color_that_nothing_beside_a_mask_has_stays(tmp_path) -> None:
    """A gray wall that fills the mask, in a darker frame."""
    plate, visible = np.full((HEIGHT, WIDTH, 3), 0.2), np.zeros((HEIGHT, WIDTH), np.bool_)
    visible[6:-6, 8:-8] = True
    plate[visible] = 0.3
    clip, found = hinted(tmp_path, plate, plate[HEIGHT // 2, WIDTH // 2], visible)
    clip.close()
    np.testing.assert_allclose(found.plate.image[visible], 0.3, atol=1e-6)


def test_smoke_painted_before_a_color_leaves_it_as_it_is_there(tmp_path) -> None:
    visible = np.zeros((HEIGHT, WIDTH), np.bool_)
    visible[6:-6, 8:-8] = True
    write_image(tmp_path / "strokes.png", visible[..., None] * np.array([0, 1, 0], np.float32))
    clip, painted = hinted(tmp_path, SKY, SKY[visible].mean(0), visible, tmp_path / "strokes.png")
    plain = find_background(clip, None, replace(painted.background, strokes=None))
    clip.close()
    np.testing.assert_array_equal(painted.plate.image, plain.plate.image)
