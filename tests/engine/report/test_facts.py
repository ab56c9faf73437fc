"""What is known of a shot: what is given, found and assumed, and what a sidebar has room for."""

from dataclasses import replace

from smokelift.checks import Finding
from smokelift.report.cost import Cost
from smokelift.report.facts import boundaries, facts
from smokelift.report.sentences import fact
from smokelift.scene import Inlet, Scene, completed
from smokelift.setup.settings import Settings
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
