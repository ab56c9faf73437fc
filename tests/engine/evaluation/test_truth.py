"""Figures gathered over frames: what is perfect, what is wrong in one way only, and other grids."""

from collections.abc import Iterable
from dataclasses import replace

import numpy as np
import pytest

from smokelift.evaluation.truth import (
    Truth,
    eight_bit_values,
    finite_mean,
    means,
    picture_figures,
    resampled,
    volume_means,
)
from smokelift.transport import Velocity

SHAPE = (16, 16, 24)
VOXEL = 0.05
FPS = 20.0

HEIGHTS = (7, 8, 10, 13)
"""Of the ball in each frame (voxels)."""


def ball(height: int) -> np.ndarray:
    """A Gaussian ball."""
    x, y, z = np.indices(SHAPE, np.float32)
    return np.exp(-((x - 7.5) ** 2 + (y - 7.5) ** 2 + (z - height) ** 2) / 10).astype(np.float32)


@pytest.fixture(scope="module")
def truth() -> Truth:
    """Four frames of a ball that rises faster and faster, without an inlet."""
    upward = [np.stack([face] * 4).astype(np.float16) for face in Velocity.zero(SHAPE, VOXEL).faces]
    for frame, rise in enumerate(np.diff(HEIGHTS)):
        upward[2][frame] = rise * VOXEL * FPS
    return Truth(
        densities=np.stack([ball(height) for height in HEIGHTS]).astype(np.float16),
        faces=tuple(upward),
        inflow_packed=np.zeros((4, int(np.prod(SHAPE)) // 8), np.uint8),
        voxel_size=VOXEL,
        fps=FPS,
        closed=(),
    )


def scored(truth: Truth, change=lambda _, *moment: moment, frames: Iterable[int] = range(4)) -> dict[str, float]:
    """Figures of the truth's own frames, whose density and velocity are changed."""
    moments = ((frame, truth.density(frame), truth.velocity(max(frame - 1, 0)).centres()) for frame in frames)
    return volume_means(truth, ((frame, *change(frame, *moment)) for frame, *moment in moments))


def picture(shift: int = 0, size: tuple[int, int] = (96, 64)) -> np.ndarray:
    rows, columns = np.indices(size, np.float32)
    ball = np.exp(-(((rows - 50) / 8) ** 2) - ((columns - 30 - shift) / 6) ** 2)
    texture = 1 + 0.3 * np.sin(0.9 * rows) * np.cos(0.8 * (columns - shift))
    return np.repeat((0.5 * ball * texture)[..., None], 3, -1).astype(np.float32)


def test_a_shifted_picture_is_another_one() -> None:
    alone = picture_figures(picture(9), picture())
    figures = means([picture_figures(picture(), picture()), alone])
    assert figures["psnr"] == alone["psnr"] < 30
    assert figures["ssim"] == pytest.approx((1 + alone["ssim"]) / 2)


def test_the_truth_itself_is_perfect(truth) -> None:
    figures = scored(truth)
    assert figures["density_error"] == figures["height_mass_error"] == figures["velocity_error"] == 0
    assert figures["velocity_error_around"] == 0
    assert figures["mass_ratio"] == pytest.approx(1)
    assert figures["velocity_cosine"] == pytest.approx(1)
    assert figures["warp_error"] == figures["warp_error_truth"] < 2e-3  # float16
    assert figures["divergence"] == figures["divergence_truth"] < 1e-6


def test_each_mistake_shows_where_it_belongs(truth) -> None:
    half = scored(truth, lambda _, density, velocity: (0.5 * density, None))
    deep = scored(truth, lambda _, density, velocity: (np.roll(density, 1, 1), velocity))
    slow = scored(truth, lambda frame, density, velocity: (density, (0.5, 0, 0.5, 1)[frame] * velocity))
    assert half["mass_ratio"] == half["height_mass_error"] == pytest.approx(0.5)
    assert "velocity_error" not in half
    assert deep["density_error"] > 0.2
    assert deep["height_mass_error"] == pytest.approx(0, abs=1e-6)
    assert deep["warp_error"] == pytest.approx(deep["warp_error_truth"], abs=1e-3)
    assert slow["velocity_error"] == pytest.approx((1 + 0.5 + 0) / 3)
    assert slow["velocity_cosine"] == pytest.approx(2 / 3)
    assert slow["warp_error"] > 0.1


def test_where_smoke_is_put_in_motion_is_not_scored(truth) -> None:
    inlet = np.zeros(SHAPE, bool)
    inlet[6:10, 6:10, 6:9] = True
    fed = replace(truth, inflow_packed=np.stack([np.packbits(inlet)] * 4))
    right = scored(fed, frames=range(3))
    wrong = scored(fed, lambda _, rho, u: (rho, np.where(inlet[..., None], -u, u)), range(3))
    for name in ("velocity_error", "velocity_error_around", "warp_error"):
        assert wrong[name] == right[name]


def test_a_velocity_after_a_gap_is_not_scored(truth) -> None:
    assert "velocity_error" not in scored(truth, lambda _, density, velocity: (density, 0 * velocity), (0, 2))


def test_values_are_those_of_an_8_bit_picture() -> None:
    np.testing.assert_allclose(eight_bit_values(np.array([-1, 0.2159, 7])) * 255, [0, 128, 255], rtol=1e-6)


def test_means_leave_out_what_is_infinite_or_unknown() -> None:
    assert finite_mean([1.0, np.inf, None, 3.0]) == 2.0
    assert finite_mean([np.inf, None]) is None
    assert finite_mean([]) is None


def test_other_resolutions_over_the_same_box() -> None:
    density = np.random.default_rng(0).random((8, 12, 10)).astype(np.float32)
    fine = density.repeat(2, 0).repeat(2, 1).repeat(2, 2)
    np.testing.assert_allclose(resampled(fine, (8, 12, 10)), density, atol=1e-6)
    ramp = np.broadcast_to(np.arange(8, dtype=np.float32)[:, None, None, None] + 0.5, (8, 4, 6, 3))
    found = resampled(np.ascontiguousarray(ramp), (16, 8, 12))
    assert found.shape == (16, 8, 12, 3)
    np.testing.assert_allclose(
        found[1:-1], np.broadcast_to(((np.arange(16) + 0.5) / 2)[1:-1, None, None, None], found[1:-1].shape)
    )
