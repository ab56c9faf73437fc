"""A flame of known shape, from its picture behind known smoke."""

import numpy as np
import pytest

from smokelift.density.flame import flame_emission
from smokelift.render import Optics
from smokelift.render.emission import emitted
from smokelift.scene import Camera, Domain, Medium

DOMAIN = Domain((-0.6, -0.6, 0), (0.6, 0.6, 1.6), (24, 24, 32))
CAMERA = Camera.look_at((0, -4, 0.8), (0, 0, 0.8), fov_y_degrees=27, size=(40, 56))
OPTICS = Optics(DOMAIN, Medium(extinction=8.0), (), "absorption")
PLACES = np.stack(np.broadcast_arrays(*DOMAIN.offsets((0, 0, 0))), -1)


def ellipsoid(center: tuple[float, float, float], widths: tuple[float, float, float]) -> np.ndarray:
    """One in its middle, falling off smoothly, and nothing far away."""
    values = np.exp(-(((PLACES - center) / widths) ** 2).sum(-1))
    return np.where(values > 0.02, values, 0).astype(np.float32)


def spread(flame: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Mean place and standard deviation along x, y and z (m)."""
    mean = np.tensordot(flame, PLACES, 3) / flame.sum()
    return mean, np.sqrt(np.tensordot(flame, (PLACES - mean) ** 2, 3) / flame.sum())


SMOKE = 0.5 * ellipsoid((0, 0.1, 1.0), (0.25, 0.25, 0.5))
FLAME = 3 * ellipsoid((0, 0.1, 0.5), (0.12, 0.12, 0.25))


def test_it_shows_the_picture_and_has_the_flames_size_and_place() -> None:
    found = flame_emission(emitted(FLAME, SMOKE, CAMERA, OPTICS), CAMERA, SMOKE, OPTICS)
    light, shown = (emitted(flame, SMOKE, CAMERA, OPTICS) for flame in (FLAME, found))
    assert np.abs(shown - light).sum() < 0.012 * light.sum()
    assert found.min() >= 0
    (mean, width), (true_mean, true_width) = spread(found), spread(FLAME)
    np.testing.assert_allclose(mean, true_mean, atol=0.25 * DOMAIN.voxel_size)
    np.testing.assert_allclose(width, true_width, rtol=0.04, atol=0.4 * DOMAIN.voxel_size)
    assert found.sum() == pytest.approx(FLAME.sum(), rel=0.02)


def test_smoke_before_it_makes_it_stronger() -> None:
    """The same picture behind smoke and without any, beneath which it stands in the middle of the box."""
    light = emitted(FLAME, 0 * SMOKE, CAMERA, OPTICS)
    bare, behind = (flame_emission(light, CAMERA, smoke, OPTICS) for smoke in (0 * SMOKE, SMOKE))
    assert behind.sum() > 1.2 * bare.sum()
    assert spread(bare)[0][1] == pytest.approx(0, abs=0.01)


def test_a_flame_beneath_the_smoke_stands_where_its_base_does() -> None:
    smoke = ellipsoid((0, 0.2, 1.3), (0.2, 0.2, 0.15))
    flame = ellipsoid((0, 0.2, 0.4), (0.1, 0.1, 0.2))
    found = flame_emission(emitted(flame, smoke, CAMERA, OPTICS), CAMERA, smoke, OPTICS)
    assert spread(found)[0][1] == pytest.approx(0.2, abs=0.03)
