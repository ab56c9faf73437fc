"""The paper's renderer: its picture against the Riemann sum in float64, and how far its derivative is one."""

from dataclasses import replace

import numpy as np
import paper_reference as reference
import pytest

from smokelift.baselines.paper_renderer import PaperRenderer
from smokelift.render import Optics
from smokelift.scene import Camera, DirectionalLight, Domain, Medium, PointLight

SHAPE = (9, 8, 10)
DOMAIN = Domain((0.0, 0.0, 0.0), (0.9, 0.8, 1.0), SHAPE)
CENTER = (0.45, 0.4, 0.5)
SUN = DirectionalLight((0.57, 0.45, -0.68), (3.0, 2.0, 1.0))
ABOVE = DirectionalLight((0.0, 0.0, -1.0), (3.0, 2.0, 1.0))
LIGHTS = {
    "directional": (SUN,),
    "two colors": (SUN, DirectionalLight((-1.0, 0.2, 0.1), (0.0, 0.5, 2.0))),
    "all": (SUN, PointLight((2.0, -1.5, 2.5), (20.0, 15.0, 10.0)), PointLight((0.4, 0.4, -0.2), (0.1, 0.2, 0.9))),
}
LOOKING = Camera.look_at((1.9, -1.2, 1.4), CENTER, fov_y_degrees=40, size=(14, 16))
CAMERAS = {
    "perspective": replace(LOOKING, fx=20.0, cx=6.3),
    "orthographic": replace(LOOKING, type="orthographic", fx=11.0, fy=12.0, cx=6.3),
    "inside": Camera.look_at((0.4, 0.35, 0.5), (0.9, 0.8, 0.7), fov_y_degrees=60, size=(14, 16)),
}


@pytest.fixture(scope="module")
def density():
    """A ragged blob that does not touch the sides."""
    axes = [(np.arange(n) + 0.5) / n * 2 - 1 for n in SHAPE]
    x, y, z = np.meshgrid(*axes, indexing="ij")
    values = np.exp(-3 * (x**2 + y**2 + z**2)) * (0.5 + np.random.default_rng(3).random(SHAPE))
    values[np.maximum(np.maximum(abs(x), abs(y)), abs(z)) > 0.85] = 0
    return values.astype(np.float32)


@pytest.fixture(scope="module")
def wall():
    return np.random.default_rng(4).random((16, 14, 3)).astype(np.float32)


def medium_of_depth(density, depth):
    """A medium through whose thickest column light passes ``depth`` mean free paths."""
    return Medium(depth / (density.sum(1).max() * DOMAIN.voxel_size), 0.9, 0.3)


def relative(a, b):
    return np.linalg.norm(a - b) / np.linalg.norm(b)


def slope_along(direction, density, weights, *setup):
    """d sum(weights x image) for a step along a direction (nx, ny, nz), by a complex step."""
    return float(np.sum(weights * reference.render(density + 1e-30j * direction, *setup)).imag / 1e-30)


def error_per_voxel(density, weights, *setup):
    """Relative error of the paper's gradient over every 29th voxel, empty ones included; a complex step each."""
    voxels = [np.unravel_index(number, SHAPE) for number in range(0, density.size, 29)]
    found = paper_gradient(density, weights, *setup)
    expected = [slope_along(one_at(voxel), density, weights, *setup) for voxel in voxels]
    return relative(np.array([found[voxel] for voxel in voxels]), np.array(expected))


def one_at(voxel):
    direction = np.zeros(SHAPE)
    direction[voxel] = 1
    return direction


def paper_renderer(camera, domain, medium, lights, background, scattering="single"):
    return PaperRenderer(Optics(domain, medium, lights, scattering), camera, background)


def paper_gradient(density, weights, *setup):
    renderer = paper_renderer(*setup)
    renderer.image(density)
    return renderer.gradient(weights)


