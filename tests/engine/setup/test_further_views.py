"""Further views of a shot: in step with the input, before a background of their own, refused where they do not fit."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from smokelift import Clip, Settings, Shot, prepare_shot, render
from smokelift.output.images import write_image
from smokelift.scene import Background, ClipSource, Scene, View, completed, look_at_matrix, orbit
from tests.engine.setup.shots import shot_of


def test_a_further_view_is_opened_in_step(two_views, draft) -> None:
    """Its frame 0 is of the input's moment, its picture and plate are cut to the box, and a note says so."""
    shot = shot_of(two_views, draft)
    _, view = shot.views
    assert (view.clip.numbers[0], len(view.clip)) == (1, 5)
    front, seen = shot.observe(2)
    assert front.camera == shot.views[0].working.camera
    assert seen.image.shape == seen.plate.image.shape == (*seen.camera.size[::-1], 3)
    np.testing.assert_array_equal(seen.image, view.working.cut(view.clip.frame(2)))
    (remark,) = (found for found in shot.findings if found.kind == "further view")
    assert remark.figures == {
        "view": 1, "name": "frame_####.png", "degrees": pytest.approx(90), "first": 1, "last": 5,
    }  # fmt: skip
    assert shot.scene == completed(two_views)


def test_a_further_view_follows_the_clip_that_is_used(two_views, as_filmed) -> None:
    with Clip.open(two_views.clip, frames=(2, 3)) as clip:
        _, view = prepare_shot(clip, two_views.with_frames(1, 3), as_filmed).views
    assert (view.clip.numbers[0], len(view.clip)) == (3, 2)


@pytest.fixture
def as_filmed(draft) -> Settings:
    """What is wrong is no exposure."""
    return replace(draft, measure=False)


def behind(shot: Shot, view: int, frame: int = 0) -> float:
    """Mean radiance behind the smoke."""
    return float(shot.observe(frame)[view].plate.image.mean())


def test_a_further_views_background(two_views, as_filmed, tmp_path) -> None:
    """Its own, else the scene's color, else estimated from its clip; a picture of the input's is not its."""
    (view,) = two_views.views
    gray = replace(two_views, views=(replace(view, background=Background(color=(0.5, 0.5, 0.5))),))
    assert behind(shot_of(gray, as_filmed), 1) == pytest.approx(0.5, abs=1e-3)
    write_image(tmp_path / "wall.png", np.full((56, 40, 3), 0.5, np.float32))
    wall = Background(image=tmp_path / "wall.png")
    pictured = shot_of(replace(two_views, background=wall), as_filmed)
    assert behind(pictured, 0) == pytest.approx(0.5, abs=1e-2)
    assert behind(pictured, 1) < 0.2
    assert ("black background", {"view": 1}) in [(found.kind, found.figures) for found in pictured.findings]
    for n in range(6):
        write_image(tmp_path / f"wall_{n}.exr", np.full((56, 40, 3), n / 10, np.float32))
    changing = replace(view, background=Background(image=tmp_path / "wall_#.exr"))
    assert behind(shot_of(replace(two_views, views=(changing,)), as_filmed), 1, frame=2) == pytest.approx(0.3, abs=1e-3)


@pytest.mark.parametrize("wrong", ["camera", "background"])
def test_views_that_do_not_agree_are_noted(two_views, as_filmed, wrong) -> None:
    (view,) = two_views.views
    if wrong == "camera":
        lower = look_at_matrix((4, 0, 0.2), (0, 0, 0.2), (0, 0, 1))
        view = replace(view, camera=replace(view.camera, matrix=lower))
    else:
        view = replace(view, background=Background(color=(0.5, 0.5, 0.5)))
    remarks = shot_of(replace(two_views, views=(view,)), as_filmed).findings
    assert [remark.figures["agreed"] < 0.8 for remark in remarks if remark.kind == "disagreeing views"] == [True]


