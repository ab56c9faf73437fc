"""Whether a camera is found to travel."""

from __future__ import annotations

import numpy as np
import pytest
from scipy import ndimage
from scipy.spatial.transform import Rotation
from turning_camera import COUNT, LENS, MARGIN, SIZE, clip_of, pictures, wall

from smokelift.footage.images import linear_to_srgb, srgb_to_linear
from smokelift.footage.parallax import travels
from smokelift.footage.turning import find_turns


def over_a_plain(pixels: float) -> np.ndarray:
    """Return frames of a camera that goes sideways: what is near, below, moves by so many pixels, the far by none."""
    plate = wall()
    y, x = np.mgrid[: SIZE[1], : SIZE[0]] + float(MARGIN)
    noise = np.random.default_rng(3)
    frames = []
    for along in np.linspace(-0.5, 0.5, COUNT) * pixels:
        at = [y, x + along * (y - MARGIN) / SIZE[1]]
        seen = np.stack([ndimage.map_coordinates(plate[..., c], at, order=3, mode="nearest") for c in range(3)], -1)
        frames.append(linear_to_srgb(seen) + noise.normal(0, 1 / 255, seen.shape))
    return srgb_to_linear(np.clip(np.stack(frames), 0, 1)).astype(np.float32)


def test_a_camera_that_travels_is_refused() -> None:
    """In one sentence that says what to do."""
    with pytest.raises(ValueError, match=r"^The camera travels or zooms, .*; track it in Blender, .*clean plate\.$"):
        find_turns(clip_of(over_a_plain(30)[::2]), LENS)


def test_a_camera_that_hardly_travels_is_not() -> None:
    """It moves the picture by less than a pixel where it moves it most."""
    assert find_turns(clip_of(over_a_plain(0.8)), LENS) is None


def test_smoke_before_a_wall_is_no_travel() -> None:
    """The wall that shows through stands still, even where the smoke leaves too little of it to estimate a turn."""
    frames, _ = pictures(wall(), Rotation.identity(COUNT), smoke=1.0)
    assert not travels(clip_of(frames), LENS, range(COUNT))


def test_what_does_not_keep_its_shape_is_no_travel() -> None:
    """Texture everywhere that is another one in every frame."""
    random = np.random.default_rng(4)
    boil = ndimage.gaussian_filter(random.standard_normal((COUNT, SIZE[1], SIZE[0], 3)), (1, 3, 3, 0))
    frames = srgb_to_linear(np.clip(0.4 + 0.1 * boil / boil.std(), 0, 1)).astype(np.float32)
    clip = clip_of(frames)
    assert find_turns(clip, LENS) is None
    assert not travels(clip, LENS, range(COUNT))


def test_too_little_texture_tells_nothing() -> None:
    """A band of it, as smoke is before something smooth, may move in its own way."""
    frames = over_a_plain(30)
    frames[:, :, 50:] = 0.2
    assert not travels(clip_of(frames), LENS, range(COUNT))
