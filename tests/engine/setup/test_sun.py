"""A sun that no scene gives: cameras all around tell where it stands, fewer do not."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from smokelift.scene import DirectionalLight
from smokelift.setup.choice import UNDETERMINED
from smokelift.setup.shot import Shot
from smokelift.setup.sun import LEAST_SHADING
from smokelift.setup.surroundings import light_around
from tests.engine.setup.shots import AROUND, filmed_around, shot_of

SUN = np.array((-0.5, -0.6, -0.4))
LIGHT = DirectionalLight((-0.5, -0.6, -0.4), (12.0, 11.0, 10.0))


def direction(shot: Shot):
    """What was found."""
    (found,) = [choice for choice in shot.choices if choice.what == "light direction"]
    return found


def test_four_cameras_around_the_smoke_tell_the_sun(plume, tmp_path, draft) -> None:
    shot = shot_of(filmed_around(plume, tmp_path, (LIGHT,)), draft)
    found = direction(shot)
    told = np.array([float(value) for value in found.chosen.split(",")])
    assert np.degrees(np.arccos(told @ SUN / np.linalg.norm(told) / np.linalg.norm(SUN))) < 20
    assert found.measured["ambient_share"] <= found.tolerance
    strongest = max(shot.scene.lights, key=lambda light: sum(light.irradiance))
    np.testing.assert_allclose(strongest.direction, told, atol=0.02)
    assert shot.scene.scattering in ("single", "multiple")
    assert any("Light direction" in choice.reason for choice in shot.choices)


def test_light_from_everywhere_is_no_sun(plume, tmp_path, draft) -> None:
    shot = shot_of(filmed_around(plume, tmp_path, light_around(np.full(3, 0.6))), draft)
    found = direction(shot)
    assert found.chosen == UNDETERMINED
    assert found.measured["ambient_share"] > found.tolerance


@pytest.mark.parametrize("angles", [AROUND[:3], (0.0, 30.0, 60.0, 90.0)], ids=["three", "close together"])
def test_cameras_that_do_not_see_all_sides_are_not_asked(plume, tmp_path, draft, angles) -> None:
    found = direction(shot_of(filmed_around(plume, tmp_path, (LIGHT,), angles), draft))
    assert found.chosen == UNDETERMINED
    assert not found.measured


def test_smoke_that_hardly_shades_itself_tells_no_sun(plume, tmp_path, draft) -> None:
    thin = replace(plume, densities=tuple(0.02 * density for density in plume.densities))
    bright = replace(LIGHT, irradiance=tuple(20 * value for value in LIGHT.irradiance))
    found = direction(shot_of(filmed_around(thin, tmp_path, (bright,)), draft))
    assert found.chosen == UNDETERMINED
    assert found.measured["shading"] < LEAST_SHADING
