"""The renderer where methods fail: thin and opaque smoke, grazing light, the eye inside, grids of one voxel."""

import numpy as np
import pytest
import renderer_reference as reference

from smokelift.render import Renderer, render
from smokelift.scene import Camera, DirectionalLight, Domain, Medium, PointLight, Scene

SUN = DirectionalLight((0.57, 0.45, -0.68), (3.0, 2.0, 1.0))
DEPTHS = [0.001, 0.01, 0.1, 1.0, 10.0, 100.0]
WALL = np.array([0.4, 0.5, 0.6])


SHAPE = (9, 8, 10)


def make_domain(shape=SHAPE):
    return Domain((0.0, 0.0, 0.0), tuple(0.1 * n for n in shape), shape)


def make_density(shape=SHAPE):
    rng = np.random.default_rng(3)
    return (rng.random(shape) * (rng.random(shape) > 0.2) + 0.01).astype(np.float32)


def make_camera(domain, eye=(2.1, -1.4, 1.9), size=(16, 18)):
    return Camera.look_at(eye, domain.centre, fov_y_degrees=40, size=size)


def check(density, camera, domain, medium, lights, voxels=6):
    """Image and derivative against the sums in double precision, the derivative voxel by voxel."""
    renderer = Renderer(camera, domain, medium, lights, WALL)
    image = renderer.image(density, keep_record=True)
    weights = np.random.default_rng(5).random(image.shape)
    gradient = renderer.gradient(weights)
    expected = reference.render(density.astype(np.float64), camera, domain, medium, lights, WALL)
    assert np.isfinite(image).all()
    assert np.isfinite(gradient).all()
    np.testing.assert_allclose(image, expected, rtol=1e-4, atol=1e-6)

    def loss(values):
        return np.sum(weights * reference.render(values, camera, domain, medium, lights, WALL))

    for voxel in np.random.default_rng(6).permutation(np.argwhere(density > 0))[:voxels]:
        exact = reference.complex_step(loss, density, voxel)
        # beyond an optical depth of 87 transmittance counts as that of 87
        assert gradient[tuple(voxel)] == pytest.approx(exact, rel=1e-3, abs=1e-30)


@pytest.mark.parametrize("depth", DEPTHS)
@pytest.mark.parametrize("anisotropy", [-0.9, 0.0, 0.9])
def test_image_and_gradient_at_every_optical_depth(depth, anisotropy):
    domain, density = make_domain(), make_density()
    medium = Medium(depth / (density.sum(1).max() * domain.voxel_size), 0.9, anisotropy)
    check(density, make_camera(domain), domain, medium, (SUN, PointLight((-0.5, 0.4, 1.6), (1, 2, 3))))


@pytest.mark.parametrize(
    "direction",
    [(1, 0, 0), (0, -1, 0), (0, 0, 1), (1, 1, 0), (1, 1, 1), (-1, 1, 1), (1, 1e-7, 0), (1e-6, -1, 1e-6), (1, -1, 1e-9)],
)
def test_light_along_axes_and_diagonals(direction):
    domain = make_domain()
    check(make_density(), make_camera(domain), domain, Medium(5.0), (DirectionalLight(direction, (1, 1, 1)),))


@pytest.mark.parametrize(
    "position", [(0.45, 0.4, 1.001), (-1e-4, 0.4, 0.5), (-0.01, -0.01, -0.01), (900.0, 700.0, 500.0)]
)
def test_point_light_at_the_surface_and_far_away(position):
    domain = make_domain()
    power = float(np.sum(np.square(np.subtract(position, domain.centre))))
    check(make_density(), make_camera(domain), domain, Medium(5.0), (PointLight(position, (power,) * 3),))


@pytest.mark.parametrize("eye", [(0.45, 0.4, 0.5), (0.41, 0.33, 0.57), (0.02, 0.4, 0.98), (0.45, -0.001, 0.5)])
def test_camera_inside_the_smoke(eye):
    domain = make_domain()
    camera = Camera.look_at(eye, (0.8, 0.75, 0.2), fov_y_degrees=75, size=(16, 18))
    check(make_density(), camera, domain, Medium(5.0, 0.9, 0.6), (SUN,))


@pytest.mark.parametrize("shape", [(1, 8, 10), (9, 1, 10), (9, 8, 1), (1, 1, 10), (1, 1, 1)])
def test_grids_one_voxel_thick(shape):
    domain = make_domain(shape)
    camera = make_camera(domain, eye=(2.1, -1.4, 0.8))
    lights = (SUN, DirectionalLight((1.0, 0.1, 0.0), (1, 1, 2)), PointLight((-0.3, 0.2, 0.1), (1, 0, 0)))
    check(make_density(shape), camera, domain, Medium(5.0, 0.9, 0.3), lights, voxels=3)


@pytest.mark.parametrize("density", [1e38, np.inf, np.nan])
def test_a_density_without_a_finite_depth_is_refused(density):
    domain = make_domain((4, 4, 4))
    with pytest.raises(ValueError):
        render(np.full((4, 4, 4), density, np.float32), Scene(domain=domain, camera=make_camera(domain)))
