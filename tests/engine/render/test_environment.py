"""Environment pictures as parallel lights: nothing lost, the right way round, the same on every machine."""

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from smokelift.footage.images import ImageError
from smokelift.output.images import write_image
from smokelift.render import Renderer
from smokelift.render.environment import environment_count, environment_lights
from smokelift.scene import Camera, Domain, EnvironmentLight, Medium
from tests.engine.render.environments import sky, soft_lamps, texels


def irradiances(lights) -> np.ndarray:
    return np.array([light.irradiance for light in lights])


def towards(lights) -> np.ndarray:
    return -np.array([light.direction for light in lights])


@pytest.mark.parametrize("size", [(64, 128), (5, 7), (37, 50), (300, 1100), (1, 1)])
@pytest.mark.parametrize("count", [1, 2, 7, 64])
def test_no_light_is_lost_or_made(light_of, size: tuple[int, int], count: int) -> None:
    radiance = np.random.default_rng(0).random((*size, 3)) ** 4
    lights = environment_lights(light_of(radiance, strength=2.5), count)
    _, solid_angle = texels(*size)
    wanted = 2.5 * (radiance * solid_angle[..., None]).sum((0, 1))
    assert len(lights) == count
    np.testing.assert_allclose(irradiances(lights).sum(0), wanted, rtol=1e-6)


@pytest.mark.parametrize(("row", "column"), [(0, 0), (0, 40), (9, 3), (16, 32), (20, 63), (31, 17)])
def test_a_lamp_shines_from_its_texel(light_of, row: int, column: int) -> None:
    """Row 0 is the zenith; u grows clockwise seen from above, and +X is in the middle.

    At a pole a texel is a slice of a cap, whose centroid lies off its middle.
    """
    radiance = np.zeros((32, 64, 3))
    radiance[row, column] = 4.0, 2.0, 1.0
    (lamp,) = environment_lights(light_of(radiance), 1)
    directions, solid_angle = texels(32, 64)
    np.testing.assert_allclose(
        -np.array(lamp.direction), directions[row, column], atol=0.02 if row in (0, 31) else 1e-3
    )
    np.testing.assert_allclose(lamp.irradiance, radiance[row, column] * solid_angle[row], rtol=1e-6)


@pytest.mark.parametrize(
    ("degrees", "expected"),
    [(0, (0.943, 0.0, 0.333)), (90, (0.0, -0.943, 0.333)), (37, (0.753, -0.568, 0.332)), (-450, (0.0, 0.943, 0.333))],
)
def test_rotation_turns_the_surroundings_as_blenders_mapping(light_of, degrees: float, expected) -> None:
    """The expected directions are what Cycles 4.5 shows of this picture behind a Mapping node, the last by symmetry."""
    radiance = np.zeros((64, 128, 3))
    radiance[20:30, 60:68] = 1.0
    (lamp,) = environment_lights(light_of(radiance, rotation_degrees=degrees), 1)
    np.testing.assert_allclose(-np.array(lamp.direction), expected, atol=2e-3)


def test_hdr_and_exr_are_the_same_way_round(light_of, tmp_path: Path) -> None:
    codes = np.random.default_rng(1).integers(128, 256, (8, 16, 4)).astype(np.uint8)
    codes[..., 3] = np.random.default_rng(2).integers(120, 136, (8, 16))
    rows = b"".join(bytes([2, 2, 0, 16]) + b"".join(b"\x10" + row[:, c].tobytes() for c in range(4)) for row in codes)
    (tmp_path / "sky.hdr").write_bytes(b"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 8 +X 16\n" + rows)
    radiance = codes[..., :3] * 2.0 ** (codes[..., 3:].astype(float) - 136)
    from_hdr = environment_lights(EnvironmentLight(tmp_path / "sky.hdr"), 9)
    from_exr = environment_lights(light_of(radiance), 9)
    np.testing.assert_allclose(irradiances(from_hdr), irradiances(from_exr), rtol=1e-6)
    np.testing.assert_allclose(towards(from_hdr), towards(from_exr), atol=1e-6)


def test_a_sun_stays_one_light(light_of) -> None:
    """Half a degree of 1e5 in a sky of about 1: the sun takes one light or two with little of the sky, not all."""
    radiance = sky(512, 1024)
    directions, solid_angle = texels(512, 1024)
    sun = np.array([0.6, -0.5, 0.62]) / np.linalg.norm([0.6, -0.5, 0.62])
    disc = directions @ sun > np.cos(np.radians(0.25))
    radiance[disc] = 1e5
    lights = environment_lights(light_of(radiance), 32)
    near = towards(lights) @ sun > np.cos(np.radians(0.5))
    assert 1 <= near.sum() <= 2
    of_sun, of_sky = (
        (1e5 * disc * solid_angle).sum(),
        (radiance * ~disc[..., None] * solid_angle[..., None]).sum((0, 1)),
    )
    fraction_of_sky = (irradiances(lights)[near].sum(0) - of_sun) / of_sky
    assert fraction_of_sky.min() >= -1e-6
    assert fraction_of_sky.max() < 0.05


