"""Further views of a shot: in step with the input, before a background of their own, refused where they do not fit."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from smokelift.checks import Remark
from smokelift.footage.clip import Clip
from smokelift.output.images import write_image
from smokelift.scene import Background, ClipSource, Scene, completed, look_at_matrix
from smokelift.setup.prepare import prepare_shot
from smokelift.setup.shot import Shot
from tests.engine.setup.shots import shot_of


def test_a_further_view_is_opened_in_step(two_views, draft) -> None:
    """Its frame 0 is of the input's moment, its picture and plate are cut to the box, and a note says so."""
    shot = shot_of(two_views, draft)
    _, view = shot.views
    assert (view.clip.first, len(view.clip)) == (1, 5)
    front, seen = shot.observe(2)
    assert front.camera == shot.views[0].working.camera
    assert seen.image.shape == seen.plate.image.shape == (*seen.camera.size[::-1], 3)
    np.testing.assert_array_equal(seen.image, view.working.cut(view.clip.frame(2)))
    (remark,) = shot.remarks
    assert remark.kind == "further view"
    assert remark.figures == {
        "view": 1, "name": "frame_####.png", "degrees": pytest.approx(90), "first": 1, "last": 5,
    }  # fmt: skip
    assert shot.scene == completed(two_views)


@pytest.mark.parametrize(("asked", "first"), [((0, 4), 1), ((2, 3), 3)])
def test_a_further_view_follows_the_clip_that_is_used(two_views, draft, asked, first) -> None:
    for scene in (two_views, two_views.with_frames(1, 3)):
        with Clip.open(two_views.clip, frames=asked) as clip:
            _, view = prepare_shot(clip, scene, draft).views
        assert (view.clip.first, len(view.clip)) == (first, asked[1] - asked[0] + 1)


def behind(shot: Shot, view: int, frame: int = 0) -> float:
    """Mean radiance behind the smoke."""
    return float(shot.observe(frame)[view].plate.image.mean())


def test_a_further_views_background(two_views, draft, tmp_path) -> None:
    """Its own, else the scene's colour, else estimated from its clip; a picture of the input's is not its."""
    (view,) = two_views.views
    as_filmed = replace(draft, selection=replace(draft.selection, measure=False))  # what is wrong is no exposure
    grey = replace(two_views, views=(replace(view, background=Background(color=(0.5, 0.5, 0.5))),))
    assert behind(shot_of(grey, as_filmed), 1) == pytest.approx(0.5, abs=1e-3)
    write_image(tmp_path / "wall.png", np.full((56, 40, 3), 0.5, np.float32))
    wall = Background(image=tmp_path / "wall.png")
    pictured = shot_of(replace(two_views, background=wall), as_filmed)
    assert behind(pictured, 0) == pytest.approx(0.5, abs=1e-2)
    assert behind(pictured, 1) < 0.2
    assert Remark("black background", {"view": 1}) in pictured.remarks
    for n in range(6):
        write_image(tmp_path / f"wall_{n}.exr", np.full((56, 40, 3), n / 10, np.float32))
    changing = replace(view, background=Background(image=tmp_path / "wall_#.exr"))
    assert behind(shot_of(replace(two_views, views=(changing,)), as_filmed), 1, frame=2) == pytest.approx(0.3, abs=1e-3)


@pytest.mark.parametrize("wrong", ["camera", "background"])
def test_views_that_do_not_agree_are_noted(two_views, draft, wrong) -> None:
    (view,) = two_views.views
    if wrong == "camera":
        lower = look_at_matrix((4, 0, 0.2), (0, 0, 0.2), (0, 0, 1))
        view = replace(view, camera=replace(view.camera, matrix=lower))
    else:
        view = replace(view, background=Background(color=(0.5, 0.5, 0.5)))
    remarks = shot_of(replace(two_views, views=(view,)), draft).remarks
    assert [remark.figures["agreed"] < 0.8 for remark in remarks if remark.kind == "disagreeing views"] == [True]


def spoilt(scene: Scene, what: str, folder: Path) -> Scene:
    """A scene whose further view is wrong in one way."""
    (view,) = scene.views
    camera, clip = view.camera, view.clip
    match what:
        case "short":
            return replace(scene, views=(replace(view, clip=replace(clip, frames=(4, 5))),))
        case "rate":
            return replace(scene, views=(replace(view, clip=replace(clip, fps=25.0)),))
        case "shape":
            return replace(scene, views=(replace(view, camera=replace(camera, size=(56, 40))),))
        case "moving":
            return replace(scene, views=(replace(view, camera=replace(camera, matrices=(camera.matrix,) * 5)),))
        case "missing":
            return replace(scene, views=(replace(view, clip=ClipSource(folder / "none.mp4")),))
        case "box":
            return replace(scene, domain=None, camera=None)
    raise AssertionError(what)


@pytest.mark.parametrize(
    ("what", "sentence"),
    [
        ("short", r"has frames 0 to 5, but 4 to 8 are those of the input's moments; use fewer frames"),
        ("rate", r"has 25 frames a second, the input 24; all views need the same"),
        ("shape", r"56 x 40, the clip's 40 x 56 \(frame_####.png\)"),
        ("moving", r"no camera may move"),
        ("missing", r"none.mp4: no such file"),
        ("box", "need the input's camera and the box"),
    ],
)
def test_a_further_view_that_does_not_belong_is_refused(two_views, draft, tmp_path, what, sentence) -> None:
    with pytest.raises(ValueError, match=sentence):
        shot_of(spoilt(two_views, what, tmp_path), draft)
