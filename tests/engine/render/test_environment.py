"""Environment pictures as parallel lights: nothing lost, the right way round, the same on every machine."""

from dataclasses import replace

import numpy as np
import pytest

from smokelift.footage.image_files import ImageError
from smokelift.output.images import write_image
from smokelift.render import Optics
from smokelift.render.environment import EnvironmentCells, environment_count, sampled_lights
from smokelift.scene import Camera, DirectionalLight, EnvironmentLight, Medium, PointLight, completed


@pytest.fixture
def light_of(tmp_path):
    """Write a picture and make an environment light of it."""

    def write(radiance: np.ndarray, **options: float) -> EnvironmentLight:
        write_image(tmp_path / "environment.exr", radiance, half=False)
        return EnvironmentLight(tmp_path / "environment.exr", **options)

    return write


def texels(rows: int, columns: int) -> tuple[np.ndarray, np.ndarray]:
    """Unit vectors (rows, columns, 3) towards texel centers by the convention's formula, and solid angles (rows, 1)."""
    u = (np.arange(columns) + 0.5) / columns
    elevation = np.pi * (0.5 - (np.arange(rows)[:, None] + 0.5) / rows)
    azimuth = 2 * np.pi * (0.5 - u)
    level = np.cos(elevation)
    towards = np.broadcast_arrays(level * np.cos(azimuth), level * np.sin(azimuth), np.sin(elevation))
    band = np.cos(np.pi * np.arange(rows + 1) / rows)
    return np.stack(towards, -1), 2 * np.pi / columns * (band[:-1] - band[1:])[:, None]


def sky(rows: int = 64, columns: int = 128) -> np.ndarray:
    """Bright above the horizon, dark below, brighter to one side; blue above, brown below."""
    towards, _ = texels(rows, columns)
    z = towards[..., 2:]
    above = (0.4 + (1 - z) ** 3) * np.array([0.6, 0.8, 1.2])
    return np.where(z > 0, above, [0.2, 0.15, 0.1]) * (1 + 0.5 * towards[..., :1])


def soft_lamps(rows: int = 64, columns: int = 128) -> np.ndarray:
    """Three wide lamps in random places."""
    rng = np.random.default_rng(0)
    towards, _ = texels(rows, columns)
    places = rng.standard_normal((3, 3))
    places /= np.linalg.norm(places, axis=1, keepdims=True)
    return np.exp(2 * towards @ places.T) @ rng.uniform(0.2, 1, (3, 3))


def irradiances(lights) -> np.ndarray:
    return np.array([light.irradiance for light in lights])


def towards(lights) -> np.ndarray:
    return -np.array([light.direction for light in lights])


@pytest.mark.parametrize(
    ("size", "count"), [((64, 128), 64), ((5, 7), 2), ((37, 50), 7), ((300, 1100), 2), ((1, 1), 1)]
)
def test_no_light_is_lost_or_made(light_of, size, count) -> None:
    radiance = np.random.default_rng(0).random((*size, 3)) ** 4
    lights = EnvironmentCells(light_of(radiance, strength=2.5)).lights(count)
    _, solid_angle = texels(*size)
    wanted = 2.5 * (radiance * solid_angle[..., None]).sum((0, 1))
    assert len(lights) == count
    np.testing.assert_allclose(irradiances(lights).sum(0), wanted, rtol=1e-6)


@pytest.mark.parametrize(("row", "column"), [(0, 0), (0, 40), (9, 3), (16, 32), (20, 63), (31, 17)])
def test_a_lamp_shines_from_its_texel(light_of, row, column) -> None:
    """Row 0 is the zenith; u grows clockwise seen from above, and +X is in the middle.

    At a pole a texel is a slice of a cap, whose centroid lies off its middle.
    """
    radiance = np.zeros((32, 64, 3))
    radiance[row, column] = 4.0, 2.0, 1.0
    (lamp,) = EnvironmentCells(light_of(radiance)).lights(1)
    directions, solid_angle = texels(32, 64)
    np.testing.assert_allclose(
        -np.array(lamp.direction), directions[row, column], atol=0.02 if row in (0, 31) else 1e-3
    )
    np.testing.assert_allclose(lamp.irradiance, radiance[row, column] * solid_angle[row], rtol=1e-6)


@pytest.mark.parametrize(
    ("degrees", "expected"),
    [(0, (0.943, 0.0, 0.333)), (90, (0.0, -0.943, 0.333)), (37, (0.753, -0.568, 0.332)), (-450, (0.0, 0.943, 0.333))],
)
def test_rotation_turns_the_surroundings_as_blenders_mapping(light_of, degrees, expected) -> None:
    """The expected directions are what Cycles 4.5 shows of this picture behind a Mapping node, the last by symmetry."""
    radiance = np.zeros((64, 128, 3))
    radiance[20:30, 60:68] = 1.0
    (lamp,) = EnvironmentCells(light_of(radiance, rotation_degrees=degrees)).lights(1)
    np.testing.assert_allclose(-np.array(lamp.direction), expected, atol=2e-3)


