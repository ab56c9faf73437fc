"""Choices by measurement: each clip gets what it needs and no more, and what is said by hand is not measured."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import settings as hypothesis_settings
from hypothesis import strategies as st

from smokelift.footage.clip import Clip
from smokelift.footage.noise import EIGHT_BIT_NOISE
from smokelift.footage.plate import Plate
from smokelift.footage.working_picture import working_picture
from smokelift.output.images import write_image
from smokelift.scene import Background, Domain, EnvironmentLight, Medium, Scene, SceneError, completed
from smokelift.setup import illumination
from smokelift.setup.coarse import COARSE_SIDE, coarse_domain, coarse_frame
from smokelift.setup.estimate import Estimate
from smokelift.setup.held_out import HeldOut
from smokelift.setup.prepare import velocity_coarsening
from smokelift.setup.settings import Settings
from smokelift.setup.shot import Shot, ShotView
from tests.engine.setup.shots import shot_of


def chosen(shot: Shot, what: str) -> Estimate:
    (choice,) = (choice for choice in shot.estimates if choice.what == what)
    return choice


def with_scattering(settings: Settings, model: str) -> Settings:
    return replace(settings, scattering=model)


@pytest.fixture(scope="module")
def silhouette(plume, tmp_path_factory) -> Scene:
    """The blob, dense and unlit, before a bright sky."""
    dark = replace(plume.scene, medium=Medium(25.0, 0.9), lights=(), background=Background(color=(0.8, 0.9, 1.0)))
    return plume.write(tmp_path_factory.mktemp("silhouette"), plume.densities, dark)


@pytest.fixture(scope="module")
def thin(plume, tmp_path_factory) -> Scene:
    """The blob as a haze in strong light."""
    (sun,) = plume.scene.lights
    haze = replace(plume.scene, medium=Medium(0.2, 0.9), lights=(replace(sun, irradiance=(80.0, 80.0, 80.0)),))
    return plume.write(tmp_path_factory.mktemp("thin"), plume.densities, haze)


@pytest.fixture(scope="module")
def white(plume, tmp_path_factory) -> Scene:
    """The blob as thick white smoke, in light that is scattered any number of times."""
    (sun,) = plume.scene.lights
    dim = replace(sun, irradiance=(5.0, 5.0, 5.0))  # nothing is brighter than a picture can be
    white = replace(plume.scene, medium=Medium(20.0, 0.98), lights=(dim,), scattering="multiple")
    return replace(plume.write(tmp_path_factory.mktemp("white"), plume.densities, white), scattering=None)


# scattering


def test_a_backlit_silhouette_needs_no_light(silhouette, draft) -> None:
    """Dark smoke before a bright sky only absorbs, and the figures say that more would not be better."""
    shot = shot_of(silhouette, draft)
    choice = chosen(shot, "scattering")
    assert shot.scene.scattering == choice.value == "absorption"
    assert choice.figures["error_absorption"] <= choice.figures["error_unshadowed"] + choice.tolerance
    assert (choice.kind, choice.figures["other"]) == ("compared scattering", "unshadowed")


def test_thick_lit_smoke_needs_shadows(plume, draft) -> None:
    shot = shot_of(plume.scene, draft)
    choice = chosen(shot, "scattering")
    assert shot.scene.scattering == choice.value == "single"
    assert choice.figures["error_unshadowed"] > choice.figures["error_single"] + 2 * choice.tolerance
    assert choice.figures["error_absorption"] > 0.9


def test_thick_white_smoke_scatters_light_many_times(white, plume, draft) -> None:
    shot = shot_of(white, draft)
    choice = chosen(shot, "scattering")
    assert shot.scene.scattering == choice.value == "multiple"
    assert choice.figures["error_multiple"] < choice.figures["error_single"] - choice.tolerance
    assert (choice.kind, choice.figures["other"]) == ("compared scattering", "single")
    forward = replace(plume.scene, medium=replace(plume.scene.medium, anisotropy=0.3))
    assert "error_multiple" not in chosen(shot_of(forward, draft), "scattering").figures


def test_single_scattering_is_kept_where_both_meet_the_picture(plume, draft, monkeypatch) -> None:
    """Multiple scattering has to be clearly nearer: it finds half as dense a smoke for the same picture."""
    own = {"single": 0.028, "multiple": 0.026}
    monkeypatch.setattr(
        illumination, "held_out", lambda _, model, judge, __: HeldOut(own[judge] if model == judge else 0.4)
    )
    choice = chosen(shot_of(plume.scene, draft), "scattering")
    assert choice.value == "single"
    own["single"] = 0.035  # by less than a cheaper model may add, which is no question here
    assert chosen(shot_of(plume.scene, draft), "scattering").value == "multiple"


@pytest.mark.parametrize(("near", "asked"), [(0.05, {(8, 4), (16, 64)}), (0.01, {(8, 4)})])
def test_models_that_coarse_frames_do_not_tell_apart_are_tried_on_finer_ones(
    plume, draft, monkeypatch, near, asked
) -> None:
    """The errors of a coarse grid, and of few steps, hide the medium's; where they do not, nothing more is spent."""
    fitted_on = set()

    def known(frames, fitted, judge, settings) -> HeldOut:
        voxels = max(frames[0].scene.domain.resolution)
        fitted_on.add((voxels, settings.descent_iterations))
        errors = {"single": 0.05, "multiple": near if voxels == 8 else 0.01}
        return HeldOut(errors[judge] if fitted == judge else 0.4)

    monkeypatch.setattr("smokelift.setup.coarse.COARSE_SIDE", 8)
    monkeypatch.setattr(illumination, "held_out", known)
    choice = chosen(shot_of(plume.scene, draft), "scattering")
    assert fitted_on == asked
    assert choice.value == "multiple"
    assert choice.figures["error_multiple"] == 0.01


