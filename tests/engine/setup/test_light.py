"""The light of a scene that gives none, and who needs none."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from smokelift.footage.clip import Clip
from smokelift.scene import Background, DirectionalLight, Medium
from tests.engine.setup.shots import shot_of


def test_brightening_smoke_has_a_bright_source(plume, draft) -> None:
    """Thick smoke looks at least as bright as the brightest smoke in the clip."""
    shot = shot_of(replace(plume.scene, lights=()), draft)
    with Clip.open(plume.scene.clip) as clip:
        brightest = max(float(frame.max()) for frame in clip)
    source = shot.scene.medium.albedo / (4 * np.pi) * np.array(shot.scene.lights[0].irradiance)
    assert 0.7 * brightest < source.max() < 1.5 * brightest


def test_darkening_smoke_has_a_dark_source(plume, draft, tmp_path) -> None:
    """Before a bright wall, thick dark smoke looks no brighter than the darkest smoke in the clip."""
    sooty = replace(
        plume.scene,
        medium=Medium(extinction=8.0, albedo=0.3),
        lights=(DirectionalLight((0, 0.5, -0.8), (2.0, 2.0, 2.0)),),
        background=Background(color=(0.8, 0.8, 0.8)),
    )
    scene = plume.write(tmp_path / "clip", plume.densities, sooty)
    shot = shot_of(replace(scene, lights=()), draft)
    with Clip.open(scene.clip) as clip:
        darkest = min(float(frame.min()) for frame in clip)
    source = 0.3 / (4 * np.pi) * np.array(shot.scene.lights[0].irradiance)
    assert source.max() <= 1.1 * darkest
    assert source.max() < 0.4


def test_smoke_that_scatters_nothing_needs_no_light(plume, draft, tmp_path) -> None:
    """Albedo 0 is soot: whatever the light, it only darkens, so none has to be guessed."""
    black = replace(
        plume.scene,
        medium=Medium(extinction=8.0, albedo=0.0),
        lights=(),
        background=Background(color=(0.8, 0.8, 0.8)),
    )
    scene = plume.write(tmp_path / "clip", plume.densities, black)
    shot = shot_of(scene, draft)
    assert shot.scene.medium == black.medium
