"""A sun that no scene gives: cameras all around tell where it stands, fewer do not."""

import numpy as np
import pytest
from scipy.optimize import nnls

from smokelift.scene import DirectionalLight
from smokelift.setup.estimate import UNDETERMINED
from smokelift.setup.shot import Shot
from smokelift.setup.sky import SPREAD, light_around, sphere, strengths
from tests.engine.setup.shots import AROUND, filmed_around, shot_of

SUN = np.array((-0.5, -0.6, -0.4))
LIGHT = DirectionalLight((-0.5, -0.6, -0.4), (12.0, 11.0, 10.0))


def direction(shot: Shot):
    """What was found."""
    (found,) = [choice for choice in shot.estimates if choice.what == "light direction"]
    return found


def test_four_cameras_around_the_smoke_tell_the_sun(plume, tmp_path, draft) -> None:
    shot = shot_of(filmed_around(plume, tmp_path, (LIGHT,)), draft)
    found = direction(shot)
    estimated = np.array([float(value) for value in found.value.split(",")])
    assert np.degrees(np.arccos(estimated @ SUN / np.linalg.norm(estimated) / np.linalg.norm(SUN))) < 20
    assert found.figures["ambient_share"] <= found.tolerance
    strongest = max(shot.scene.lights, key=lambda light: sum(light.irradiance))
    np.testing.assert_allclose(strongest.direction, estimated, atol=0.02)
    assert shot.scene.scattering in ("single", "multiple")
    assert (found.kind, found.source) == ("light direction", "measured")


def test_light_from_everywhere_is_no_sun(plume, tmp_path, draft) -> None:
    shot = shot_of(filmed_around(plume, tmp_path, light_around(np.full(3, 0.6))), draft)
    found = direction(shot)
    assert found.value == UNDETERMINED
    assert found.figures["ambient_share"] > found.tolerance


def test_three_cameras_that_agree_are_enough(plume, tmp_path, draft) -> None:
    shot = shot_of(filmed_around(plume, tmp_path, (LIGHT,), AROUND[:3]), draft)
    found = direction(shot)
    assert found.spread < SPREAD
    assert found.value != UNDETERMINED


def test_directions_are_spread_evenly() -> None:
    ways = sphere(48)
    np.testing.assert_allclose(np.linalg.norm(ways, axis=1), 1)
    between = np.degrees(np.arccos(np.clip(ways @ ways.T - 2 * np.eye(48), -1, 1))).min(1)
    assert 20 < between.min() <= between.max() < 35


def test_light_around_has_its_radiance_and_no_direction() -> None:
    lights = light_around(np.array([0.2, 0.3, 0.4]))
    assert np.allclose(np.sum([light.irradiance for light in lights], 0) / (4 * np.pi), (0.2, 0.3, 0.4))
    assert np.allclose(np.sum([light.direction for light in lights], 0), 0)


@pytest.mark.parametrize("seed", range(4))
def test_strengths_are_the_least_squares_of_lights_that_add(seed: int) -> None:
    rng = np.random.default_rng(seed)
    lit, around = rng.uniform(0, 1, (6, 40)), rng.uniform(0, 1, 40)
    for seen in (0.5 * lit[0] + 0.2 * around, lit[1] - 0.3 * around, around - 0.5 * lit[2], -lit[0]):
        sums = np.array([np.sum(lit**2, 1), lit @ around, lit @ seen])
        found = np.array(strengths(sums, np.array([around @ around, around @ seen])))
        for sun, (strength, ambient, explained) in zip(lit, found.T, strict=True):
            both, left = nnls(np.stack([sun, around], 1), seen)
            np.testing.assert_allclose((strength, ambient), both, atol=1e-9)
            assert seen @ seen - explained == pytest.approx(left**2, abs=1e-9)
