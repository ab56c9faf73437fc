"""Depth with detail: the front is fitted, the side has detail, and nothing of it is there where it is not asked for."""

from collections.abc import Iterator
from dataclasses import replace
from itertools import islice

import numpy as np
import pytest
from scipy import ndimage

from smokelift import Camera, Clip, Domain, Scene, Settings, Shot, prepare_shot
from smokelift.density import DensitySettings, DepthPrior, DetailedDepth, GradientFit, RoundDepth, ViewSet, objective
from smokelift.density.synthesis import GAIN, OWN_PICTURE_DEGREES, EveryView, isotropic_filter
from smokelift.density.turntable import Turntable, UprightSmoke

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


def test_the_side_gets_detail_and_the_front_stays(shot, detailed) -> None:
    """More with more of it, nearly as much as the front has, for some decibels of a front that is fitted."""
    found = [*(fitted(shot, prior) for prior in (RoundDepth(), DetailedDepth(RoundDepth(), detail=0.5))), detailed]
    sides = [detail(density, 0) for density, _ in found]
    assert sides[0] < sides[1] < sides[2]
    assert sides[2] > 1.1 * sides[0]
    assert sides[2] > 0.5 * detail(found[2][0], 1)
    assert min(psnr for _, psnr in found) > found[0][1] - 5
    assert min(psnr for _, psnr in found) > 38


def test_another_seed_is_another_smoke(shot, detailed) -> None:
    (first, psnr), (other, psnr_other) = detailed, fitted(shot, DetailedDepth(RoundDepth(), seed=1))
    assert np.linalg.norm(fine(first, 0) - fine(other, 0)) > 0.3 * detail(first, 0)
    assert min(psnr, psnr_other) > 38


def test_what_is_known_of_the_side_is_kept(shot, detailed) -> None:
    """And the same smoke is made up each time."""
    views = ViewSet.of(shot.observe(2), shot.optics, 2)
    estimate = DetailedDepth(RoundDepth()).of_clip(shot).estimate(views)
    found = FIT.fit(views, estimate, None).density
    np.testing.assert_array_equal(found, detailed[0])
    layers, kept = (density.sum((0, 1), dtype=np.float64) for density in (found, estimate.detail.smooth_density))
    assert np.abs(layers - kept).sum() < 0.1 * kept.sum()
    place, smooth = (float(d.sum((0, 2)) @ np.arange(24) / d.sum()) for d in (found, estimate.detail.smooth_density))
    assert place == pytest.approx(smooth, abs=0.6)


@pytest.mark.parametrize("factor", [0.5, 1.5])
def test_smoke_is_sharpened_to_the_detail_of_the_clip(shot, factor) -> None:
    """Carried smoke of which a clip shows more, or less, detail becomes sharper, or softer; its low pass stays."""
    views = ViewSet.of(shot.observe(2), shot.optics, 2)
    detail = DetailedDepth(RoundDepth()).of_clip(shot).estimate(views).detail
    others = tuple(replace(each, fine_energy=factor**2 * each.fine_energy) for each in detail.texture.exemplars)
    changed = replace(detail, texture=replace(detail.texture, exemplars=others))
    smoke = rising(3)[2] * views.hull
    usual, other = (each.added(smoke, fresh=False) for each in (detail, changed))
    assert (fine(usual, 0).std() < fine(other, 0).std()) == (factor > 1)
    np.testing.assert_allclose(*(ndimage.gaussian_filter(each, 4) for each in (usual, other)), atol=0.05 * usual.max())


def lobes(scene: Scene, across: int) -> float:
    """How much noise changes the smoke of boxes a sixth as wide as the domain, in logarithms."""
    settings = replace(Settings.preset("draft"), resolution=(across, across, across * 4 // 3))
    with Clip.open(scene.clip) as clip:
        shot = prepare_shot(clip, scene, settings)
        views = ViewSet.of(shot.observe(2), shot.optics, 2)
        estimate = DetailedDepth(RoundDepth()).of_clip(shot).estimate(views)
    size = across // 6
    both = estimate.detail.smooth_density, estimate.density
    smooth, noisy = (density.reshape(6, size, 6, size, 8, size).mean((1, 3, 5)) for density in both)
    smoky = smooth > 0.1 * smooth.max()
    return float(np.log(noisy[smoky] / smooth[smoky]).std())


def test_lobes_are_as_strong_on_every_grid(plume, tmp_path, monkeypatch) -> None:
    scene = plume.write(tmp_path, rising(3))
    coarse = lobes(scene, 24)
    assert coarse > 0.15
    assert lobes(scene, 48) == pytest.approx(coarse, rel=0.25)
    monkeypatch.setattr(objective, "MIN_COARSENED_VOXELS", 10_000)
    assert lobes(scene, 48) == pytest.approx(coarse, rel=0.25)


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


def test_what_is_level_is_weakened_and_what_stands_is_not() -> None:
    """Detail without direction keeps its energy."""
    noise = np.random.default_rng(0).standard_normal((96, 128)).astype(np.float32)
    assert isotropic_filter(noise).std() == pytest.approx(1, rel=0.03)
    standing = np.cos(np.pi * (np.arange(64) + 0.5) * 16 / 64)[:, None] * np.ones(64)
    np.testing.assert_allclose(isotropic_filter(standing.astype(np.float32)), GAIN * standing, atol=1e-5)
    assert isotropic_filter(np.ascontiguousarray(standing.T, np.float32)).std() < 0.3 * standing.std()


@pytest.mark.parametrize(("change", "lowest", "highest"), [(isotropic_filter, 0.8, 1.25), (np.copy, 1.5, 3)])
def test_pictures_of_many_azimuths_add_up_to_detail_without_direction(change, lowest, highest) -> None:
    """As they are they draw level layers: the volume changes more along the height than across it."""
    domain = Domain((-1, -1, -1), (1, 1, 1), (32, 32, 32))
    table = Turntable.facing(Camera.look_at((0, -5, 0), (0, 0, 0), fov_y_degrees=30, size=(32, 32)), domain)
    volume, random = np.ones((32, 32, 32), np.float32), np.random.default_rng(1)
    smoke = UprightSmoke.of(table, volume)
    for degrees in np.arange(0, 180, 180 / 24):
        picture = 0.1 * ndimage.gaussian_filter(random.standard_normal(table.shape).astype(np.float32), 1.5)
        smoke.scale(np.ascontiguousarray(change(picture)), float(degrees))
    inner = np.log(volume)[8:24, 8:24]
    x, y, z = (np.mean(np.diff(inner, axis=axis) ** 2) for axis in range(3))
    assert lowest < 2 * z / (x + y) < highest
