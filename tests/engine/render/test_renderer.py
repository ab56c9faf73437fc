"""The renderer: image and derivative against the same sums in float64, the derivative by a complex step through them.

Also where methods fail: thin and opaque smoke, grazing light, the eye inside, grids of one voxel.
"""

from dataclasses import replace

import numpy as np
import pytest
import renderer_reference as reference
from hypothesis import given, settings
from hypothesis import strategies as st

from smokelift.render import Optics
from smokelift.scene import Camera, DirectionalLight, Domain, Medium, PointLight

SHAPE = (9, 8, 10)
CENTER = np.array([0.45, 0.4, 0.5])
SUN = DirectionalLight((0.57, 0.45, -0.68), (3.0, 2.0, 1.0))
EYES = {
    "along an axis": (0.2, -1.4, 0.6),
    "along a diagonal": (1.7, -0.8, 1.6),
    "from below": (-0.7, 1.5, -0.4),
    "from above": (0.45, 0.43, 2.0),
}
MODELS = ("single", "unshadowed", "absorption")
FAR = PointLight((3.0, -2.2, 3.5), (30.0, 25.0, 20.0))
LIGHTS = {
    "directional": (SUN,),
    "several directions of one color": (SUN, DirectionalLight((-0.2, 0.9, 0.1), (1.5, 1.0, 0.5))),
    "several colors": (
        SUN,
        DirectionalLight((-1.0, 0.2, 0.1), (0.0, 0.5, 2.0)),
        DirectionalLight((0, 0, 1), (1, 1, 1)),
    ),
    "point": (FAR,),
    "point close by": (PointLight((-0.06, 0.4, 0.6), (1.5, 1.0, 0.5)),),  # half a voxel before the box
    "point past an edge": (PointLight((-0.2, 0.9, 0.5), (1.5, 1.0, 0.5)),),
    "all": (SUN, FAR, PointLight((0.45, 0.4, -0.3), (0.1, 0.2, 2.0))),
}
WALL = np.random.default_rng(4).random((18, 16, 4)).astype(np.float32)


def domain_of(shape: tuple[int, int, int] = SHAPE) -> Domain:
    return Domain((0.0, 0.0, 0.0), tuple(0.1 * n for n in shape), shape)


def density_of(shape: tuple[int, int, int] = SHAPE) -> np.ndarray:
    """Random smoke up to the sides of the box, with holes."""
    rng = np.random.default_rng(3)
    return (rng.random(shape) * (rng.random(shape) > 0.3)).astype(np.float32)


DOMAIN, DENSITY = domain_of(), density_of()


def make_camera(eye, kind="perspective") -> Camera:
    """A slightly rolled camera with its axis off the picture's center."""
    looking = Camera.look_at(eye, tuple(CENTER), up=(0.1, 0.03, 1.0), fov_y_degrees=50, size=(16, 18))
    if kind == "orthographic":
        return replace(looking, type="orthographic", fx=11.0, fy=12.0, cx=8.3, cy=8.8)
    return replace(looking, fx=24.0, fy=26.0, cx=8.3, cy=8.8)


DIAGONAL = make_camera(EYES["along a diagonal"])


def medium_of_depth(depth: float, anisotropy: float = 0.3) -> Medium:
    """A medium through whose thickest column light passes ``depth`` mean free paths."""
    return Medium(depth / (DENSITY.sum(1).max() * DOMAIN.voxel_size), 0.9, anisotropy)


def check(
    camera: Camera = DIAGONAL,
    lights=(SUN,),
    medium: Medium | None = None,
    scattering="single",
    shape: tuple[int, int, int] = SHAPE,
    background: np.ndarray = WALL[..., :3],
) -> None:
    """Image, and derivative by some voxels, against the sums in double precision."""
    domain, density, medium = domain_of(shape), density_of(shape), medium or medium_of_depth(3)

    def exact(values: np.ndarray) -> np.ndarray:
        behind = background.astype(np.float64)
        colors = reference.render(values, camera, domain, medium, lights, behind[..., :3], scattering)
        if behind.shape[-1] == 3:
            return colors
        # smoke in no light before a white is its transmittance
        clear = reference.render(values, camera, domain, medium, (), np.ones(3), "absorption")[..., :1]
        return np.concatenate([colors, clear * behind[..., 3:]], -1)

    renderer = Optics(domain, medium, lights, scattering).renderer(camera, background)
    image, expected = renderer.image(density, keep_record=True), exact(density.astype(np.float64))
    assert np.linalg.norm(image - expected) < 2e-5 * np.linalg.norm(expected)
    weights = np.random.default_rng(5).random(image.shape)
    gradient = renderer.gradient(weights)
    for voxel in np.random.default_rng(6).permutation(np.argwhere(density > 0))[:5]:
        slope = reference.complex_step(lambda values: np.sum(weights * exact(values)), density, voxel)
        # beyond an optical depth of 87 transmittance counts as that of 87
        assert gradient[tuple(voxel)] == pytest.approx(slope, rel=1e-3, abs=1e-30)