def test_a_sun_stays_one_light(light_of) -> None:
    """Half a degree of 1e5 in a sky of about 1: the sun takes one light or two with little of the sky, not all."""
    radiance = sky(512, 1024)
    directions, solid_angle = texels(512, 1024)
    sun = np.array([0.6, -0.5, 0.62]) / np.linalg.norm([0.6, -0.5, 0.62])
    disc = directions @ sun > np.cos(np.radians(0.25))
    radiance[disc] = 1e5
    lights = EnvironmentCells(light_of(radiance)).lights(32)
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
    One sum may be right by chance, so the errors are root mean squares over directions.
    """
    directions, solid_angle = texels(64, 128)
    sharpness = np.array([1.0, 3.0])[:, None, None]
    axes, radiance = np.concatenate([np.eye(3), -np.eye(3)]), soft_lamps()
    flux = (radiance * solid_angle[..., None]).reshape(-1, 3)
    exact = np.exp(sharpness * (axes @ directions.reshape(-1, 3).T)) @ flux
    light, errors = light_of(radiance), []
    for count in (16, 64):
        lights = EnvironmentCells(light).lights(count)
        found = np.exp(sharpness * (axes @ towards(lights).T)) @ irradiances(lights)
        errors.append(np.sqrt(np.square(found / exact - 1).mean((1, 2))))
    assert (errors[0] < [0.03, 0.09]).all()
    assert (errors[1] < errors[0] / 3).all()


@pytest.mark.parametrize("value", [np.nan, -1.0])
def test_values_that_are_not_finite_are_refused_and_negative_ones_black(light_of, tmp_path, value) -> None:
    import OpenEXR

    radiance = np.random.default_rng(3).random((8, 16, 3)).astype(np.float32)
    radiance[3, 4, 1] = 0
    clean = EnvironmentCells(light_of(radiance)).lights(8)
    radiance[3, 4, 1] = value
    header = {"compression": OpenEXR.ZIP_COMPRESSION, "type": OpenEXR.scanlineimage}
    OpenEXR.File(header, {"RGB": radiance}).write(str(tmp_path / "raw.exr"))
    raw = EnvironmentLight(tmp_path / "raw.exr")
    if np.isnan(value):
        with pytest.raises(ImageError):
            EnvironmentCells(raw).lights(8)
    else:
        assert EnvironmentCells(raw).lights(8) == clean


def test_a_picture_without_light_becomes_none(light_of) -> None:
    black = np.zeros((64, 128, 3))
    assert (
        EnvironmentCells(light_of(black)).lights(16) == EnvironmentCells(light_of(sky(), strength=0.0)).lights(16) == ()
    )


def test_an_environment_becomes_parallel_lights_in_its_place_wherever_the_camera_is(light_of, plume) -> None:
    scene, sun = completed(plume.scene), DirectionalLight((0.57, 0.45, -0.68), (3.0, 2.0, 1.0))
    lamp = PointLight((4.0, -3.0, 5.0), (60.0, 50.0, 40.0))
    first, *between, last = sampled_lights(replace(scene, lights=(lamp, light_of(sky(), directions=9), sun)))
    assert (first, last, len(between)) == (lamp, sun, 9)
    assert all(isinstance(light, DirectionalLight) for light in between)
    away = Camera.look_at((0.0, -30.0, 1.0), (0.0, 0.0, 0.7), fov_y_degrees=35, size=(64, 48))
    scene = replace(scene, lights=(light_of(sky()),))
    moving = replace(scene, camera=replace(scene.camera, matrices=(scene.camera.matrix, away.matrix)))
    assert sampled_lights(moving) == sampled_lights(scene)


def test_the_count_is_enough_and_few_where_few_are(light_of, plume) -> None:
    domain, camera, medium = plume.scene.domain, plume.scene.camera, Medium(8.0, 0.9, 0.3)
    lamp = np.zeros((64, 128, 3))
    lamp[10, 20] = 1
    assert environment_count(light_of(lamp), camera, domain, medium) == 4
    light, black = light_of(sky()), np.zeros(3, np.float32)
    count = environment_count(light, camera, domain, medium)
    assert 8 <= count < 256
    few, many = (
        Optics(domain, medium, EnvironmentCells(light).lights(number)).renderer(camera, black).image(plume.densities[0])
        for number in (count, 256)
    )
    assert np.linalg.norm(few - many) < 0.01 * np.linalg.norm(many)
