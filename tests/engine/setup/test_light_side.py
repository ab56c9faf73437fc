"""The side of the picture from which the light comes: told in sunlight from aside, undetermined elsewhere."""

from __future__ import annotations

from functools import lru_cache

import numpy as np
import pytest
from scipy.ndimage import gaussian_filter

from smokelift.render import Renderer
from smokelift.scene import Camera, DirectionalLight, Domain, Medium
from smokelift.setup.light import find_light
from smokelift.setup.light_side import LightSide, light_side
from smokelift.setup.smoke import SmokeSamples
from smokelift.setup.thickness import BlockMaps, Texture

SIZE = (20, 24)
"""Blocks across and down."""


@lru_cache(maxsize=1)
def smoke() -> tuple[np.ndarray, ...]:
    """Lumps of smoke at several depths, as Smokelift's own round body is not."""
    rng, densities = np.random.default_rng(3), []
    for frame in range(4):
        density = np.zeros((SIZE[0], 16, SIZE[1]))
        for _ in range(9):
            density[rng.integers(6, 14), rng.integers(4, 12), rng.integers(4, 14) + frame] += 1
        density = gaussian_filter(density, 1.8)
        densities.append(np.where(density > 2e-3, 4 * density / density.max(), 0).astype("f4"))
    return tuple(densities)


def frames(towards=(), everywhere=0.0, count=4, known=True) -> tuple[Texture, ...]:
    """What frames of it show in light from everywhere and a sun that stands towards (right, behind the smoke, up)."""
    low, high = (-SIZE[0] / 2, -8.0, -SIZE[1] / 2), (SIZE[0] / 2, 8.0, SIZE[1] / 2)
    matrix = ((1.0, 0.0, 0.0, 0.0), (0.0, 0.0, -1.0, -20.0), (0.0, 1.0, 0.0, 0.0), (0.0, 0.0, 0.0, 1.0))
    camera = Camera("orthographic", matrix, SIZE, 1.0, 1.0, SIZE[0] / 2, SIZE[1] / 2)
    around = [(x, y, z) for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)]
    suns = [(towards, 1.0)] if towards else []
    lights = [
        DirectionalLight(tuple(-v for v in way), (4 * np.pi * strength,) * 3)
        for way, strength in suns + [(way, everywhere / len(around)) for way in around if everywhere]
    ]
    domain = Domain(low, high, (SIZE[0], 16, SIZE[1]))
    renderer = Renderer(camera, domain, Medium(extinction=0.5, albedo=1.0), tuple(lights), np.zeros(3, "f4"))
    seen = []
    for density in smoke()[:count]:
        added = renderer.image(density)[..., 0].astype(np.float64)
        passed = renderer.transmittance.astype(np.float64)
        covered = (passed < 0.98).astype(np.float64)
        maps = BlockMaps(passed, added, np.full(covered.shape, known), covered)
        hidden = float(np.sum(1 - passed))
        seen.append(Texture(hidden, np.full(3, added.sum()), float(covered.sum()), 0.0, 100.0, 0.0, maps))
    return tuple(seen)


@pytest.mark.parametrize("angle", [20, 110, 250])
@pytest.mark.parametrize("everywhere", [0.0, 0.3])
def test_a_sun_from_aside_is_told(angle, everywhere) -> None:
    """By smoke that is brighter towards it."""
    radians = np.radians(angle)
    side = light_side(frames((float(np.cos(radians)), -0.2, float(np.sin(radians))), everywhere))
    assert side is not None
    assert side.told
    assert abs((side.angle - angle + 180) % 360 - 180) < 20


@pytest.mark.parametrize(
    "light",
    [
        {"everywhere": 1.0},
        {"towards": (1.0, 0.0, 0.5), "everywhere": 6.0},
        {"towards": (0.1, -1.0, 0.1)},
        {"towards": (0.1, 1.0, 0.1)},
    ],
    ids=["everywhere", "hardly a sun", "before the smoke", "behind the smoke"],
)
def test_light_from_no_side_is_undetermined(light) -> None:
    side = light_side(frames(**light))
    assert side is not None
    assert not side.told


def test_too_little_smoke_before_texture_tells_nothing() -> None:
    assert light_side(frames((1.0, 0.0, 0.5), count=2)) is None
    assert light_side(frames((1.0, 0.0, 0.5), known=False)) is None


def test_the_side_is_said_of_a_light_that_is_not_given() -> None:
    """And of none that a scene gives, that turns with the camera, or that the smoke's thickness leaves open."""
    textures = frames((-1.0, 0.0, 1.0))
    none, rows = np.zeros((0, 3), "f4"), np.zeros((1, 1), np.bool_)
    samples = SmokeSamples(1.0, (0, 0, 1, 1), rows, rows, none, none, (0,), {}, textures)
    found = find_light((), None, Medium(), samples, True)
    assert found.side is not None
    assert "upper left of the picture" in found.side.choice.reason
    assert found.scattering == "unshadowed"  # no sun is made of it
    given = (DirectionalLight((0, 0, -1), (1, 1, 1)),)
    assert find_light(given, None, Medium(), samples, True).side is None
    assert find_light((), None, Medium(), samples, False).side is None
    open_ = SmokeSamples(1.0, (0, 0, 1, 1), rows, rows, none, none, (0,), {}, textures[:2])
    assert find_light((), None, Medium(), open_, True).side is None


@pytest.mark.parametrize(("angle", "name"), [(-1.0, " right"), (124.0, "upper left"), (-130.0, "lower left")])
def test_angles_have_names(angle, name) -> None:
    choice = LightSide(angle, 0.9, 0.9).choice
    assert f"{name} of the picture, {choice.chosen} degrees" in choice.reason
    assert 0 <= int(choice.chosen) < 360
