"""What is said of a result's origin follows from what was given and chosen."""

import json
from dataclasses import replace

import numpy as np
import pytest

from smokelift.footage.clip import Clip
from smokelift.output.images import write_image
from smokelift.report.provenance import Provenance, made_up, provenance, record
from smokelift.report.sentences import sentence
from smokelift.scene import orbit
from smokelift.setup.settings import Settings
from smokelift.setup.shot import Shot
from tests.engine.setup.shots import shot_of


@pytest.fixture(scope="module")
def shot(plume, draft) -> Shot:
    """One camera, everything known."""
    return shot_of(plume.scene, draft)


def parts(shot: Shot) -> dict[str, Provenance]:
    """By what they are of."""
    return {part.what: part for part in provenance(shot)}


def test_only_what_the_pictures_show_is_measured(shot) -> None:
    """The rays' optical depths are, the distribution along them is not, and the velocity follows from both."""
    assert [(part.what, part.origin) for part in provenance(shot)] == [
        ("optical depth of every ray", "measured"),
        ("velocity", "estimated"),
        ("distribution along the rays", "assumed"),
        ("fine structure along the rays", "made up"),
    ]


def test_made_up_detail_names_its_settings(shot) -> None:
    other = replace(shot, settings=replace(shot.settings, detail=0.5, seed=3))
    assert parts(other)["fine structure along the rays"].settings == {"detail": 0.5, "seed": 3}
    assert made_up(other) == (parts(other)["fine structure along the rays"].how,)


def test_damaged_frames_have_one_number_wherever_they_are_named(shot, tmp_path) -> None:
    """That of the clip's file from 0, as the range of its frames has it."""
    for n in range(7):
        write_image(tmp_path / f"frame_{n}.png", np.full((4, 4, 3), 0.5))
    (tmp_path / "frame_3.png").write_bytes(b"nothing")
    (tmp_path / "frame_5.png").unlink()
    with Clip.open(tmp_path / "frame_#.png", fps=24, frames=(1, 6)) as clip:
        other = replace(shot, views=(replace(shot.views[0], clip=clip),))
        said = [remark for remark in clip.remarks() if remark.kind == "damaged frames"]
        said.append(parts(other)["some pictures"].how)
        assert [remark.figures["frames"] for remark in said] == ["frames 3 and 5 are"] * 2


@pytest.mark.parametrize("settings", [replace(Settings.preset(), detail=0.0), Settings.preset(method="paper")])
def test_without_detail_nothing_is_made_up(shot, settings) -> None:
    smooth = replace(shot, settings=replace(settings, seed=3))
    assert "made up" not in {part.origin for part in provenance(smooth)}
    assert made_up(smooth) == ()


def test_nothing_is_made_up_where_cameras_stand_all_around(shot) -> None:
    front = shot.views[0]
    near = front.working.camera
    around = [
        replace(front, working=replace(front.working, camera=orbit(near, shot.optics.domain, degrees)))
        for degrees in range(0, 180, 20)
    ]
    assert shot.settings.detail == 1
    assert made_up(replace(shot, views=tuple(around))) == ()
    assert len(made_up(replace(shot, views=tuple(around[:4])))) == 1


def test_what_is_assumed_depends_on_cameras_and_method(shot) -> None:
    def assumed(shot: Shot) -> str:
        return parts(shot)["distribution along the rays"].how.kind

    assert assumed(shot) == "depth by the smoke's width in one view"
    paper = replace(shot, settings=Settings.preset(method="paper"))
    assert assumed(paper) == "depth by the view from the side in one view"
    two = replace(shot, views=shot.views * 2)
    assert assumed(two) == "depth by the smoke's width in several views"
    assert parts(two)["optical depth of every ray"].how.figures == {"cameras": 2}


def test_json_holds_it(shot) -> None:
    plain = [part.as_dict() for part in provenance(shot)]
    assert json.loads(json.dumps(plain, allow_nan=False)) == plain
    assert [part["how"] for part in plain] == [sentence(part.how) for part in provenance(shot)]
    plain = [record(estimate) for estimate in shot.estimates]
    assert json.loads(json.dumps(plain, allow_nan=False)) == plain
    for each in plain:
        assert set(each) == {"what", "chosen", "kind", "reason", "measured", "tolerance", "by_hand"}
        assert each["by_hand"] or each["measured"]
