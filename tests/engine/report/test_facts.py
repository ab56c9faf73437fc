"""What is known of a shot: what is given, found, assumed or made up, and what figures say against its result."""

import json
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from smokelift import Clip, Settings, Shot
from smokelift.checks import Finding
from smokelift.output.images import write_image
from smokelift.report.cost import Cost
from smokelift.report.facts import boundaries, expected_shortcomings, facts, made_up, provenance, shortcomings
from smokelift.report.sentences import choices, fact, part, sentence
from smokelift.scene import Inlet, Scene, completed, orbit
from tests.engine.setup.shots import shot_of

COST = Cost(seconds=12.0, memory=2**30, memory_free=2**33, disk=3 * 10**6)


def known(scene: Scene, settings: Settings) -> dict[str, dict[str, str]]:
    """The lines of a scene's table by what they are about."""
    lines = [fact(line) for line in facts(shot_of(scene, settings), scene, COST)]
    assert len({line["what"] for line in lines}) == len(lines)
    return {line["what"]: line for line in lines}


def test_what_is_given_is_said_to_be_given(plume, draft) -> None:
    medium = replace(plume.scene.medium, extinction=20.0, color=(1.0, 0.5, 0.25))
    lines = known(replace(plume.scene, medium=medium), draft)
    for what in ("background", "camera", "scale", "box", "resolution", "extinction", "albedo", "smoke color", "light"):
        assert (lines[what]["origin"], lines[what]["how"]) == ("given", ""), what
    assert lines["extinction"]["value"] == "20 1/m at density 1"
    assert lines["smoke color"]["short"] == "1.00, 0.50, 0.25"
    assert lines["scale"]["value"] == f"box of {lines['scale']['short']}"


def test_what_nothing_decides_is_called_undetermined_and_has_a_sentence(plume, draft) -> None:
    lines = known(Scene(clip=plume.scene.clip), draft)
    for what in ("camera", "scale", "extinction", "albedo", "source radiance", "sun's direction", "axis depth"):
        assert lines[what]["origin"] == "undetermined" and lines[what]["how"], what
    assert (lines["background"]["short"], lines["background"]["origin"]) == ("black", "estimated")
    assert lines["sun's direction"]["short"] == "no sun"
    assert lines["axis depth"]["value"].startswith(f"{lines['axis depth']['short']} of the box, give or take ")
    assert lines["cost"]["value"] == "about 12 s, 1.0 GiB of memory, up to 3 MB on disk"


def test_how_smoke_gets_in_and_out_is_said(plume, draft) -> None:
    assert boundaries(completed(plume.scene)) == [Finding("no inlets"), Finding("open box")]
    marked = replace(plume.scene, inlets=(Inlet((0.01, 0.02, 0.21), 0.01),), closed=("x+", "z-"))
    assert boundaries(completed(marked)) == [
        Finding("inlets", {"inlets": 1, "voxels": 1}),
        Finding("closed sides", {"sides": "x+, z-"}),
    ]


@pytest.fixture(scope="module")
def shot(plume, draft) -> Shot:
    """One camera, everything known."""
    return shot_of(plume.scene, draft)


def parts(shot: Shot) -> dict[str, Finding]:
    """By what they are of."""
    return {found.about: found for found in provenance(shot)}


def test_only_what_the_pictures_show_is_measured(shot) -> None:
    assert [(found.about, found.source) for found in provenance(shot)] == [
        ("optical depth of every ray", "measured"),
        ("velocity", "estimated"),
        ("distribution along the rays", "assumed"),
        ("fine structure along the rays", "made up"),
    ]
    plain = [part(found) for found in provenance(shot)]
    assert json.loads(json.dumps(plain, allow_nan=False)) == plain
    assert [each["how"] for each in plain] == [sentence(found) for found in provenance(shot)]
    assert [each["kind"] for each in plain] == [found.kind for found in provenance(shot)]
    assert [bool(each["settings"]) for each in plain] == [False, False, False, True]
    plain = choices(shot.findings)
    assert json.loads(json.dumps(plain, allow_nan=False)) == plain
    assert all(each["by_hand"] or each["measured"] for each in plain)


