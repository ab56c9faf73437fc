"""An observation against the grid: an element's four channels, and fits of it whatever the plate behind it."""

import os
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from smokelift import _core
from smokelift.density import DensitySettings, Observation, RoundDepth, ViewSet, reconstruct_density
from smokelift.density.fit import GradientFit
from smokelift.density.observation import USEFUL_DEVIATION, WHITE, ObservedView, eight_bit_plate
from smokelift.extraction.element import Element, extract_element
from smokelift.extraction.plate import Plate, noise_at
from smokelift.footage.images import Picture, blurred, linear_to_srgb, srgb_to_linear
from smokelift.render import render, scene_optics, scene_renderer
from smokelift.scene import Background, Scene, completed

QUICK = DensitySettings(fit_iterations=4, descent_iterations=6)
GRAY = np.array((0.1, 0.12, 0.15), np.float32)
VEIL = np.clip(1.5 * (1 - np.hypot(*(np.mgrid[:140, :100] - np.array((45, 50))[:, None, None])) / 25), 0, 1)
"""How dense a veil is beside its middle, pixel by pixel."""


@pytest.fixture(scope="module")
def wall() -> np.ndarray:
    """Strong detail about the gray, of all colors."""
    detail = blurred(np.random.default_rng(2).standard_normal((42, 30, 3)).astype(np.float32), 1.0)
    return (GRAY * np.maximum(1 + 0.6 * detail / detail.std(), 0.05)).astype(np.float32)


@pytest.fixture(scope="module")
def element(plume, small) -> Element:
    """What the plume's smoke sends and lets through, as it is known of a render."""
    renderer = scene_renderer(completed(small), background=np.zeros(3, np.float32))
    radiance, clear = renderer.image(plume.densities[1]), renderer.transmittance
    certain = np.full(clear.shape, 0.01, np.float32)
    return Element(radiance, clear, certain, 0.1 * certain, np.ones(clear.shape, np.float32))


def seen(small: Scene, picture: np.ndarray, plate: Plate, element: Element) -> ViewSet:
    """A picture whose smoke is known apart from its plate."""
    return ViewSet.of([Observation(small.camera, picture, plate, element)], scene_optics(completed(small)))


def test_an_element_is_seen_over_one_color_and_a_white(small, wall, element) -> None:
    plate, picture = eight_bit_plate(wall, small.camera.size), element.over(wall)
    (view,) = seen(small, picture, plate, element).views
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
    # it starts with its optical depth, shadowed smoke too, whose colors alone would say that there is none
    true = -np.log(element.transmittance)
    thick = inside & (true > 0.5)
    assert thick.sum() > 30
    np.testing.assert_allclose(view.optical_depth[thick] / true[thick], 1, atol=0.02)
    assert (view.optical_depth[~view.mask] == 0).all()


def test_a_shaded_side_is_no_hole_in_an_assumed_light(small, wall, element) -> None:
    """The clip's light comes from the right, of which the scene's knows nothing: there the transmittance tells more."""
    dark = np.linspace(0, 2, element.radiance.shape[1], dtype=np.float32)[None, :, None]
    shaded = replace(element, radiance=dark * element.radiance)
    left, errors = np.s_[:, :15], {}
    for assumed in (False, True):
        picture, plate = shaded.over(wall), eight_bit_plate(wall, small.camera.size)
        observation = Observation(small.camera, picture, plate, shaded, light_assumed=assumed)
        views = ViewSet.of([observation], scene_optics(completed(small)))
        density = GradientFit(QUICK).fit(views, RoundDepth().estimate(views), None).density
        renderer = scene_renderer(completed(small))
        renderer.image(density)
        errors[assumed] = np.abs(renderer.transmittance - element.transmittance)[left].mean()
    assert errors[True] < 0.5 * errors[False]


def test_an_element_that_sends_nothing_before_black_is_seen(small, element) -> None:
    """As where a flame, or its light, goes out."""
    dark, plate = replace(element, radiance=0 * element.radiance), eight_bit_plate(np.zeros(3), small.camera.size)
    observation = Observation(small.camera, dark.radiance, plate, dark, light_assumed=True)
    assert np.isfinite(ObservedView.of(observation, scene_optics(completed(small))).background).all()


def test_what_sends_no_light_tells_less_of_smoke_in_an_assumed_light(small, wall, element) -> None:
    """It may be hair before the wall; with the light known, smoke there would send none either."""
    hair = np.s_[4:8, 4:8]
    radiance, clear = element.radiance.copy(), element.transmittance.copy()
    radiance[hair], clear[hair] = 0, 0.1
    person, plate = replace(element, radiance=radiance, transmittance=clear), eight_bit_plate(wall, small.camera.size)
    whites = {}
    for assumed in (False, True):
        observation = Observation(small.camera, person.over(wall), plate, person, light_assumed=assumed)
        whites[assumed] = ObservedView.of(observation, scene_optics(completed(small))).background[..., 3]
    smoky = element.transmittance < 0.5
    assert np.ptp(whites[False]) < 1e-3 * whites[False].max()
    assert whites[True][hair].max() < 0.6 * np.median(whites[True][smoky])