FROM_ASIDE = look_at_matrix((4, 0, 0.8), (0, 0, 0.8), (0, 0, 1))


@pytest.mark.parametrize(
    ("of_clip", "of_camera", "named"),
    [
        ({"frames": (4, 5)}, {}, "0 to 5, but 4 to 8"),
        ({"fps": 25.0}, {}, "25 .* 24"),
        ({"path": Path("none.mp4")}, {}, "none.mp4"),
        ({}, {"size": (56, 40)}, "56 x 40.* 40 x 56"),
        ({}, {"matrix": FROM_ASIDE, "matrices": (FROM_ASIDE,) * 5}, "matrix"),
    ],
)
def test_a_further_view_that_does_not_belong_is_refused(two_views, draft, of_clip, of_camera, named) -> None:
    (view,) = two_views.views
    view = replace(view, clip=replace(view.clip, **of_clip), camera=replace(view.camera, **of_camera))
    with pytest.raises(ValueError, match=named):
        shot_of(replace(two_views, views=(view,)), draft)
    with pytest.raises(ValueError, match="camera"):
        shot_of(replace(two_views, domain=None, camera=None), draft)


BEHIND = 0.05
FRAMES = 3


@pytest.fixture(scope="module")
def filmed(plume, tmp_path_factory):
    """Returns scenes of a front and a side before gray, whose picture is multiplied by a gain a channel."""
    side = orbit(plume.scene.camera, plume.scene.domain, 90)
    gray = replace(plume.scene, background=Background(color=(BEHIND,) * 3))
    clear = [render(density, gray, side) for density in plume.densities[1 : 1 + FRAMES]]

    def scene(gain: tuple[float, float, float]) -> Scene:
        folder = tmp_path_factory.mktemp("exposed")
        for number, picture in enumerate(clear):
            write_image(folder / f"frame_{number:04d}.png", np.asarray(gain, np.float32) * picture)
        red, green, blue = (BEHIND * each for each in gain)
        clip = ClipSource(folder / "frame_####.png", fps=24.0, frames=(0, FRAMES - 1))
        view = View(side, clip, Background(color=(red, green, blue)))
        front = replace(plume.scene.clip, frames=(1, FRAMES))
        return replace(plume.scene, clip=front, views=(view,))

    return scene


def gains(shot):
    """What was found, by view."""
    return [choice for choice in shot.findings if choice.about.startswith("gain of view")]


@pytest.mark.parametrize("gain", [(0.6, 0.6, 0.6), (1.4, 1.0, 0.8)], ids=["exposure", "white balance"])
def test_another_exposure_is_found_and_undone(filmed, draft, gain) -> None:
    shot = shot_of(filmed(gain), draft)
    (found,) = gains(shot)
    assert found.about == "gain of view 1"
    np.testing.assert_allclose(found.value, gain, rtol=0.1)
    assert found.figures["error"] < found.figures["error_as_it_is"]
    plate = shot.views[1].plate.at(0).image
    np.testing.assert_allclose(plate.mean((0, 1)), BEHIND, rtol=0.1)
    with Clip.open(filmed((1.0, 1.0, 1.0)).views[0].clip) as untouched:
        np.testing.assert_allclose(shot.views[1].clip.frame(1).max((0, 1)), untouched.frame(1).max((0, 1)), rtol=0.1)


@pytest.mark.parametrize(("gain", "lit", "found"), [(1.0, True, False), (1.28, True, True), (1.28, False, False)])
def test_a_gain_has_to_be_clear_and_more_so_in_unknown_light(filmed, draft, gain, lit, found) -> None:
    """There it may be the light's, which is taken to come from everywhere."""
    scene = filmed((gain,) * 3)
    said = gains(shot_of(scene if lit else replace(scene, lights=()), draft))
    assert [choice.value[0] for choice in said] == ([pytest.approx(gain, rel=0.06)] if found else [])
