"""The usual source radiance: what the smoke of a few pictures sends, over its opacity, in the color of its light."""

from dataclasses import replace

import numpy as np
import pytest
from scipy import ndimage

from smokelift.extraction.element import Cells, first_source, shows_transmittance, usual_source
from smokelift.extraction.plate import Plate
from smokelift.footage.noise import lasting_noise
from tests.engine.extraction.test_element import (
    PLATES,
    RADIANCE,
    SOURCE,
    TRANSMITTANCE,
    clear_picture,
    filmed,
    plate_of,
)

SIZE = (192, 160)
"""Columns and rows of the pictures."""


def plate(texture: float) -> Plate:
    """A wall of a warm gray with so much texture, in grains of three pixels."""
    shape = SIZE[1], SIZE[0]
    grains = np.random.default_rng(1).standard_normal((shape[0] // 3 + 1, shape[1] // 3 + 1))
    detail = texture * np.kron(grains, np.ones((3, 3)))[: shape[0], : shape[1], None] * np.array((1.0, 0.8, 0.6))
    return Plate((0.2 + detail).astype("f4"), np.ones(shape, np.float32), lasting_noise(0.004))


def before(behind: Plate, source: tuple[float, ...], depth: float | np.ndarray, height: float) -> np.ndarray:
    """A blob of smoke of an optical depth before a plate, with noise."""
    x, y = np.meshgrid(np.arange(SIZE[0]), np.arange(SIZE[1]))
    clear = np.exp(-depth * np.exp(-((x - 96) ** 2 + (y - height) ** 2) / 1200))[..., None]
    noise = 0.003 * np.random.default_rng(2).standard_normal((*clear.shape[:2], 3))
    return (clear * behind.image + (1 - clear) * source + noise).astype("f4")


@pytest.mark.parametrize("depth", [0.5, 1.0, 3.0])
@pytest.mark.parametrize(
    "source", [(0.6, 0.6, 0.6), (0.7, 0.6, 0.42), (0.45, 0.6, 0.75)], ids=["white", "warm", "cold"]
)
def test_texture_tells_the_light_of_thin_and_of_thick_smoke(source, depth) -> None:
    wall = plate(0.04)
    pictures = [(before(wall, source, depth, height), wall) for height in (70, 90)]
    assert usual_source(pictures, (48, 40)) == pytest.approx(np.array(source), rel=0.2)


@pytest.mark.parametrize(
    ("source", "within"), [((0.3, 0.3, 0.3), 0.05), ((0.6, 0.35, 0.15), 0.15)], ids=["gray", "orange"]
)
def test_before_a_smooth_wall_smoke_is_gray_unless_no_thickness_makes_it_gray(source, within) -> None:
    """Its hue trades for its opacity there, and ragged smoke alone shows a tenth of the wall's hue as its own."""
    beige = np.linspace((0.46, 0.36, 0.23), (0.3, 0.22, 0.14), SIZE[1], dtype=np.float32)
    wall = replace(plate(0.0), image=np.repeat(beige[:, None], SIZE[0], axis=1))
    ragged = ndimage.gaussian_filter(np.random.default_rng(4).standard_normal(SIZE[::-1]), 2.4)
    depth = 2 * np.exp(ragged / ragged.std())
    found = usual_source([(before(wall, source, depth, height), wall) for height in (70, 90)], (48, 40))
    np.testing.assert_allclose(found / found.mean(), np.array(source) / np.mean(source), rtol=within)


@pytest.mark.parametrize("depth", [0.5, 1.0, 2.0])
def test_bright_smoke_of_the_hue_of_a_dim_plate_is_as_bright_as_it_is(depth) -> None:
    """A label that is brighter than the smoke, and of another color, does not start the search for its light."""
    source = np.array((0.3, 0.5, 0.9))
    dim = plate(0.01)
    image = (dim.image * np.array((0.15, 0.35, 1.2))).astype("f4")
    image[:16] = 0.9, 0.35, 0.3
    wall = Plate(image, dim.confidence, dim.noise)
    pictures = [(before(wall, tuple(source), depth, height), wall) for height in (90, 110)]
    found = usual_source(pictures, (48, 40))
    assert (np.abs(np.log2(found / source)) < 1.2).all()


def test_errors_of_a_plate_are_not_taken_for_the_source() -> None:
    wall = plate(0.06)
    wrong = (wall.image + 0.3 * (np.arange(SIZE[0]) > 120)[:, None]).astype("f4")
    unknown = np.broadcast_to((np.arange(SIZE[0]) <= 120).astype("f4"), SIZE[::-1]).copy()
    off = Plate(wrong, unknown, wall.noise, np.full((3, 3), 0.09, "f4") + 1e-3 * np.eye(3, dtype="f4"))
    pictures = [(before(wall, (0.6, 0.6, 0.6), 1.0, height), off) for height in (70, 90)]
    assert usual_source(pictures, (48, 40)) == pytest.approx(np.full(3, 0.6), rel=0.25)


@pytest.mark.parametrize("light", [0.0, 1.0])
def test_without_smoke_the_source_can_be_divided_by(light) -> None:
    """Before a wall and before black, where nothing is seen."""
    wall = replace(plate(0.04), image=light * plate(0.04).image)
    source = usual_source([(before(wall, (0.6, 0.6, 0.6), 0.0, 80) if light else wall.image, wall)], (48, 40))
    assert np.isfinite(source).all() and (source > 0).all()


def test_a_plate_shows_transmittance_by_its_detail_or_by_its_hue() -> None:
    """A dusk is gray on the mean, but of a hue everywhere; before it smoke of a gray wall's color shows."""
    gray = np.full(3, 0.6, np.float32)
    dusk = np.repeat(np.linspace((0.1, 0.2, 0.3), (0.3, 0.2, 0.1), SIZE[1]).astype("f4")[:, None], SIZE[0], axis=1)
    smooth = np.broadcast_to(dusk.mean(-1, keepdims=True), dusk.shape)
    assert shows_transmittance(dusk, gray)
    assert not shows_transmittance(smooth, gray)
    assert shows_transmittance(plate(0.04).image.mean(-1, keepdims=True) * gray, gray)


@pytest.mark.parametrize("brightness", [0.3, 1.0, 4.0])
@pytest.mark.parametrize("image", PLATES.values(), ids=PLATES.keys())
def test_the_source_is_found_from_the_pictures(brightness, image) -> None:
    """Within 20 %, of dim smoke as of smoke that is brighter than its plate; its color within 7 %, by a sky's hue."""
    clear = TRANSMITTANCE[..., None]
    picture = filmed((1 - clear) * RADIANCE * brightness + clear * image)
    found = usual_source([(picture, plate_of(image)), (picture[::-1], plate_of(image[::-1]))], (48, 36))
    np.testing.assert_allclose(found / found.mean(), SOURCE / SOURCE.mean(), rtol=0.07)
    assert found.mean() == pytest.approx(SOURCE.mean() * brightness, rel=0.2)


def test_smoke_counts_by_its_weight_in_the_source() -> None:
    """A clip's clear frames say nothing of the light."""
    image = PLATES["wall"]
    smoky, empty = (filmed(clear_picture(image)), plate_of(image)), (filmed(image), plate_of(image))
    alone = usual_source([smoky], (48, 36))
    np.testing.assert_allclose(usual_source([smoky, empty, empty], (48, 36)), alone, rtol=0.05)


@pytest.mark.parametrize(
    ("source", "hue"), [((0.5, 0.68, 0.45), 0.0), ((0.2, 0.35, 0.8), 0.57)], ids=["leaves through it", "blue lamps"]
)
def test_the_search_starts_from_gray_unless_what_brightens_is_far_from_it(source, hue) -> None:
    wall = plate(0.04)
    cells = Cells.of(before(wall, source, 3.0, 80), wall, (48, 40))
    first = first_source([cells])
    assert np.std(first) / first.mean() == pytest.approx(hue, abs=0.1)
    assert first.mean() == pytest.approx(np.mean(source), rel=0.2)