def test_the_color_of_an_element_is_that_of_the_known_plate(small, wall, element) -> None:
    """What is filled in under the smoke counts for nothing beside what is seen."""
    confidence, wrong = np.ones((42, 30), np.float32), wall.copy()
    confidence[:, 10:20], wrong[:, 10:20] = 0, 5.0
    plate = replace(eight_bit_plate(wall, small.camera.size), image=wrong, confidence=confidence)
    (view,) = seen(small, element.over(wall), plate, element).views
    known = np.delete(wall, np.s_[10:20], 1)
    np.testing.assert_allclose(view.background[0, 0, :3], known.mean((0, 1)), rtol=1e-3)


def test_what_an_element_leaves_out_is_a_fault_of_the_fit(small, wall, element) -> None:
    """A hand before the smoke is an outlier of the extraction; nothing of it is fitted, and the figures say so."""
    plate, hand = eight_bit_plate(wall, small.camera.size), np.zeros((42, 30, 3), np.float32)
    hand[20:26, 12:18] = 0.4
    errors = []
    for before in (0 * hand, hand):
        views = seen(small, element.over(wall) + before, plate, element)
        np.testing.assert_allclose(views.views[0].left_out, views.views[0].probability[..., None] * before, atol=1e-6)
        errors.append(GradientFit(QUICK).fit(views, RoundDepth().estimate(views), None).figures["relative_error"])
    assert errors[0] < 0.1
    assert errors[1] > 0.3


@pytest.mark.parametrize("brightness", [0.7, 2.0])
def test_an_assumed_light_that_is_wrong_makes_smoke_nothing_else(small, wall, element, brightness) -> None:
    """The fit follows T then, and is judged by it: the light's error is no fault of what counts as smoke."""
    plate, lit = eight_bit_plate(wall, small.camera.size), replace(element, radiance=brightness * element.radiance)
    observation = Observation(small.camera, lit.over(wall), plate, lit, light_assumed=True)
    views = ViewSet.of([observation], scene_optics(completed(small)))
    assert GradientFit(QUICK).fit(views, RoundDepth().estimate(views), None).figures["relative_error"] < 0.3


def test_smoke_before_a_wall_is_extracted_and_fitted(plume, small, wall, element) -> None:
    """Nothing but the picture and its plate is given. The result before gray is the smoke before gray."""
    gray, plate = wall.mean((0, 1)), eight_bit_plate(wall, small.camera.size)
    found = reconstruct_density(element.over(wall), small, settings=QUICK, plate=plate).density
    shown = render(found, replace(small, background=Background(color=tuple(map(float, gray)))))
    assert np.abs(shown - element.over(gray)).mean() < 0.1 * np.abs(element.over(gray) - gray).mean()
    assert found.sum() == pytest.approx(plume.densities[1].sum(), rel=0.2)


def filmed(small: Scene, contrast: float, opacity: float, codes: float) -> list[Picture]:
    """Where three pictures of a veil before a wall of the same mean color show smoke, in noise and a codec's shifts.

    The wall's detail has a contrast, and its blocks of 8 to 64 pixels shift by so many codes.
    """
    rows, columns = 140, 100
    camera = small.camera.resized(columns, rows)
    detail = blurred(np.random.default_rng(2).standard_normal((rows, columns, 3)).astype(np.float32), 1.0)
    wall = (np.array((0.16, 0.13, 0.1)) * np.maximum(1 + contrast * detail / detail.std(), 0.05)).astype(np.float32)
    plate = eight_bit_plate(wall, camera.size)
    veil = opacity * VEIL[..., None]
    behind, shown = 255 * linear_to_srgb(wall * (1 - veil) + veil * wall.mean((0, 1))), []
    for seed in range(3):
        random = np.random.default_rng(seed)
        noisy = behind + random.normal(0, 0.5, behind.shape)
        for side in (8, 16, 32, 64):
            shifts = random.normal(0, codes / 2, (-(-rows // side), -(-columns // side), 3))
            noisy += np.kron(shifts, np.ones((side, side, 1)))[:rows, :columns]
        picture = srgb_to_linear((np.round(noisy) / 255).astype(np.float32))
        element = extract_element(picture, plate, np.full(3, 0.2, np.float32), camera.size)
        observed = Observation(camera, picture, plate, element)
        shown.append(ObservedView.of(observed, scene_optics(completed(small))).probability)
    return shown


@pytest.mark.parametrize(("contrast", "codes"), [(0.1, 0.2), (0.1, 0.4), (0.4, 0.4)])
def test_shifts_of_wide_blocks_are_no_smoke(small, contrast, codes) -> None:
    """A codec's fractions of a step are certain in the mean of a wide patch, but no smoke."""
    assert not any(probability.any() for probability in filmed(small, contrast, 0.0, codes))


@pytest.mark.parametrize("codes", [0.0, 0.2])
def test_a_faint_veil_is_seen_by_the_detail_that_it_hides(small, codes) -> None:
    """It hides a tenth of the detail, and lies apart from all other smoke."""
    for probability in filmed(small, 0.4, 0.1, codes):
        assert probability[VEIL > 0.9].mean() > 0.3
        assert not probability[VEIL == 0].any()


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
