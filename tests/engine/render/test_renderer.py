"""The renderer: its image against the same sums in float64, its derivative against a complex step through them."""

from dataclasses import replace

import numpy as np
import pytest
import renderer_reference as reference
from hypothesis import given, settings
from hypothesis import strategies as st

from smokelift import render_gradient
from smokelift.render import Renderer
from smokelift.scene import Background, Camera, DirectionalLight, Domain, Medium, PointLight, Scene

SHAPE = (14, 12, 16)
DOMAIN = Domain((0.0, 0.0, 0.0), (1.4, 1.2, 1.6), SHAPE)
SUN = DirectionalLight((0.57, 0.45, -0.68), (3.0, 2.0, 1.0))
CENTER = np.array([0.7, 0.6, 0.8])
EYES = {
    "along an axis": (0.3, -2.0, 0.9),
    "along a diagonal": (2.5, -1.2, 2.4),
    "from below": (-1.0, 2.2, -0.6),
    "from above": (0.7, 0.65, 3.0),
}
MODELS = ("single", "unshadowed", "absorption")
FAR, CLOSE = (4.0, -3.0, 5.0), (-0.06, 0.5, 0.9)  # CLOSE: half a voxel before the box
LIGHTS = {
    "directional": (SUN,),
    "several directions of one color": (SUN, DirectionalLight((-0.2, 0.9, 0.1), (1.5, 1.0, 0.5))),
    "several colors": (
        SUN,
        DirectionalLight((-1.0, 0.2, 0.1), (0.0, 0.5, 2.0)),
        DirectionalLight((0, 0, 1), (1, 1, 1)),
    ),
    "point": (PointLight(FAR, (60.0, 50.0, 40.0)),),
    "point close by": (PointLight(CLOSE, (1.5, 1.0, 0.5)),),
    "point past an edge": (PointLight((-0.2, 1.3, 0.8), (1.5, 1.0, 0.5)),),
    "all": (SUN, PointLight(FAR, (60.0, 50.0, 40.0)), PointLight((0.7, 0.6, -0.3), (0.1, 0.2, 2.0))),
}


def make_camera(eye, kind="perspective", size=(20, 22)):
    """A slightly rolled camera with its axis off the picture's center."""
    looking = Camera.look_at(eye, tuple(CENTER), up=(0.1, 0.03, 1.0), fov_y_degrees=50, size=size)
    if kind == "orthographic":
        return replace(looking, type="orthographic", fx=11.0, fy=12.0, cx=10.3, cy=10.8)
    return replace(looking, fx=30.0, fy=33.0, cx=10.3, cy=10.8)


@pytest.fixture(scope="module")
def density():
    rng = np.random.default_rng(3)
    axes = [(np.arange(n) + 0.5) / n * 2 - 1 for n in SHAPE]
    x, y, z = np.meshgrid(*axes, indexing="ij")
    values = np.exp(-4 * (x**2 + y**2 + z**2)) * (0.5 + rng.random(SHAPE))
    values[values < 0.05] = 0
    values[2, :, 5] += 0.3  # touches the sides of the box
    return values.astype(np.float32)


@pytest.fixture(scope="module")
def wall():
    return np.random.default_rng(4).random((22, 20, 3)).astype(np.float32)


def medium_of_depth(density, depth):
    """A medium through whose thickest column light passes ``depth`` mean free paths."""
    return Medium(depth / (density.sum(1).max() * DOMAIN.voxel_size), 0.9, 0.3)


@pytest.mark.parametrize(
    ("eye", "kind", "lights"),
    [
        *((eye, kind, "directional") for eye in EYES for kind in ("perspective", "orthographic")),
        *(("along a diagonal", "perspective", lights) for lights in LIGHTS),
    ],
)
@pytest.mark.parametrize("scattering", MODELS)
def test_image_equals_the_sums_in_double_precision(density, wall, eye, kind, lights, scattering):
    camera, medium = make_camera(EYES[eye], kind), medium_of_depth(density, 3)
    image = Renderer(camera, DOMAIN, medium, LIGHTS[lights], wall, scattering).image(density)
    expected = reference.render(density.astype(np.float64), camera, DOMAIN, medium, LIGHTS[lights], wall, scattering)
    assert np.linalg.norm(image - expected) < (1e-6 if lights == "directional" else 2e-6) * np.linalg.norm(expected)


