"""How the camera of a clip moves, and what becomes of its frames."""

from collections.abc import Iterator
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from scipy import ndimage

from smokelift import Background, Clip
from smokelift.extraction.camera_motion import CameraMotion, find_motion
from smokelift.extraction.find_background import find_background
from smokelift.extraction.proxy import Proxy
from smokelift.footage.images import srgb_to_linear
from smokelift.footage.registration import Similarity, corners
from smokelift.output.images import write_image
from tests.engine.films import clip_of, codes_apart, grainy

COUNT, SIZE, MARGIN = 12, (120, 160), 40
STILL = (Similarity(),) * COUNT


@cache
def wall(contrast: float = 1.0) -> np.ndarray:
    """Return a wall (rows, columns) in sRGB values, wider than the picture by a margin."""
    random = np.random.default_rng(0)
    shape = (SIZE[0] + 2 * MARGIN, SIZE[1] + 2 * MARGIN)
    texture = sum(ndimage.gaussian_filter(random.standard_normal(shape), s) * s for s in (1.0, 3.0))
    return np.asarray(0.4 + 0.12 * contrast * texture)


def seen_at(behind: np.ndarray, motion: Similarity, parallax: float = 0.0) -> np.ndarray:
    """Return what a camera sees of a wall; with parallax shifts along rows grow towards the floor."""
    rows, columns = np.mgrid[: SIZE[0], : SIZE[1]].astype(np.float64)
    middle = (np.array(SIZE) - 1) / 2
    points = ((columns - middle[1]) + 1j * (rows - middle[0])) / max(SIZE)
    back = motion.inverse().moves(points) * max(SIZE)
    at = [rows + MARGIN + back.imag, columns + MARGIN + back.real * (1 + parallax * rows / SIZE[0])]
    return np.asarray(ndimage.map_coordinates(behind, at, order=3))


def filmed(
    motions: tuple[Similarity, ...],
    parallax: float = 0.0,
    smoke: float = 0.0,
    noise: float = 1.0,
    contrast: float = 1.0,
) -> np.ndarray:
    """Return frames of a wall, linear, each as a motion of the camera shows it.

    The smoke, up to so opaque, boils over a quarter of the picture. Noise is in 8 bit codes.
    """
    random, behind = np.random.default_rng(1), wall(contrast)
    columns = np.arange(SIZE[1])
    boil = ndimage.gaussian_filter(random.standard_normal((len(motions), *SIZE)), (1, 6, 6))
    opacity = smoke * np.clip(0.5 + 0.5 * boil / boil.std(), 0, 1) * (abs(columns - SIZE[1] / 2) < SIZE[1] / 8)
    shown = [
        seen_at(behind, motion, parallax) * (1 - cover) + 0.9 * cover
        for motion, cover in zip(motions, opacity, strict=True)
    ]
    codes = np.stack(shown)[..., None] + random.normal(0, noise / 255, (len(shown), *SIZE, 3))
    return np.asarray(srgb_to_linear(np.clip(codes, 0, 1)), np.float32)


def shifts(down: np.ndarray, right: np.ndarray) -> tuple[Similarity, ...]:
    """Return motions of shifts in pixels."""
    return tuple(Similarity(shift=complex(x, y) / max(SIZE)) for y, x in zip(down, right, strict=True))


def found(pictures: np.ndarray) -> CameraMotion | str | None:
    """Return the motion that is found in pictures."""
    count, seen, gains = len(pictures), np.ones(pictures.shape[:3], np.bool_), np.ones((len(pictures), 3), np.float32)
    return find_motion(Proxy(tuple(range(count)), (0, count - 1), pictures, pictures, seen, gains, {}, 1.0))


def pixels_off(motion: CameraMotion, truth: tuple[Similarity, ...]) -> float:
    """Return how far the corners of the worst frame are, in pixels, from where they belong."""
    at = corners(*SIZE[::-1])
    reference = truth[motion.reference], motion.measured[motion.reference]
    apart = [
        own.after(reference[1].inverse()).moves(at) - truth[number].after(reference[0].inverse()).moves(at)
        for number, own in motion.measured.items()
    ]
    return float(np.abs(apart).max()) * max(SIZE)


ALONG, NONE = np.linspace(-0.5, 0.5, COUNT), np.zeros(COUNT)
SHAKE = np.random.default_rng(2).uniform(-3, 3, (2, COUNT))
ROLL = tuple(Similarity((1 + 0.06 * a) * np.exp(0.05j * a), 0.1 * a) for a in ALONG)


@pytest.mark.parametrize(
    "motions",
    [shifts(*SHAKE), shifts(NONE, 30 * ALONG), shifts(NONE, 6 * ALONG), ROLL],
    ids=["shakes", "pans", "drifts", "rolls and zooms"],
)
def test_a_similarity_behind_smoke_is_measured(motions) -> None:
    motion = found(filmed(motions, smoke=0.9))
    assert isinstance(motion, CameraMotion)
    assert len(motion.measured) == COUNT
    assert pixels_off(motion, motions) < 0.5


