"""Light of a flame along the rays of a camera, with smoke before it and without."""

import numpy as np
import pytest

from smokelift.render import Optics
from smokelift.render.emission import emission_matrix, emitted
from smokelift.scene import Camera, Domain, Medium, look_at_matrix

DOMAIN = Domain((-0.5, -0.5, 0), (0.5, 0.5, 1), (20, 20, 20))
OPTICS = Optics(DOMAIN, Medium(extinction=4.0), (), "absorption")
FRONT = Camera(
    type="orthographic",
    matrix=look_at_matrix((0, -3, 0.5), (0, 0, 0.5), (0, 0, 1)),
    fx=20,
    fy=20,
    cx=10,
    cy=10,
    size=(20, 20),
)
NEAR = Camera.look_at((1.2, -1.1, 1.4), (0, 0, 0.5), fov_y_degrees=50, size=(30, 24))


def box(low: float, high: float, value: float) -> np.ndarray:
    """A volume that has a value between two depths, in meters from the middle, all over the box."""
    depth = DOMAIN.min[1] + (np.arange(20) + 0.5) * DOMAIN.voxel_size
    within = (depth > low) & (depth < high)
    return np.broadcast_to(np.where(within, value, 0)[None, :, None], DOMAIN.resolution).astype(np.float32)


@pytest.mark.parametrize(
    ("smoke", "expected"),
    [
        (0 * box(0, 0, 0), 3.0 * 0.4),
        (box(-0.4, -0.2, 1.0), 3.0 * 0.4 * np.exp(-4 * 0.2)),
        (box(0.3, 0.5, 1.0), 3.0 * 0.4),
        (box(-0.2, 0.2, 1.0), 3.0 * (1 - np.exp(-4 * 0.4)) / 4),
    ],
    ids=["no smoke", "smoke before it", "smoke behind it", "smoke in it"],
)
def test_a_layer_of_fire_shines_as_the_integral_says(smoke, expected) -> None:
    light = emitted(box(-0.2, 0.2, 3.0), smoke, FRONT, OPTICS)
    np.testing.assert_allclose(light[2:-2, 2:-2], expected, rtol=1e-4)


def test_smoke_hides_what_its_transmittance_says() -> None:
    smoke = np.random.default_rng(1).random(DOMAIN.resolution, np.float32)
    smoke[:, -1] = 0
    sheet = np.zeros_like(smoke)
    sheet[:, -1] = 1 / DOMAIN.voxel_size
    renderer = OPTICS.renderer(FRONT, np.ones(3, np.float32))
    seen = renderer.image(smoke)[..., 0]
    np.testing.assert_allclose(emitted(sheet, smoke, FRONT, OPTICS)[1:-1, 1:-1], seen[1:-1, 1:-1], rtol=1e-4)


@pytest.mark.parametrize("camera", [FRONT, NEAR], ids=["front", "near a corner"])
def test_the_matrix_says_the_same(camera) -> None:
    random = np.random.default_rng(2)
    smoke, fire = random.random((2, *DOMAIN.resolution), np.float32)
    burning = fire > 0.8
    fire[~burning] = 0
    light = emitted(fire, smoke, camera, OPTICS)
    assert light.max() > 0
    for pixels in (np.ones(light.shape, bool), light > np.median(light)):
        matrix = emission_matrix(smoke, camera, OPTICS, pixels, burning)
        np.testing.assert_allclose(matrix @ fire[burning], light[pixels], rtol=1e-4, atol=1e-6)


def test_fire_around_the_camera_is_seen() -> None:
    inside = Camera.look_at((0, 0, 0.5), (0, 1, 0.5), fov_y_degrees=40, size=(8, 8))
    clear = np.zeros(DOMAIN.resolution, np.float32)
    light = emitted(clear + 1, clear, inside, OPTICS)
    assert 0.4 < light[4, 4] < 0.6
