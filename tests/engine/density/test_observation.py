"""An observation against the grid: an element's four channels, and fits of it whatever the plate behind it."""

import os
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from smokelift import _core
from smokelift.density import DensitySettings, Observation, ObservedView, RoundDepth, ViewSet, reconstruct_density
from smokelift.density.fit import GradientFit
from smokelift.density.observation import USEFUL_DEVIATION, WHITE, eight_bit_plate
from smokelift.extraction import Element
from smokelift.footage.images import blurred
from smokelift.footage.plate import noise_at
from smokelift.render import Renderer, render, scene_optics
from smokelift.scene import Background, Scene, completed

QUICK = DensitySettings(fit_iterations=4, descent_iterations=6)
GRAY = np.array((0.1, 0.12, 0.15), np.float32)


@pytest.fixture(scope="module")
def small(plume) -> Scene:
    """The plume's scene with a picture as fine as the grid."""
    return replace(plume.scene, camera=plume.scene.camera.resized(30, 42), clip=None)


@pytest.fixture(scope="module")
def wall() -> np.ndarray:
    """Strong detail about the gray, of all colors."""
    detail = blurred(np.random.default_rng(2).standard_normal((42, 30, 3)).astype(np.float32), 1.0)
    return (GRAY * np.maximum(1 + 0.6 * detail / detail.std(), 0.05)).astype(np.float32)


def element_of(plume, small: Scene) -> Element:
    """What the plume's smoke sends and lets through, as it is known of a render."""
    complete = completed(small)
    renderer = Renderer(complete.camera, complete.domain, complete.medium, complete.lights, np.zeros(3, np.float32))
    radiance = renderer.image(plume.densities[1])
    clear = renderer.transmittance
    return Element(radiance, clear, np.full(clear.shape, 0.01, np.float32), np.ones(clear.shape, np.float32))


def test_an_element_is_seen_over_one_color_and_a_white(plume, small, wall) -> None:
    element, plate = element_of(plume, small), eight_bit_plate(wall, small.camera.size)
    picture = element.over(wall)
    view = ObservedView.of(Observation(small.camera, picture, plate, element), scene_optics(completed(small)))
    color, white = view.background[0, 0, :3], view.background[..., 3]
    np.testing.assert_allclose(view.background[..., :3], np.broadcast_to(color, (42, 30, 3)))
    np.testing.assert_allclose(color, wall.mean((0, 1)), rtol=1e-4)
    opacity = 1 - element.transmittance
    sent = (opacity * element.radiance.mean(-1)).sum() / opacity.sum()
    known = np.hypot(1, element.deviation / USEFUL_DEVIATION)
    np.testing.assert_allclose(white * known, WHITE * max(sent, color.mean()), rtol=1e-4)
    inside = view.probability == 1
    assert inside.sum() > 50
    np.testing.assert_allclose(view.image[inside][:, :3], element.over(color)[inside], rtol=1e-5)
    np.testing.assert_allclose(view.image[inside][:, 3], (white * element.transmittance)[inside], rtol=1e-5)
    np.testing.assert_allclose(view.image[view.probability == 0], view.background[view.probability == 0], rtol=1e-6)
    noise = noise_at(picture, plate)
    np.testing.assert_allclose(view.noise, np.dstack([noise, noise.mean(-1)]), rtol=1e-6)


def test_the_color_of_an_element_is_that_of_the_known_plate(plume, small, wall) -> None:
    """What is filled in under the smoke counts for nothing beside what is seen."""
    element = element_of(plume, small)
    plate = eight_bit_plate(wall, small.camera.size)
    confidence = np.ones((42, 30), np.float32)
    confidence[:, 10:20] = 0
    wrong = wall.copy()
    wrong[:, 10:20] = 5.0
    plate = replace(plate, image=wrong, confidence=confidence)
    view = ObservedView.of(
        Observation(small.camera, element.over(wall), plate, element), scene_optics(completed(small))
    )
    seen = np.concatenate([wall[:, :10], wall[:, 20:]], 1)
    np.testing.assert_allclose(view.background[0, 0, :3], seen.mean((0, 1)), rtol=1e-3)


def test_an_element_starts_with_its_optical_depth(plume, small, wall) -> None:
    """Shadowed smoke too, whose colors alone would say that there is none: the white shows it."""
    element, plate = element_of(plume, small), eight_bit_plate(wall, small.camera.size)
    optics = scene_optics(completed(small))
    view = ObservedView.of(Observation(small.camera, element.over(wall), plate, element), optics)
    true = -np.log(element.transmittance)
    thick = (view.probability == 1) & (true > 0.5)
    assert thick.sum() > 30
    ratio = view.optical_depth[thick] / true[thick]
    np.testing.assert_allclose(ratio, 1, atol=0.02)
    assert (view.optical_depth[~view.mask] == 0).all()


def test_what_an_element_leaves_out_is_a_fault_of_the_fit(plume, small, wall) -> None:
    """A hand before the smoke is an outlier of the extraction; nothing of it is fitted, and the figures say so."""
    element, plate = element_of(plume, small), eight_bit_plate(wall, small.camera.size)
    hand = np.zeros((42, 30, 1), np.float32)
    hand[20:26, 12:18] = 0.4
    optics = scene_optics(completed(small))
    errors = []
    for picture in (element.over(wall), element.over(wall) + hand):
        seen = ViewSet.of([Observation(small.camera, picture, plate, element)], optics)
        (view,) = seen.views
        np.testing.assert_allclose(
            view.left_out, view.probability[..., None] * (picture - element.over(wall)), atol=1e-6
        )
        figures = GradientFit(QUICK).fit(seen, RoundDepth().estimate(seen), None).figures
        errors.append(figures["relative_error"])
    assert errors[0] < 0.1
    assert errors[1] > 0.3


def test_smoke_before_a_wall_is_extracted_and_fitted(plume, small, wall) -> None:
    """Nothing but the picture and its plate is given. The result before gray is the smoke before gray."""
    element, gray = element_of(plume, small), wall.mean((0, 1))
    plate = eight_bit_plate(wall, small.camera.size)
    found = reconstruct_density(element.over(wall), small, settings=QUICK, plate=plate).density
    shown = render(found, replace(small, background=Background(color=tuple(map(float, gray)))))
    contrast = np.abs(element.over(gray) - gray).mean()
    assert np.abs(shown - element.over(gray)).mean() < 0.1 * contrast
    assert found.sum() == pytest.approx(plume.densities[1].sum(), rel=0.2)


STATM = Path("/proc/self/statm")


@pytest.mark.skipif(not STATM.exists(), reason="the system does not say how much memory is in use")
def test_memory_of_a_volume_follows_the_hull() -> None:
    """An array of 256 MB with smoke in a hundredth of the box takes a tenth of that at most, read or not."""
    hull = np.zeros((256, 512, 512), np.bool_)
    hull[100:112, 100:230, 100:230] = True
    views = SimpleNamespace(hull=hull, where=_core.MarkedVoxels(hull))
    before = int(STATM.read_text().split()[1])
    found = ViewSet.volume(views, np.ones(np.count_nonzero(hull), np.float32))
    assert found.sum(dtype=np.float64) == np.count_nonzero(hull)
    taken = (int(STATM.read_text().split()[1]) - before) * os.sysconf("SC_PAGE_SIZE")
    assert taken < 0.1 * found.nbytes
