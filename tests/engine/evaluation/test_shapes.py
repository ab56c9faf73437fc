"""Shapes along rays of bodies whose figures are known."""

import numpy as np
import pytest

from smokelift.evaluation.metrics import RayShapes

X, Y, Z = np.meshgrid(*(np.arange(n) - (n - 1) / 2 for n in (48, 48, 64)), indexing="ij")


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