def test_thin_smoke_needs_no_shadows(thin, draft) -> None:
    choice = chosen(shot_of(thin, draft), "scattering")
    assert choice.value == "unshadowed"
    assert {"error_absorption", "error_unshadowed", "error_single", "error_multiple"} < set(choice.figures)


@pytest.mark.parametrize("model", ["absorption", "unshadowed", "single", "multiple"])
def test_scattering_by_hand_wins(plume, thin, draft, model) -> None:
    for scene in (plume.scene, thin):
        shot = shot_of(scene, with_scattering(draft, model))
        choice = chosen(shot, "scattering")
        assert (shot.scene.scattering, choice.source, choice.figures) == (model, "given", {})


def test_shadows_need_a_light(silhouette, draft) -> None:
    for model in ("single", "multiple"):
        with pytest.raises(ValueError, match=rf'"{model}" needs a light'):
            shot_of(silhouette, with_scattering(draft, model))


def test_without_smoke_nothing_is_measured(plume, draft, tmp_path) -> None:
    shot = shot_of(plume.write(tmp_path, [0 * plume.densities[0]] * 3), draft)
    assert shot.scene.scattering == "single"
    assert [choice.what for choice in shot.estimates] == ["resolution", "velocity grid coarsening"]


# coarse boxes and pictures


@given(st.tuples(*[st.integers(8, 160)] * 3), st.floats(0.3, 20))
@example((8, 8, 33), 0.3)  # a side of one coarse voxel
@hypothesis_settings(deadline=None, max_examples=60, derandomize=True)
def test_a_coarse_box_stays_in_the_box(resolution, pixels) -> None:
    """A light beside the box must not come to stand in it; voxels are cubes, few, and not smaller than before."""
    x, y, z = resolution
    domain = Domain((0.0, 0.0, 0.0), (0.1 * x, 0.1 * y, 0.1 * z), resolution)
    coarse = coarse_domain(domain, pixels, COARSE_SIDE)
    assert max(coarse.resolution) <= max(COARSE_SIDE, 4)
    assert coarse.voxel_size >= domain.voxel_size * (1 - 1e-6)
    assert np.all(np.array(coarse.min) >= np.array(domain.min) - 1e-9)
    assert np.all(np.array(coarse.max) <= np.array(domain.max) + 1e-9)


def test_a_usual_box_keeps_its_corners() -> None:
    domain = Domain((-1.0, -1.0, 0.0), (1.0, 1.0, 3.0), (64, 64, 96))
    assert coarse_domain(domain, 4.0, COARSE_SIDE) == replace(domain, resolution=(16, 16, 24))


