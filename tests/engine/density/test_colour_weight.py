"""How much each combination of the colours counts before a background that is uncertain."""

from dataclasses import replace

import numpy as np
import pytest

from smokelift.density import DensitySettings, Observation, ViewSet, reconstruct_density
from smokelift.density.colour_weight import MODEL_ERROR, ColourWeight
from smokelift.density.objective import Term
from smokelift.density.observation import apparent_optical_depth
from smokelift.evaluation.metrics import psnr
from smokelift.footage.noise import EIGHT_BIT_NOISE
from smokelift.footage.plate import Plate, noise_at
from smokelift.render import Optics, render, scene_optics
from smokelift.scene import Scene, completed

WALL = np.array([0.1, 0.15, 0.3], np.float32)
SIZE = (42, 30)
FAINTER = 0.8
"""Of the wall's light, what is continued behind the smoke."""


@pytest.fixture(scope="module")
def small(plume) -> Scene:
    """The plume's scene with a picture as fine as the grid."""
    return replace(plume.scene, camera=plume.scene.camera.resized(*SIZE[::-1]), clip=None, background=None)


@pytest.fixture(scope="module")
def optics(small) -> Optics:
    return scene_optics(completed(small))


@pytest.fixture(scope="module")
def truth(plume) -> np.ndarray:
    """Smoke that lets some of the light behind it through."""
    return 0.3 * plume.densities[1]


@pytest.fixture(scope="module")
def picture(truth, small, optics) -> np.ndarray:
    """It before the wall."""
    return optics.renderer(small.camera, wall()).image(truth)


def wall() -> np.ndarray:
    return np.broadcast_to(WALL, (*SIZE, 3)).astype(np.float32)


def found_plate(deviation: float) -> Plate:
    """A plate that is right at the sides and too dark between them, and says that it may be wrong by so much."""
    confidence = np.ones(SIZE, np.float32)
    confidence[:, 6:24] = 0
    image = np.where(confidence[..., None] > 0, WALL, FAINTER * WALL)
    away = deviation * WALL
    return Plate(image.astype(np.float32), confidence, EIGHT_BIT_NOISE, np.outer(away, away).astype(np.float32))


def test_it_is_that_of_generalised_least_squares(picture) -> None:
    plate = found_plate(0.2)
    depth = np.full(SIZE, 0.7, np.float32)
    weight = ColourWeight.of(picture, plate, depth)
    assert weight is not None
    matrices = np.stack([weight.weighted(np.broadcast_to(unit, picture.shape)) for unit in np.eye(3, dtype=np.float32)])
    for row, column in ((20, 15), (30, 10), (20, 2)):
        change = np.abs(picture - plate.image)[row, column].mean()
        without = (noise_at(picture, plate)[row, column] ** 2).mean() + (MODEL_ERROR * change) ** 2
        behind = np.exp(-0.7) ** 2 * plate.errors * (1 - plate.confidence[row, column])
        wanted = without * np.linalg.inv(without * np.eye(3) + behind)
        np.testing.assert_allclose(matrices[:, row, column], wanted, atol=1e-5)
        np.testing.assert_allclose(weight.of_channels()[row, column], np.diag(wanted), atol=1e-5)


def test_a_certain_background_has_none(picture) -> None:
    plate, depth = found_plate(0.2), np.zeros(SIZE, np.float32)
    assert ColourWeight.of(picture, replace(plate, confidence=np.ones(SIZE, np.float32)), depth) is None
    assert ColourWeight.of(picture, found_plate(0.0), depth) is None


def test_thick_smoke_hides_what_is_uncertain(picture) -> None:
    weight = ColourWeight.of(picture, found_plate(0.2), np.full(SIZE, 12.0, np.float32))
    assert weight is not None
    np.testing.assert_allclose(weight.weighted(picture), picture, rtol=1e-4)


def term_of(small: Scene, optics: Optics, picture: np.ndarray, plate: Plate) -> Term:
    view = ViewSet.of([Observation(small.camera, picture, plate)], optics).views[0]
    return Term(view, optics.renderer(small.camera, plate.image), np.ones(SIZE, np.float32))


def test_the_objectives_gradient_is_that_of_what_it_counts(truth, small, optics, picture) -> None:
    term = term_of(small, optics, picture, found_plate(0.2))
    density = 0.7 * truth
    change = density * np.random.default_rng(3).standard_normal(density.shape).astype(np.float32)

    def residual(step: float) -> np.ndarray:
        return term.renderer.image((density + step * change).astype(np.float32), keep_record=True) - picture

    difference = (term.loss(residual(1e-2)) - term.loss(residual(-1e-2))) / 2e-2
    slope = np.vdot(term.renderer.gradient(term.image_gradient(residual(0.0))), change)
    assert slope == pytest.approx(difference, rel=2e-3)
    plain = replace(term, view=replace(term.view, colours=None))
    assert abs(np.vdot(term.renderer.gradient(plain.image_gradient(residual(0.0))), change) / slope - 1) > 0.1


def test_the_other_colours_tell_smoke_from_a_wall_that_is_continued_too_dark(truth, small, picture) -> None:
    def errors(deviation: float) -> tuple[float, float]:
        settings = DensitySettings(fit_iterations=4, descent_iterations=6)
        found = reconstruct_density(picture, small, settings=settings, plate=found_plate(deviation)).density
        return abs(found.sum() / truth.sum() - 1), psnr(render(found, small), render(truth, small))

    coloured, plain = errors(0.2), errors(0.0)
    assert coloured[0] < 0.1
    assert plain[0] > 0.5
    assert coloured[1] > plain[1] + 10


def test_a_wall_that_is_continued_too_bright_is_no_smoke_in_shadow(optics) -> None:
    bright, everywhere = replace(found_plate(0.2), image=1.2 * wall()), np.ones(SIZE, np.bool_)
    certain = replace(bright, errors=np.zeros((3, 3), np.float32))
    assert apparent_optical_depth(wall(), certain, everywhere, optics).min() > 2
    depth = apparent_optical_depth(wall(), bright, everywhere, optics)
    assert depth[bright.confidence == 0].max() == 0
    assert depth[bright.confidence == 1].min() > 2


def test_specks_that_a_codec_leaves_are_no_smoke_in_shadow(optics) -> None:
    """Amid thin smoke that brightens the wall a few pixels are darker than the wall; a shaded side is a patch."""
    plate, everywhere = (
        replace(found_plate(0.0), image=wall(), confidence=np.ones(SIZE, np.float32)),
        np.ones(SIZE, bool),
    )
    darker = np.zeros(SIZE, np.bool_)
    darker[5:40:4, 4:28:5] = True
    darker[20, 3:20] = True
    darker[30:36, 20:26] = True
    depth = apparent_optical_depth(np.where(darker[..., None], 0.8, 1.1) * wall(), plate, everywhere, optics)
    thick = depth > 2
    assert thick[30:36, 20:26].all()
    assert thick.sum() == 36