def test_smooth_sums_over_the_sphere_converge(light_of) -> None:
    """Lobes around six directions, as a phase function's, wide and narrow, against all texels.

    A stratum's error grows with its scatter, its size squared, so n strata leave an error that falls like 1 / n.
    One sum may be right by chance, so the errors are root mean squares over directions and surroundings.
    """
    directions, solid_angle = texels(64, 128)
    sharpness = np.array([1.0, 3.0])[:, None, None]
    axes = np.concatenate([np.eye(3), -np.eye(3)])
    pictures = sky(), soft_lamps(0), soft_lamps(1)
    squares = np.zeros((3, 2))
    for radiance in pictures:
        flux = (radiance * solid_angle[..., None]).reshape(-1, 3)
        exact = np.exp(sharpness * (axes @ directions.reshape(-1, 3).T)) @ flux
        light = light_of(radiance)
        for number, count in enumerate((16, 64, 256)):
            lights = environment_lights(light, count)
            found = np.exp(sharpness * (axes @ towards(lights).T)) @ irradiances(lights)
            squares[number] += np.square(found / exact - 1).mean((1, 2)) / len(pictures)
    errors = np.sqrt(squares)
    assert (errors[0] < [0.03, 0.09]).all()
    assert (errors[1:] < errors[:-1] / 3).all()


@settings(max_examples=10, deadline=None, derandomize=True)
@given(st.integers(1, 40), st.integers(1, 40), st.integers(1, 30), st.integers(0, 5), st.floats(0.0, 30.0))
def test_any_picture_gives_usable_lights(
    tmp_path_factory, rows: int, columns: int, count: int, seed: int, contrast: float
) -> None:
    radiance = np.random.default_rng(seed).random((rows, columns, 3)) ** contrast
    path = tmp_path_factory.mktemp("any") / "environment.exr"
    write_image(path, radiance, half=False)
    lights = environment_lights(EnvironmentLight(path), count)
    assert 1 <= len(lights) <= count
    assert lights == environment_lights(EnvironmentLight(path), count)
    assert irradiances(lights).sum(1).min() > 0
    np.testing.assert_allclose(np.linalg.norm(towards(lights), axis=1), 1)


def test_black_pictures_give_no_light(light_of) -> None:
    assert environment_lights(light_of(np.zeros((4, 8, 3))), 16) == ()
    assert environment_lights(light_of(sky(), strength=0.0), 16) == ()


def write_raw(path: Path, radiance: np.ndarray) -> EnvironmentLight:
    import OpenEXR

    header = {"compression": OpenEXR.ZIP_COMPRESSION, "type": OpenEXR.scanlineimage}
    OpenEXR.File(header, {"RGB": radiance.astype(np.float32)}).write(str(path))
    return EnvironmentLight(path)


def test_negative_values_count_as_black(light_of, tmp_path: Path) -> None:
    radiance = np.random.default_rng(3).normal(size=(8, 16, 3))
    clean = environment_lights(light_of(np.maximum(radiance, 0)), 8)
    assert environment_lights(write_raw(tmp_path / "negative.exr", radiance), 8) == clean


@pytest.mark.parametrize("value", [np.nan, np.inf])
def test_values_that_are_not_finite_are_refused(tmp_path: Path, value: float) -> None:
    radiance = np.ones((8, 16, 3))
    radiance[3, 4, 1] = value
    with pytest.raises(ImageError):
        environment_lights(write_raw(tmp_path / "broken.exr", radiance), 8)


DOMAIN = Domain((-0.5, -0.5, 0.0), (0.5, 0.5, 1.5), (64, 64, 96))
CAMERA = Camera.look_at((1.5, -3.0, 1.4), (0.0, 0.0, 0.7), fov_y_degrees=35, size=(640, 480))


def test_a_black_picture_takes_the_least(light_of) -> None:
    assert environment_count(light_of(np.zeros((4, 8, 3))), CAMERA, DOMAIN, Medium()) == 4


def test_the_count_follows_the_scene(light_of) -> None:
    lamp = np.zeros((64, 128, 3))
    lamp[10, 20] = 1
    medium, forward = Medium(2.0, 0.9, 0.0), Medium(2.0, 0.9, 0.6)
    assert environment_count(light_of(lamp), CAMERA, DOMAIN, forward) == 4
    least = environment_count(light_of(sky()), CAMERA, DOMAIN, medium)
    assert 8 <= least < environment_count(light_of(sky()), CAMERA, DOMAIN, forward) <= 256


def test_the_count_is_enough(light_of, plume) -> None:
    domain, camera, density = plume.scene.domain, plume.scene.camera, plume.densities[0]
    medium = Medium(8.0, 0.9, 0.3)
    light = light_of(sky())
    count = environment_count(light, camera, domain, medium)
    assert count < 256
    few, many = (picture(environment_lights(light, number), camera, domain, medium, density) for number in (count, 256))
    assert np.linalg.norm(few - many) < 0.01 * np.linalg.norm(many)


def picture(lights, camera, domain, medium, density) -> np.ndarray:
    black = np.zeros(3, np.float32)
    return Renderer(camera, domain, medium, lights, black).image(density)
