"""Depth with detail: the front is fitted, the side has detail, and nothing of it is there where it is not asked for."""

from collections.abc import Iterator
from itertools import islice

import numpy as np
import pytest
from scipy import ndimage

from smokelift import Clip, Settings, Shot, prepare_shot
from smokelift.density import DensitySettings, DepthPrior, DetailedDepth, GradientFit, RoundDepth, ViewSet
from smokelift.density.synthesis import OWN_PICTURE_DEGREES, EveryView

FRAMES = 6
FIT = GradientFit(DensitySettings(fit_iterations=6, descent_iterations=8))


def rising(frames: int) -> list[np.ndarray]:
    """A column of thin smoke as detailed along every axis, whose detail rises and changes."""
    random = np.random.default_rng(3)
    noise = ndimage.gaussian_filter(random.normal(size=(24, 24, 32 + 3 * frames)), 1.4)
    x, y, z = np.meshgrid(*(np.arange(n) + 0.5 - n / 2 for n in (24, 24, 32)), indexing="ij")
    column = np.exp(-((np.hypot(x, y) / 6) ** 4) - (z / 12) ** 4)
    parts = (noise[..., 3 * (frames - n) : 3 * (frames - n) + 32] for n in range(frames))
    return [(0.2 * column * np.clip(0.5 + 1.2 * part / noise.std(), 0, None)).astype(np.float32) for part in parts]


@pytest.fixture(scope="module")
def shot(plume, tmp_path_factory) -> Iterator[Shot]:
    """The column's clip from the front."""
    scene = plume.write(tmp_path_factory.mktemp("rising"), rising(FRAMES))
    with Clip.open(scene.clip) as clip:
        yield prepare_shot(clip, scene, Settings.preset("draft"))


def fitted(shot: Shot, prior: DepthPrior, frame: int = 2) -> tuple[np.ndarray, float]:
    """The density of a frame, and its picture's PSNR."""
    views = ViewSet.of(shot.observe(frame), shot.optics, frame)
    found = FIT.fit(views, prior.of_clip(shot).estimate(views), None)
    return found.density, found.figures["psnr"]


@pytest.fixture(scope="module")
def detailed(shot) -> tuple[np.ndarray, float]:
    """With all of the detail that is made up."""
    return fitted(shot, DetailedDepth(RoundDepth()))


def fine(density: np.ndarray, axis: int) -> np.ndarray:
    """What a blur across takes away of the projection along an axis, in units of the projection."""
    picture = density.sum(axis, dtype=np.float64)
    return (picture - ndimage.gaussian_filter1d(picture, 2, axis=0)) / np.linalg.norm(picture)


def detail(density: np.ndarray, axis: int) -> float:
    """Its strength."""
    return float(np.linalg.norm(fine(density, axis)))


def test_another_seed_is_another_smoke(shot, detailed) -> None:
    (first, psnr), (other, psnr_other) = detailed, fitted(shot, DetailedDepth(RoundDepth(), seed=1))
    assert np.linalg.norm(fine(first, 0) - fine(other, 0)) > 0.3 * detail(first, 0)
    assert min(psnr, psnr_other) > 38


def test_no_azimuth_is_near_to_a_camera(two_views) -> None:
    with Clip.open(two_views.clip) as clip:
        seen = prepare_shot(clip, two_views, Settings.preset("draft"))
        views = ViewSet.of(seen.observe(1), seen.optics, 1)
        detail = DetailedDepth(RoundDepth()).of_clip(seen).estimate(views).detail
    assert isinstance(detail, EveryView)
    table = detail.texture.turntable
    cameras = [table.degrees(view.camera) for view in views.views]
    degrees = np.array([degrees for _, degrees in islice(detail.azimuths(), 60)])
    assert min(abs((each - camera + 90) % 180 - 90) for each in degrees for camera in cameras) >= OWN_PICTURE_DEGREES
    assert np.diff(np.sort(degrees)).max() < 2.5 * OWN_PICTURE_DEGREES