def test_damaged_frames_have_one_number_wherever_they_are_named(shot, tmp_path) -> None:
    """That of the clip's file from 0, as the range of its frames has it."""
    for n in (0, 1, 2, 4, 6):
        write_image(tmp_path / f"frame_{n}.png", np.full((4, 4, 3), 0.5))
    (tmp_path / "frame_3.png").write_bytes(b"nothing")
    with Clip.open(tmp_path / "frame_#.png", fps=24, frames=(1, 6)) as clip:
        (said,) = [found for found in clip.findings() if found.kind == "damaged frames"]
        assert said.figures["frames"] == "frames 3 and 5 are"
        assert said in provenance(replace(shot, views=(replace(shot.views[0], clip=clip),)))


def test_made_up_detail_names_its_settings(shot) -> None:
    other = replace(shot, settings=replace(shot.settings, detail=0.5, seed=3))
    assert part(parts(other)["fine structure along the rays"])["settings"] == {"detail": 0.5, "seed": 3}
    assert made_up(other) == [parts(other)["fine structure along the rays"]]
    for settings in (replace(Settings.preset(), detail=0.0), Settings.preset(method="paper")):
        assert made_up(replace(shot, settings=settings)) == []


def test_nothing_is_made_up_where_cameras_stand_all_around(shot) -> None:
    front, domain = shot.views[0], shot.optics.domain
    around = [
        replace(front, working=replace(front.working, camera=orbit(front.working.camera, domain, degrees)))
        for degrees in range(0, 180, 20)
    ]
    assert made_up(replace(shot, views=tuple(around))) == []
    assert len(made_up(replace(shot, views=tuple(around[:4])))) == 1


def test_what_is_assumed_depends_on_cameras_and_method(shot) -> None:
    paper, two = replace(shot, settings=Settings.preset(method="paper")), replace(shot, views=shot.views * 2)
    assert [parts(each)["distribution along the rays"].kind for each in (shot, paper, two)] == [
        "depth by the smoke's width in one view",
        "depth by the view from the side in one view",
        "depth by the smoke's width in several views",
    ]
    assert parts(two)["optical depth of every ray"].figures == {"cameras": 2}


@pytest.mark.parametrize(
    ("left", "kind"), [(0.2, None), (0.3, None), (0.4, "not all is smoke"), (0.8, "hardly any smoke fitted")]
)
def test_a_fit_that_explains_little_is_said(left, kind) -> None:
    errors = ({"relative_error": left}, {"relative_error": left}, {"relative_error": 0.9}, {})
    figures = [{"hull_share": 0.1, **figures} for figures in errors]
    assert shortcomings(figures) == ([Finding(kind, {"error": left}, doubt=True)] if kind else [])
    assert [found.kind for found in shortcomings([*figures, {}], burns=True)] == (
        ["empty frames", "fire beside what is fitted"] if kind else ["empty frames"]
    )


@pytest.mark.parametrize(("left", "said"), [(0.2, False), (0.3, True)])
def test_what_may_be_no_smoke_is_foreseen(left, said) -> None:
    found = Finding("compared scattering", {"error": left}, about="scattering", value="single", source="measured")
    shot = SimpleNamespace(fire=None, findings=(Finding("open box"), found))
    assert expected_shortcomings(shot) == (
        [Finding("not all may be smoke", {"error": left}, doubt=True)] if said else []
    )
    wrong = Finding("likely wrong light", {"error": left}, doubt=True)
    for other in ({"fire": object()}, {"findings": ()}, {"findings": (found, wrong)}):
        assert expected_shortcomings(SimpleNamespace(**{**vars(shot), **other})) == []