@pytest.mark.parametrize("kind", ["perspective", "orthographic"])
@pytest.mark.parametrize("eye", EYES)
def test_every_camera(eye, kind) -> None:
    check(make_camera(EYES[eye], kind))


@pytest.mark.parametrize("scattering", MODELS)
@pytest.mark.parametrize("lights", LIGHTS.values(), ids=LIGHTS.keys())
def test_every_light_and_model(lights, scattering) -> None:
    check(make_camera(EYES["from below"]), lights, scattering=scattering)


@pytest.mark.parametrize("scattering", MODELS)
@pytest.mark.parametrize("background", [WALL, np.array((0.3, 0.2, 0.4, 0.9), np.float32)], ids=["picture", "color"])
def test_a_fourth_channel_shows_the_transmittance(background, scattering) -> None:
    check(scattering=scattering, background=background)


@pytest.mark.parametrize("depth", [0.001, 0.1, 1.0, 10.0, 100.0])
@pytest.mark.parametrize("anisotropy", [-0.9, 0.0, 0.9])
def test_every_optical_depth(depth, anisotropy) -> None:
    lights = (SUN, PointLight((-0.5, 0.4, 1.6), (1, 2, 3)))
    check(lights=lights, medium=medium_of_depth(depth, anisotropy))


AXES = [(1, 0, 0), (0, -1, 0), (0, 0, 1), (1, 1, 0), (1, 1, 1), (-1, 1, 1), (1, 1e-7, 0), (1e-6, -1, 1e-6)]
PLACES = [(0.45, 0.4, 1.001), (-1e-4, 0.4, 0.5), (-0.01, -0.01, -0.01), (900.0, 700.0, 500.0)]
INSIDE = [(0.45, 0.4, 0.5), (0.41, 0.33, 0.57), (0.02, 0.4, 0.98), (0.45, -0.001, 0.5)]
THIN = [(1, 8, 10), (9, 1, 10), (9, 8, 1), (1, 1, 10), (1, 1, 1)]
HARD = {
    **{f"light along {axis}": {"lights": (DirectionalLight(axis, (1, 1, 1)),)} for axis in AXES},
    **{f"lamp at {at}": {"lights": (PointLight(at, (float(np.sum((CENTER - at) ** 2)),) * 3),)} for at in PLACES},
    **{
        f"eye at {eye}": {"camera": Camera.look_at(eye, (0.8, 0.75, 0.2), fov_y_degrees=75, size=(16, 18))}
        for eye in INSIDE
    },
    **{
        f"grid {shape}": {
            "shape": shape,
            "camera": Camera.look_at((2.1, -1.4, 0.8), domain_of(shape).centre, fov_y_degrees=40, size=(16, 18)),
            "lights": (SUN, DirectionalLight((1.0, 0.1, 0.0), (1, 1, 2)), PointLight((-0.3, 0.2, 0.1), (1, 0, 0))),
        }
        for shape in THIN
    },
}


@pytest.mark.parametrize("named", HARD.values(), ids=HARD.keys())
def test_light_along_axes_lamps_at_the_surface_the_eye_inside_and_thin_grids(named) -> None:
    check(medium=Medium(5.0, 0.9, 0.3), **named)


def test_a_fourth_channel_leaves_light_of_all_orders_as_it_is() -> None:
    medium = medium_of_depth(3, 0.0)
    optics = Optics(DOMAIN, medium, (SUN,), "multiple")
    colors, both = (optics.renderer(DIAGONAL, wall) for wall in (WALL[..., :3], WALL))
    image = both.image(DENSITY)
    np.testing.assert_allclose(image[..., :3], colors.image(DENSITY), rtol=1e-6)
    np.testing.assert_allclose(image[..., 3], both.transmittance * WALL[..., 3], rtol=1e-6)