@pytest.mark.parametrize("camera", CAMERAS.values(), ids=CAMERAS.keys())
@pytest.mark.parametrize(
    ("lights", "scattering"), [*((key, "single") for key in LIGHTS), ("all", "unshadowed"), ("all", "absorption")]
)
def test_image_equals_the_riemann_sum(density, wall, camera, lights, scattering):
    """The picture is the paper's sum, for every camera, light and model, and a second one does not remember it."""
    setup = (camera, DOMAIN, medium_of_depth(density, 3), LIGHTS[lights], wall, scattering)
    renderer = paper_renderer(*setup)
    renderer.image(2 * density)
    expected = reference.render(density.astype(np.float64), *setup)
    assert relative(renderer.image(density), expected) < 2e-6


@pytest.mark.parametrize("depth", [0.3, 3, 30])
@pytest.mark.parametrize("camera", CAMERAS.values(), ids=CAMERAS.keys())
def test_right_for_density_added_alike_everywhere(density, wall, camera, depth):
    """Eq. 8 and 10 differentiate for one common change: along it the derivative is exact, at any thickness."""
    setup = (camera, DOMAIN, medium_of_depth(density, depth), (ABOVE,), wall)
    weights = np.random.default_rng(5).random(wall.shape)
    expected = slope_along(np.ones(SHAPE), density, weights, *setup)
    assert paper_gradient(density, weights, *setup).sum(dtype=np.float64) == pytest.approx(expected, rel=1e-5)


@pytest.mark.parametrize("depth", [0.3, 10])
def test_absorption_alone_is_exact_voxel_by_voxel(density, wall, depth):
    setup = (CAMERAS["perspective"], DOMAIN, medium_of_depth(density, depth), (), wall, "absorption")
    weights = np.random.default_rng(6).random(wall.shape)
    assert error_per_voxel(density, weights, *setup) < 1e-5


def test_error_against_finite_differences_grows_with_thickness(density):
    """Per voxel: first order in the optical depth while smoke is thin, no derivative at all once it is thick."""
    weights = np.random.default_rng(7).random((16, 14, 3))
    errors = {}
    for depth in (0.01, 0.02, 3, 10):
        setup = (CAMERAS["perspective"], DOMAIN, medium_of_depth(density, depth), (SUN,), np.zeros(3))
        errors[depth] = error_per_voxel(density, weights, *setup)
    assert errors[0.02] == pytest.approx(2 * errors[0.01], rel=0.1)
    assert errors[0.01] < 0.02
    assert 0.3 < errors[3] < errors[10]


def test_thin_smoke_looks_and_derives_as_with_the_exact_renderer(density):
    """In the thin limit there is one picture and one derivative; the renderers sample it at different points."""
    far = replace(
        CAMERAS["orthographic"], matrix=Camera.look_at((0.45, -2, 0.5), CENTER, fov_y_degrees=9, size=(9, 9)).matrix
    )
    camera = replace(far, fx=10.0, fy=10.0, cx=4.5, cy=5.0, size=(9, 10))
    optics, behind = Optics(DOMAIN, medium_of_depth(density, 1e-3), (SUN,)), np.full(3, 0.1)
    weights = np.random.default_rng(8).random((10, 9, 3))
    exact = optics.renderer(camera, behind)
    expected = exact.image(density, keep_record=True)
    renderer = PaperRenderer(optics, camera, behind)
    assert relative(renderer.image(density), expected) < 1e-5
    assert relative(renderer.gradient(weights), exact.gradient(weights)) < 0.01


def test_no_smoke_no_change(wall):
    away = Camera.look_at((1.9, -1.2, 1.4), (3, -3, 1.4), fov_y_degrees=40, size=(14, 16))
    for camera in (CAMERAS["perspective"], away):
        renderer = PaperRenderer(Optics(DOMAIN, Medium(), (SUN,)), camera, wall)
        np.testing.assert_allclose(renderer.image(np.zeros(SHAPE, np.float32)), wall, rtol=1e-6)
    assert not renderer.gradient(np.ones(wall.shape)).any()
