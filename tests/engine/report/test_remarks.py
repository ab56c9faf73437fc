"""What is said of a shot's box, and against a finished run."""

from dataclasses import replace
from types import SimpleNamespace

import pytest

from smokelift.checks import Doubt, Remark
from smokelift.report.facts import boundaries
from smokelift.report.shortcomings import foreseen, shortcomings
from smokelift.scene import Inlet, completed
from smokelift.setup.estimate import Estimate


def test_how_smoke_gets_in_and_out_is_said(plume, draft) -> None:
    assert boundaries(completed(plume.scene)) == (Remark("no inlets"), Remark("open box"))
    marked = replace(plume.scene, inlets=(Inlet((0.01, 0.02, 0.21), 0.01),), closed=("x+", "z-"))
    assert boundaries(completed(marked)) == (
        Remark("inlets", {"inlets": 1, "voxels": 1}),
        Remark("closed sides", {"sides": "x+, z-"}),
    )


@pytest.mark.parametrize(
    ("left", "kinds"), [(0.2, []), (0.4, ["not all is smoke"]), (0.8, ["hardly any smoke fitted"])]
)
def test_a_fit_that_explains_little_is_said(left: float, kinds: list[str]) -> None:
    errors = ({"relative_error": left}, {"relative_error": left}, {"relative_error": 0.9}, {})
    said = shortcomings([{"hull_share": 0.1, **figures} for figures in errors])
    assert said == [Doubt(kind, {"error": left}) for kind in kinds]


@pytest.mark.parametrize(("left", "said"), [(0.2, False), (0.3, True)])
def test_what_may_be_no_smoke_is_foreseen(left: float, said: bool) -> None:
    """By what the set-up's fit leaves, unless it made none, fire shines or the light is at fault."""
    estimate = Estimate("compared scattering", {"error": left}, what="scattering", value="single", source="measured")
    shot = SimpleNamespace(fire=None, remarks=(Remark("open box"),), estimates=(estimate,))
    assert foreseen(shot) == ([Doubt("not all may be smoke", {"error": left})] if said else [])
    for other in ({"fire": object()}, {"estimates": ()}, {"remarks": (Doubt("likely wrong light", {"error": left}),)}):
        assert foreseen(SimpleNamespace(**{**vars(shot), **other})) == []


def test_what_a_fire_leaves_is_said_to_be_fires() -> None:
    """A bonfire lights its smoke: neither the light of the clip nor its background is what lacks."""
    for left in (0.4, 0.8):
        (said,) = shortcomings([{"hull_share": 0.1, "relative_error": left}], burns=True)
        assert said == Doubt("fire beside what is fitted", {"error": left})
    assert not shortcomings([{"hull_share": 0.1, "relative_error": 0.2}], burns=True)


def test_empty_frames_are_counted() -> None:
    said = shortcomings([{"hull_share": 0.0}, {"hull_share": None}, {}, {"hull_share": 0.2}])
    assert said == [Doubt("empty frames", {"empty": 3, "frames": 4})]