def test_the_halves_of_a_picture_are_apart(plume, tmp_path) -> None:
    """What is wrong in one pixel out of two is seen by one of them only, and both show what all show."""
    height, width = 112, 80
    rows, columns = np.indices((height, width))
    picture = np.repeat(np.where((rows + columns) % 2, 0.5, 0.2)[..., None], 3, -1).astype(np.float32)
    plate = Plate(np.zeros_like(picture), np.ones((height, width), np.float32), EIGHT_BIT_NOISE)
    scene = completed(replace(plume.scene, camera=plume.scene.camera.resized(width, height)))
    write_image(tmp_path / "frame_1.exr", picture, half=False)
    view = ShotView(
        Clip.open(tmp_path / "frame_1.exr"), scene.camera, plate, working_picture(scene.camera, scene.domain)
    )
    (seen,) = coarse_frame([view], 0, scene).views
    np.testing.assert_allclose(seen.fitted, 0.2, atol=1e-5)
    np.testing.assert_allclose(seen.held_out, 0.5, atol=1e-5)
    assert 0.3 < seen.picture.mean() < 0.4
    dimmed = seen.over(np.full(3, 2, np.float32))
    np.testing.assert_allclose(dimmed.held_out, 0.25, atol=1e-5)
    away = scene.camera.look_at((0, -4, 0.8), (0, -9, 0.8), fov_y_degrees=27, size=(width, height))
    assert coarse_frame([view, replace(view, camera=away)], 0, scene) is None


# velocity


def test_the_velocity_grid_is_as_coarse_as_the_depth_is_unknown(plume, draft) -> None:
    """However fine the densities are; by hand it is what was said, and thin boxes keep eight voxels a side."""
    shapes = [(20, 20, 30), (32, 32, 48), (64, 64, 96), (128, 128, 192), (256, 256, 288), (31, 20, 150)]
    choices = [velocity_coarsening(Domain((0.0, 0.0, 0.0), shape, shape), draft) for shape in shapes]
    assert [choice.value for choice in choices] == [0, 1, 2, 3, 4, 1]
    assert [choice.figures["voxels"] for choice in choices] == [30, 24, 24, 24, 18, 75]
    by_hand = replace(draft, velocity=replace(draft.velocity, coarsening=0))
    choice = velocity_coarsening(plume.scene.domain, by_hand)
    assert (choice.value, choice.source) == (0, "given")


# environments


def environment(folder: Path, radiance: np.ndarray, **options: int) -> EnvironmentLight:
    write_image(folder / "sky.exr", radiance, half=False)
    return EnvironmentLight(folder / "sky.exr", **options)


def test_an_environment_gets_its_directions(plume, draft, tmp_path) -> None:
    """The number is part of the scene from then on; by hand it is what is said."""
    sky = environment(tmp_path, np.full((8, 16, 3), 0.5, np.float32))
    scene = plume.write(tmp_path / "clip", plume.densities[1:3], replace(plume.scene, lights=(sky,)))
    (light,) = shot_of(scene, draft).scene.lights
    assert light == replace(sky, directions=light.directions) and light.directions >= 4
    scene = replace(plume.scene, lights=(replace(sky, directions=6),))
    scene.save(tmp_path / "scene.toml")
    assert Scene.load(tmp_path / "scene.toml") == scene
    shot = shot_of(scene, draft)
    assert shot.scene.lights == scene.lights and len(shot.optics.lights) == 6
    with pytest.raises(SceneError, match="directions must be a whole number from 1 to 4096, not 0"):
        replace(sky, directions=0)


# what is said and kept


def test_a_prepared_shots_settings_prepare_it_again(plume, draft) -> None:
    first = shot_of(plume.scene, draft)
    assert shot_of(plume.scene, first.settings).settings == first.settings


def test_a_camera_is_alone_where_no_other_sees_the_smoke_and_it_stands_still(plume, tracked, two_views, draft) -> None:
    shots = [shot_of(scene, draft) for scene in (plume.scene, two_views, tracked)]
    assert [shot.alone for shot in shots] == [True, False, False]