@pytest.mark.parametrize("kind", ["perspective", "orthographic"])
@pytest.mark.parametrize("depth", [0.1, 3, 30])
def test_gradient_equals_a_complex_step(density, wall, kind, depth):
    check_gradient(density, wall, make_camera(EYES["along a diagonal"], kind), depth, (SUN,))


@pytest.mark.parametrize("lights", list(LIGHTS.values())[1:], ids=list(LIGHTS.keys())[1:])
def test_gradient_of_every_light_equals_a_complex_step(density, wall, lights):
    """At one optical depth; `test_renderer_stability` has parallel and point light at all."""
    check_gradient(density, wall, make_camera(EYES["from below"]), 3, lights)


def check_gradient(density, wall, camera, depth, lights):
    medium, behind = medium_of_depth(density, depth), (0.3, 0.2, 0.4)
    scene = Scene(domain=DOMAIN, medium=medium, lights=lights, background=Background(color=behind))
    gradient = render_gradient(density, scene, wall, camera)[1]

    def loss(values):
        return np.sum((reference.render(values, camera, DOMAIN, medium, lights, np.array(behind)) - wall) ** 2)

    check_derivatives(gradient, loss, density, camera, medium)


def check_derivatives(gradient, loss, density, camera, medium):
    for voxel in voxels_of_three_kinds(density, camera, medium):
        assert gradient[voxel] == pytest.approx(reference.complex_step(loss, density, voxel), rel=1e-3, abs=0)


@pytest.mark.parametrize("scattering", ["multiple", *MODELS])
def test_a_fourth_channel_shows_the_transmittance(density, wall, scattering):
    """Smoke is black there, and the colors are what they are without it."""
    camera, medium = make_camera(EYES["along a diagonal"]), replace(medium_of_depth(density, 3), anisotropy=0.0)
    white = np.linspace(0.5, 1.5, wall.shape[1], dtype=np.float32) * np.ones(wall.shape[:2], np.float32)
    colors = Renderer(camera, DOMAIN, medium, (SUN,), wall, scattering)
    both = Renderer(camera, DOMAIN, medium, (SUN,), np.dstack([wall, white]), scattering)
    image = both.image(density)
    assert image.shape == (22, 20, 4)
    np.testing.assert_allclose(image[..., :3], colors.image(density), rtol=1e-6)
    np.testing.assert_allclose(image[..., 3], both.transmittance * white, rtol=1e-6)
    assert both.transmittance.min() < 0.2


@pytest.mark.parametrize("scattering", MODELS)
def test_gradient_of_four_channels_equals_a_complex_step(density, wall, scattering):
    camera, medium = make_camera(EYES["along a diagonal"]), medium_of_depth(density, 3)
    background = np.array((0.3, 0.2, 0.4, 0.9), np.float32)
    target = np.dstack([wall, wall.mean(-1)])
    renderer = Renderer(camera, DOMAIN, medium, (SUN,), background, scattering)
    image = renderer.image(density, keep_record=True)
    gradient = renderer.gradient(2 * (image - target))

    def loss(values):
        scene = (values, camera, DOMAIN, medium, (SUN,))
        colors = reference.render(*scene, background[:3].astype(np.float64), scattering)
        # smoke in no light before a white is its transmittance
        clear = reference.render(*scene, np.ones(3), "absorption")[..., :1]
        return np.sum((np.concatenate([colors, clear * float(background[3])], -1) - target) ** 2)

    check_derivatives(gradient, loss, density, camera, medium)


