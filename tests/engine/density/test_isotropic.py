"""Pictures that add up to volumes without level layers."""

import numpy as np
import pytest
from scipy import ndimage

from smokelift.density.isotropic import GAIN, isotropic
from smokelift.density.turntable import Turntable
from smokelift.scene import Camera, Domain


def slopes(values) -> np.ndarray:
    """Mean squares of the differences along every axis."""
    return np.array([np.mean(np.diff(values, axis=axis) ** 2) for axis in range(values.ndim)])


def test_detail_without_direction_keeps_its_energy() -> None:
    noise = np.random.default_rng(0).standard_normal((96, 128)).astype(np.float32)
    assert isotropic(noise).std() == pytest.approx(1, rel=0.03)


def test_what_is_level_is_weakened_and_what_stands_is_not() -> None:
    standing = np.cos(np.pi * (np.arange(64) + 0.5) * 16 / 64)[:, None] * np.ones(64)
    np.testing.assert_allclose(isotropic(standing.astype(np.float32)), GAIN * standing, atol=1e-5)
    assert isotropic(np.ascontiguousarray(standing.T, np.float32)).std() < 0.3 * standing.std()


@pytest.mark.parametrize(("change", "lowest", "highest"), [(isotropic, 0.8, 1.25), (np.copy, 1.5, 3)])
def test_pictures_of_many_azimuths_add_up_to_detail_without_direction(change, lowest, highest) -> None:
    """As they are they draw level layers: the volume changes more along the height than across it."""
    domain = Domain((-1, -1, -1), (1, 1, 1), (32, 32, 32))
    table = Turntable.before(Camera.look_at((0, -5, 0), (0, 0, 0), fov_y_degrees=30, size=(32, 32)), domain)
    volume, random = np.ones((32, 32, 32), np.float32), np.random.default_rng(1)
    for degrees in np.arange(0, 180, 180 / 24):
        picture = 0.1 * ndimage.gaussian_filter(random.standard_normal(table.shape).astype(np.float32), 1.5)
        table.scale(volume, np.ascontiguousarray(change(picture)), float(degrees))
    inner = np.log(volume)[8:24, 8:24]
    x, y, z = slopes(inner)
    assert lowest < 2 * z / (x + y) < highest
