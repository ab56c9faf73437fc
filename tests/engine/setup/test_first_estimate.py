"""Fire in a shot: it is distinguished from the smoke, and its colour is what the clip shows or the scene says."""

from dataclasses import replace

import pytest

from smokelift.footage.clip import Clip
from smokelift.scene import DirectionalLight
from smokelift.setup.prepare import prepare_shot
from tests.engine.setup.shots import burning


def test_fire_is_said_and_does_not_light_the_smoke(plume, draft, tmp_path) -> None:
    dim = replace(plume.scene, lights=(DirectionalLight((0.3, 0.5, -0.8), (0.6, 0.6, 0.6)),))
    scene = replace(plume.write(tmp_path, plume.densities, dim), lights=())
    with Clip.open(scene.clip) as clip:
        without, with_fire = (prepare_shot(each, scene, draft) for each in (clip, clip.changed(burning)))
    assert not any(choice.what == "fire" for choice in without.estimates)
    (found,) = [choice for choice in with_fire.estimates if choice.what == "fire"]
    assert found.kind == "fire"
    assert found.figures["share"] > 0 and found.figures["green"] == pytest.approx(0.4, abs=0.05)
    assert without.fire is None and without.scene.medium.flame_color is None
    assert with_fire.observe_fire(2).image.max() > 0.5 and without.observe_fire(2) is None
    red, green, blue = with_fire.scene.medium.flame_color
    assert (red, green) == (1, pytest.approx(0.4, abs=0.05)) and blue < 0.2
    assert with_fire.optics.unshadowed_source().max() < 3 * without.optics.unshadowed_source().max()


def test_a_color_of_fire_that_is_given_is_taken(plume, draft, tmp_path) -> None:
    dim = replace(plume.scene, lights=(DirectionalLight((0.3, 0.5, -0.8), (0.6, 0.6, 0.6)),))
    given = replace(dim, medium=replace(dim.medium, flame_color=(1.0, 0.5, 0.2)))
    scene = plume.write(tmp_path, plume.densities, given)
    with Clip.open(scene.clip) as clip:
        shot = prepare_shot(clip.changed(burning), scene, draft)
    assert shot.scene.medium.flame_color == (1.0, 0.5, 0.2)
    (found,) = [choice for choice in shot.estimates if choice.what == "fire"]
    assert found.kind == "fire"
    assert [found.figures[name] for name in ("red", "green", "blue")] == [1.0, 0.5, 0.2]