def test_a_slow_zoom_with_little_texture_is_measured() -> None:
    """Only a part of the picture has any."""
    zoom = tuple(Similarity(1 + 0.06 * a) for a in ALONG)
    pictures = filmed(zoom, noise=0.5)
    pictures[:, :, : SIZE[1] * 2 // 3] = 0.2
    assert isinstance(found(pictures), CameraMotion)


BRIEF = np.where(np.arange(COUNT) == 3, 8.0, 0.0)


@pytest.mark.parametrize(
    ("motions", "how"),
    [
        (shifts(NONE, 20 * ALONG), {"parallax": 1.0}),  # a camera that travels
        (shifts(NONE, 76 * ALONG), {"smoke": 0.9}),  # what is seen for a few frames only
    ],
)
def test_a_camera_that_moves_as_no_similarity_is_refused(motions, how) -> None:
    with pytest.raises(ValueError):
        found(filmed(motions, **how))


@pytest.mark.parametrize(
    ("motions", "how"),
    [
        (STILL, {}),
        (STILL, {"smoke": 1.0}),
        (STILL, {"smoke": 1.0, "noise": 12.0}),
        (shifts(NONE, BRIEF), {"smoke": 0.9}),  # a knock
        (shifts(NONE, 0.6 * ALONG), {}),  # a camera that hardly moves
        (shifts(*SHAKE), {"smoke": 1.0, "contrast": 0.0}),  # smoke before one color
        (STILL[:1], {}),
    ],
)
def test_a_camera_that_stands_still_has_no_motion(motions, how) -> None:
    assert found(filmed(motions, **how)) is None


def ink(count: int) -> np.ndarray:
    """Return fine texture over half of black, which a swirl turns by one pixel per frame."""
    random, shape = np.random.default_rng(3), (180, 240)
    texture = sum(ndimage.gaussian_filter(random.standard_normal((360, 480)), s) * s for s in (1, 3))
    stream = ndimage.gaussian_filter(random.standard_normal(shape), 24)
    flow = np.stack([-np.gradient(stream, axis=1), np.gradient(stream, axis=0)])
    flow /= np.hypot(*flow).max()
    rows, columns = np.mgrid[: shape[0], : shape[1]].astype(float)
    at, pictures = np.stack([rows, columns]), []
    for _ in range(count):
        inside = np.clip(np.hypot(at[0] - 90, at[1] - 120) / -4 + 20, 0, 1)
        value = 0.45 + 0.12 * ndimage.map_coordinates(texture, at + 60, order=1)
        pictures.append(inside * np.clip(value, 0, 1) + random.normal(0, 0.5 / 255, shape))
        at = at - flow
    return np.asarray(srgb_to_linear(np.clip(np.stack(pictures)[..., None].repeat(3, -1), 0, 1)), np.float32)


def test_slow_ink_with_fine_texture_on_black_is_no_camera() -> None:
    assert found(ink(16)) is None


def puffing(motions: tuple[Similarity, ...]) -> Iterator[np.ndarray]:
    """Yield frames of a puff that rises before the wall, linear."""
    rows, columns = np.mgrid[: SIZE[0], : SIZE[1]]
    for n, motion in enumerate(motions):
        away = np.hypot(rows - SIZE[0] * (1.2 - 1.4 * n / len(motions)), columns - SIZE[1] / 2)
        opacity = np.clip(1.5 - away / 14, 0, 0.8)
        yield srgb_to_linear(seen_at(wall(), motion) * (1 - opacity) + 0.9 * opacity)[..., None].repeat(3, -1)


def clip_of_puff(folder: Path, motions: tuple[Similarity, ...]) -> Clip:
    return clip_of(folder, grainy(puffing(motions), 1.0, seed=4))


def plate_picture(folder: Path) -> Background:
    """The wall as a camera that has not moved sees it."""
    write_image(folder / "plate.exr", srgb_to_linear(seen_at(wall(), Similarity()))[..., None].repeat(3, -1))
    return Background(image=folder / "plate.exr")


def test_a_camera_that_moves_after_it_stood_is_registered(tmp_path) -> None:
    """Also if the frames in use are of one place: the plate is that of all of the file."""
    way, inner = np.clip((np.arange(24) - 12) / 6, 0, 1), np.s_[10:-10, 10:-10]
    motions = shifts(2 * way, 6 * way)
    whole = clip_of_puff(tmp_path, motions)
    for clip in (whole, whole.part(16, 22)):
        background = find_background(clip, None, None)
        plate = background.plate.at(0)
        truth = srgb_to_linear(seen_at(wall(), motions[background.motion.reference]))[..., None].repeat(3, -1)
        assert np.percentile(codes_apart(plate.image, truth)[inner], 95) < 12
        last = len(clip) - 1
        shown, seen = background.clip.frame(last), clip.registered(lambda *_: motions[-1]).seen(0, *clip.size)
        assert codes_apart(shown, truth)[inner].mean() < 4
        assert 0.9 < seen.mean() < 1


def test_a_clip_that_stands_still_stays_as_it_is(tmp_path) -> None:
    with clip_of_puff(tmp_path, STILL * 2) as clip:
        background = find_background(clip, None, None)
        assert background.motion is None
        np.testing.assert_array_equal(background.clip.frame(3), clip.frame(3))


@pytest.mark.parametrize("frame", [None, (0,)], ids=["picture", "frame of the clip"])
def test_a_clip_is_registered_to_a_plate_that_it_does_not_lie_on(tmp_path, frame) -> None:
    with clip_of_puff(tmp_path, shifts(NONE - 3, NONE + 4) if frame is None else shifts(*SHAKE)) as clip:
        background = find_background(clip, None, Background(frame=frame) if frame else plate_picture(tmp_path))
        assert background.motion.reference is None
        if frame is None:
            assert background.motion.reach(*SIZE[::-1]) == pytest.approx(5, abs=0.3)
        off = codes_apart(background.clip.frame(5 if frame else 0), background.plate.image)
        assert off[10 : SIZE[0] // 3, 10:-10].mean() < 4


def test_a_plate_of_another_place_is_refused(tmp_path) -> None:
    clip = clip_of_puff(tmp_path, shifts(NONE, NONE + 30))
    with clip, pytest.raises(ValueError):
        find_background(clip, None, plate_picture(tmp_path))