@given(
    yaw=st.floats(0, 360),
    pitch=st.floats(-80, 80),
    light=st.tuples(*[st.floats(-1, 1)] * 3).filter(lambda v: np.linalg.norm(v) > 0.1),
    anisotropy=st.floats(-0.9, 0.9),
    depth=st.sampled_from([0.001, 0.1, 3.0, 30.0, 100.0]),
)
@settings(max_examples=25, deadline=None, derandomize=True)
def test_image_is_finite_and_creates_no_light(yaw, pitch, light, anisotropy, depth) -> None:
    """From any side, for any light: no NaN, nothing negative, never brighter than source plus background."""
    yaw, pitch = np.radians([yaw, pitch])
    eye = CENTER + 2 * np.array([np.cos(pitch) * np.cos(yaw), np.cos(pitch) * np.sin(yaw), np.sin(pitch)])
    medium = replace(medium_of_depth(depth, anisotropy), albedo=1.0)
    sun = DirectionalLight(tuple(light), (1.0, 1.0, 1.0))
    gray = np.full(3, 0.5, np.float32)
    image = Optics(DOMAIN, medium, (sun,)).renderer(make_camera(tuple(eye)), gray).image(DENSITY)
    g = abs(anisotropy)
    brightest = (1 - g * g) / (4 * np.pi * (1 - g) ** 3)
    assert np.isfinite(image).all()
    assert image.min() >= 0
    assert image.max() <= max(brightest, 0.5) * (1 + 1e-5)


def test_gradient_stays_on_the_support() -> None:
    support = DENSITY > 0.3
    inside, wall, gradients = np.where(support, DENSITY, 0), WALL[..., :3], []
    for given_support in (None, support):
        renderer = Optics(DOMAIN, medium_of_depth(3), (SUN,)).renderer(DIAGONAL, wall, given_support)
        renderer.image(inside, keep_record=True)
        gradients.append(renderer.gradient(wall))
    np.testing.assert_allclose(gradients[1][support], gradients[0][support], rtol=1e-4, atol=1e-6)
    assert not gradients[1][~support].any()


def test_a_gradient_is_written_where_an_earlier_one_was() -> None:
    wall = WALL[..., :3]
    renderer = Optics(DOMAIN, medium_of_depth(3), (SUN,)).renderer(DIAGONAL, wall, DENSITY > 0.3)
    renderer.image(DENSITY, keep_record=True)
    first = renderer.gradient(wall)
    expected = first.copy()
    for _ in range(2):
        renderer.image(DENSITY, keep_record=True)
        assert renderer.gradient(wall, out=first) is first
    np.testing.assert_array_equal(first, expected)
    renderer.image(DENSITY, keep_record=True)
    with pytest.raises(TypeError):
        renderer.gradient(wall, out=np.zeros(SHAPE, np.float64))


def test_a_point_light_inside_the_domain_is_refused() -> None:
    with pytest.raises(ValueError):
        Optics(DOMAIN, Medium(), (PointLight(tuple(CENTER), (1, 1, 1)),)).renderer(DIAGONAL, np.zeros(3))


def test_unshadowed_source_is_the_radiance_of_thin_smoke() -> None:
    domain = Domain((-0.1, -0.1, 0.4), (0.1, 0.1, 0.6), (1, 1, 1))
    medium = Medium(1e-3, 0.8, 0.0)
    optics = Optics(domain, medium, (SUN, PointLight((2.0, 0.0, 0.5), (4.0, 8.0, 12.0))), "unshadowed")
    through = Camera.look_at((0.0, -3.0, 0.5), (0.0, 0.0, 0.5), fov_y_degrees=1, size=(1, 1))
    renderer = optics.renderer(through, np.zeros(3, np.float32))
    image = renderer.image(np.ones((1, 1, 1), np.float32))
    opacity = 1 - float(np.exp(-1e-3 * 0.2))
    np.testing.assert_allclose(image[0, 0], opacity * optics.unshadowed_source(), rtol=1e-3)
