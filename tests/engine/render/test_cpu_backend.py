"""Scattering of all orders: the same sums in float64, conservation of energy, the derivative by a complex step."""

from dataclasses import replace

import numpy as np
import pytest
import renderer_reference as reference

from smokelift.render import Optics
from smokelift.scene import Camera, DirectionalLight, Domain, Medium

SHAPE = (7, 6, 81)  # high enough for blocks of three voxels
SMOKY = slice(30, 37)
DOMAIN = Domain((0.0, 0.0, -3.0), (0.7, 0.6, 5.1), SHAPE)
MEDIUM = Medium(12.0, 0.95)
SUN = DirectionalLight((0.57, 0.45, -0.68), (3.0, 3.0, 3.0))
SKY = DirectionalLight((0.1, 0.2, -1.0), (0.5, 1.0, 2.0))
CAMERA = Camera.look_at((0.3, -2.0, 0.9), (0.35, 0.3, 0.35), fov_y_degrees=30, size=(12, 11))
WALL = np.array((0.3, 0.2, 0.4), np.float32)


@pytest.fixture(scope="module")
def density():
    rng = np.random.default_rng(3)
    values = np.zeros(SHAPE, np.float32)
    part = values[..., SMOKY]
    part[:] = rng.random(part.shape) * (rng.random(part.shape) > 0.3)
    return values


def renderer(lights=(SUN,), medium=MEDIUM, support=None, background=WALL):
    return Optics(DOMAIN, medium, lights, "multiple").renderer(CAMERA, background, support)


def exact(density, lights=(SUN,), medium=MEDIUM):
    return reference.render(density, CAMERA, DOMAIN, medium, lights, WALL.astype(float), "multiple")


@pytest.mark.parametrize("lights", [(SUN,), (SUN, SKY)], ids=["one light", "several colors"])
@pytest.mark.parametrize("extinction", [0.1, 12.0, 100.0])
def test_image_equals_the_sums_in_double_precision(density, lights, extinction):
    medium = replace(MEDIUM, extinction=extinction)
    image = renderer(lights, medium).image(density)
    np.testing.assert_allclose(image, exact(density.astype(float), lights, medium), rtol=5e-4)


def test_colored_smoke_in_white_light_is_deeper_in_color_where_light_is_scattered_again(density):
    thick = replace(MEDIUM, extinction=100.0, color=(1.0, 0.8, 0.5))
    image = renderer(medium=thick, background=np.zeros(3, np.float32)).image(density)
    black = np.zeros(3)
    sums = reference.render(density.astype(float), CAMERA, DOMAIN, thick, (SUN,), black, "multiple")
    np.testing.assert_allclose(image, sums, rtol=5e-4, atol=1e-5)
    once = Optics(DOMAIN, thick, (SUN,)).renderer(CAMERA, black.astype(np.float32)).image(density)
    lit = once.max(-1) > 0.1 * once.max()
    np.testing.assert_allclose(once[lit] / once[lit][:, :1], np.broadcast_to(thick.color, once[lit].shape), rtol=1e-5)
    assert (image[lit][:, 2] / image[lit][:, 0]).max() < 0.485


@pytest.mark.parametrize(
    ("hull", "lights", "color"),
    [(False, (SUN,), (1.0, 1.0, 1.0)), (True, (SUN, SKY), (1.0, 1.0, 1.0)), (True, (SUN,), (0.4, 1.0, 0.7))],
    ids=["one light", "several, hull", "colored smoke"],
)
def test_gradient_equals_a_complex_step(density, lights, hull, color):
    """In voxels at random, those that light reaches late among them, and in empty ones, near the smoke and far."""
    medium = replace(MEDIUM, color=color)
    rng = np.random.default_rng(5)
    support = density > 0.2 if hull else None
    values = np.where(support, density, 0) if hull else density
    weights = rng.standard_normal((11, 12, 3))
    ours = renderer(lights, medium, support)
    ours.image(values.astype(np.float32), keep_record=True)
    gradient = ours.gradient(weights.astype(np.float32))
    smoky = rng.choice(np.argwhere(values > 0), 3, replace=False)
    empty = [] if hull else [(3, 3, 27), (3, 2, 46)]
    for voxel in [*smoky, *empty]:
        slope = reference.complex_step(lambda moved: np.sum(weights * exact(moved, lights, medium)), values, voxel)
        assert gradient[tuple(voxel)] == pytest.approx(slope, rel=2e-3, abs=1e-3 * float(np.abs(gradient).max()))


def test_light_that_has_left_the_blocks_does_not_come_back():
    """Rows of blocks lie one behind the other in memory; in a box full of smoke the next one is near."""
    shape, black = (12, 10, 10), np.zeros(3, np.float32)
    values = np.random.default_rng(1).random(shape).astype(np.float32)
    domain, medium = Domain((0.0, 0.0, 0.0), (1.2, 1.0, 1.0), shape), replace(MEDIUM, extinction=5.0)
    image = Optics(domain, medium, (SUN,), "multiple").renderer(CAMERA, black).image(values)
    sums = reference.render(values.astype(float), CAMERA, domain, medium, (SUN,), black.astype(float), "multiple")
    np.testing.assert_allclose(image, sums, rtol=5e-4, atol=1e-5)


@pytest.mark.parametrize(("extinction", "lost"), [(0.5, 0.01), (2.0, 0.04), (8.0, 0.2)])
def test_white_smoke_gives_back_the_light_of_a_white_room(extinction, lost):
    """Where radiance 1 comes from everywhere, smoke that absorbs nothing can hardly be seen, and hardly shines."""
    rng = np.random.default_rng(8)
    directions = rng.standard_normal((200, 3))
    directions = np.concatenate([directions, -directions])
    irradiance = (4 * np.pi / len(directions),) * 3
    room = tuple(DirectionalLight(tuple(d), irradiance) for d in directions)
    room_renderer = renderer(room, Medium(extinction, 1.0), background=np.ones(3, np.float32))
    smoke = np.zeros(SHAPE, np.float32)
    smoke[..., SMOKY] = 1
    image = room_renderer.image(smoke)
    assert image.min() > 1 - lost
    assert image.max() < 1 + 1e-3


def test_anisotropic_smoke_is_refused():
    with pytest.raises(ValueError):
        renderer(medium=replace(MEDIUM, anisotropy=0.3))