def voxels_of_three_kinds(density, camera, medium):
    """Random voxels of smoke, three each: lit, behind other smoke as the camera sees it, in its shadow."""
    kappa = medium.extinction * density.astype(np.float64)
    shadow = reference.light_optical_depth(kappa, DOMAIN.voxel_size, SUN.direction)
    hidden = reference.light_optical_depth(kappa, DOMAIN.voxel_size, -np.array(camera.matrix)[:3, 2])
    smoke = np.argwhere(density > 0.1)
    at = tuple(smoke.T)
    rng = np.random.default_rng(6)
    kinds = (
        shadow[at] < np.quantile(shadow[at], 0.3),
        hidden[at] > np.quantile(hidden[at], 0.6),
        shadow[at] > np.quantile(shadow[at], 0.6),
    )
    return [tuple(voxel) for kind in kinds for voxel in rng.choice(smoke[kind], 3, replace=False)]


@given(
    yaw=st.floats(0, 360),
    pitch=st.floats(-80, 80),
    light=st.tuples(*[st.floats(-1, 1)] * 3).filter(lambda v: np.linalg.norm(v) > 0.1),
    anisotropy=st.floats(-0.9, 0.9),
    depth=st.sampled_from([0.001, 0.1, 3.0, 30.0, 100.0]),
)
@settings(max_examples=25, deadline=None, derandomize=True)
def test_image_is_finite_and_creates_no_light(density, yaw, pitch, light, anisotropy, depth):
    """From any side, for any light: no NaN, nothing negative, never brighter than source plus background."""
    yaw, pitch = np.radians([yaw, pitch])
    eye = CENTER + 3 * np.array([np.cos(pitch) * np.cos(yaw), np.cos(pitch) * np.sin(yaw), np.sin(pitch)])
    medium = replace(medium_of_depth(density, depth), anisotropy=anisotropy, albedo=1.0)
    sun = DirectionalLight(tuple(light), (1.0, 1.0, 1.0))
    image = Renderer(make_camera(tuple(eye)), DOMAIN, medium, (sun,), np.full(3, 0.5, np.float32)).image(density)
    g = abs(anisotropy)
    brightest = (1 - g * g) / (4 * np.pi * (1 - g) ** 3)
    assert np.isfinite(image).all()
    assert image.min() >= 0
    assert image.max() <= max(brightest, 0.5) * (1 + 1e-5)


def test_gradient_stays_on_the_support(density, wall):
    support = density > 0.3
    inside = np.where(support, density, 0)
    camera, medium = make_camera((2.5, -1.2, 2.4)), medium_of_depth(density, 3)
    gradients = []
    for given_support in (None, support):
        renderer = Renderer(camera, DOMAIN, medium, (SUN,), wall, support=given_support)
        renderer.image(inside, keep_record=True)
        gradients.append(renderer.gradient(wall))
    np.testing.assert_allclose(gradients[1][support], gradients[0][support], rtol=1e-4, atol=1e-6)
    assert not gradients[1][~support].any()


def test_a_gradient_is_written_where_an_earlier_one_was(density, wall):
    renderer = Renderer(
        make_camera((2.5, -1.2, 2.4)), DOMAIN, medium_of_depth(density, 3), (SUN,), wall, support=density > 0.3
    )
    renderer.image(density, keep_record=True)
    first = renderer.gradient(wall)
    expected = first.copy()
    for _ in range(2):
        renderer.image(density, keep_record=True)
        assert renderer.gradient(wall, out=first) is first
    np.testing.assert_array_equal(first, expected)
    renderer.image(density, keep_record=True)
    with pytest.raises(TypeError):
        renderer.gradient(wall, out=np.zeros(density.shape, np.float64))


def test_a_point_light_inside_the_domain_is_refused():
    lamp = PointLight((0.7, 0.6, 0.8), (1, 1, 1))
    with pytest.raises(ValueError):
        Renderer(make_camera((0.3, -2.0, 0.9)), DOMAIN, Medium(), (lamp,), np.zeros(3))
