"""The same texture elsewhere is near, blur, rows and noise are far; shapes along rays of bodies that are known."""

import numpy as np
import pytest
from scipy import ndimage

from smokelift.evaluation.metrics import PatchStatistics, RayShapes, mean_gradient

X, Y, Z = np.meshgrid(*(np.arange(n) - (n - 1) / 2 for n in (48, 48, 64)), indexing="ij")


def smoke(seed: int, shape: tuple[int, int] = (72, 60)) -> np.ndarray:
    """Round smoke with a texture of its own."""
    texture = ndimage.gaussian_filter(np.random.default_rng(seed).standard_normal(shape), 1.5)
    rows, columns = np.indices(shape) - np.array([36, 30])[:, None, None]
    return np.maximum(1 + 3 * texture, 0) * np.maximum(1 - (rows / 30) ** 2 - (columns / 24) ** 2, 0)


def distances(picture: np.ndarray, reference: np.ndarray) -> np.ndarray:
    """Of the patches, and of their texture."""
    found, true = PatchStatistics.of(picture), PatchStatistics.of(reference)
    return np.array([found.distance(true), found.texture_distance(true)])


def test_the_same_texture_is_near_and_any_other_is_farther():
    picture, other = smoke(1), smoke(2)
    alike = distances(other, picture)
    assert distances(picture, picture).tolist() == [0, 0]
    assert (alike > 0).all()
    noisy = picture + 0.3 * picture.max() * np.random.default_rng(3).random(picture.shape) * (picture > 0)
    for fake in (ndimage.gaussian_filter(other, 3), noisy, 0.5 * other):
        assert (distances(fake, picture) > 1.5 * alike).all()


def test_the_texture_sees_a_comb_that_the_patches_do_not():
    picture, other = smoke(1), smoke(2)
    comb = 1 + 0.2 * np.sin(2.5 * np.arange(len(other)))[:, None]
    patches, texture = distances(other * comb, picture) / distances(other, picture)
    assert patches < 1.1 < 2 < texture


def test_where_smoke_is_does_not_count_nor_how_much_black_is_around():
    picture, other = (np.pad(smoke(seed), 16) for seed in (1, 2))
    assert distances(np.pad(picture, ((40, 8), (4, 20))), picture) == pytest.approx(0)
    elsewhere = np.pad(picture, ((2, 0), (0, 3)))  # other squares are averaged
    assert (distances(elsewhere, picture) < 0.3 * distances(other, picture)).all()
    assert distances(2 * picture, 2 * other) == pytest.approx(distances(picture, other))


def test_no_smoke_at_all_has_a_distance_of_about_one():
    black = np.zeros((20, 30))
    assert distances(black, smoke(1)) == pytest.approx(1, abs=0.1)
    assert distances(black, black).tolist() == [0, 0]
    assert distances(smoke(1), black).tolist() == [np.inf, np.inf]


def test_a_gradient_is_measured_in_the_picture_s_own_brightness():
    ramp = np.outer(np.ones(5), np.arange(1.0, 6))
    assert mean_gradient(ramp) == mean_gradient(7 * ramp) == pytest.approx(1 / 3)
    assert mean_gradient(np.zeros((4, 4))) == 0


def ball(*middle: float, radii: tuple[float, float, float] = (10.0, 10.0, 10.0)) -> np.ndarray:
    """An even ellipsoid about a place, its edge smooth over a voxel."""
    distance = np.sqrt(sum(((a - m) / r) ** 2 for a, m, r in zip((X, Y, Z), middle, radii, strict=True)))
    return np.clip(0.5 + (1 - distance) * min(radii), 0, 1)


def test_a_ball_is_as_deep_as_wide_and_one_body() -> None:
    found = RayShapes.of(ball(0, 0, 0))
    assert found.several_modes == 0
    assert max(found.scatter, found.row_middles) < 1e-9
    assert found.depth_over_width == pytest.approx(1)
    # means by smoke: a chord is 3 / 2 radii, a disc's standard deviation 9 pi / 64
    assert found.ray_length == pytest.approx(1.5 / (9 * np.pi / 64), rel=0.05)


def test_an_ellipsoid_is_as_deep_as_its_half_axes_say() -> None:
    for depth, width in ((15.0, 10.0), (10.0, 15.0)):
        found = RayShapes.of(ball(0, 0, 0, radii=(width, depth, 20.0)))
        assert found.depth_over_width == pytest.approx(depth / width, rel=0.03)
    deep, flat = (RayShapes.of(ball(0, 0, 0, radii=(10.0, depth, 10.0))).ray_length for depth in (15.0, 7.5))
    assert deep == pytest.approx(2 * flat, rel=0.05)


def test_balls_behind_one_another_are_several_modes() -> None:
    behind = RayShapes.of(ball(0, -12, 0) + ball(0, 12, 0))
    beside = RayShapes.of(ball(-12, 0, 0) + ball(12, 0, 0))
    assert behind.several_modes > 0.95 and beside.several_modes == 0
    assert behind.depth_over_width > 2 > 1 > beside.depth_over_width
    assert RayShapes.of(ball(0, -12, 0) + 0.02 * ball(0, 12, 0)).several_modes == 0, "a faint veil is no lobe"


def test_balls_at_different_depths_beside_one_another_scatter() -> None:
    found = RayShapes.of(ball(-12, -8, 0) + ball(12, 8, 0))
    # middles stand 8 from the row's; a ball's own rows have half a radius or less
    assert 0.85 < found.scatter < 0.97
    assert found.several_modes < 0.1
    assert found.row_middles == pytest.approx(0, abs=1e-6)


def test_a_column_that_leans_in_depth_moves_its_rows_middles() -> None:
    column = (np.hypot(X, Y - Z / 4) < 6).astype(float)
    found = RayShapes.of(column)
    assert found.row_middles == pytest.approx(Z.std() / 4 / 3, rel=0.05)
    assert found.scatter < 0.15
    assert found.depth_over_width == pytest.approx(1, abs=0.03)
    assert RayShapes.of(np.hypot(X - Z / 4, Y) < 6).row_middles == pytest.approx(0, abs=1e-9)


def test_figures_do_not_depend_on_the_amount_and_no_smoke_has_none() -> None:
    smoke = ball(0, 3, 0) + ball(6, -8, 5)
    once, twice = RayShapes.of(smoke), RayShapes.of(2 * smoke)
    assert once.scatter == pytest.approx(twice.scatter) and once.several_modes == twice.several_modes
    assert RayShapes.of(np.zeros((4, 4, 4))) is None
    with pytest.raises(ValueError):
        RayShapes.of(np.full((4, 4, 4), np.nan))
