"""Where the smoke stands in depth, and how well that is known."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from smokelift.density.axis import AxisEstimate, Cue, SmokeAxis
from smokelift.scene import Inlet, as_matrix
from smokelift.setup.place import place_estimate
from smokelift.setup.settings import Settings
from tests.engine.setup.shots import shot_of


@pytest.mark.parametrize(
    ("cue", "depth", "kind"),
    [
        ("box", 0.0, "axis depth by box"),
        ("floor contact", -0.25, "axis depth by floor contact"),
        ("inlets", 0.1, "axis depth by inlets"),
    ],
)
def test_the_cue_and_the_uncertainty_are_kept(cue: Cue, depth: float, kind: str) -> None:
    estimate = place_estimate(AxisEstimate(SmokeAxis.upright(depth), cue, depth, 0.123))
    assert (estimate.kind, estimate.figures, estimate.spread) == (kind, {"depth": depth}, 0.123)
    assert (estimate.value == "undetermined") == (estimate.source == "assumed") == (cue == "box")


def test_a_shot_knows_where_its_smoke_stands(plume, draft: Settings) -> None:
    """Unless the user says it, or the method does not ask."""
    blind = replace(plume.scene, inlets=())
    found = shot_of(blind, draft)
    assert found.place is not None and found.estimates[-1] == place_estimate(found.place)
    marked = shot_of(replace(blind, inlets=(Inlet(plume.scene.domain.centre, 0.2),)), draft)
    assert marked.place is not None and marked.place.cue == "inlets"
    for settings in (replace(draft, axis_depth=0.1), Settings.preset(draft.quality, method="paper")):
        known = shot_of(blind, settings)
        assert known.place is None
        assert "axis depth" not in [choice.what for choice in known.estimates]


def test_a_camera_that_only_turns_tells_the_place_as_one_that_stands(plume, draft: Settings) -> None:
    """What travels does not: it sees the smoke from elsewhere."""
    blind = replace(plume.scene, inlets=())
    count = len(plume.densities)
    still = shot_of(blind, draft).place
    assert still is not None
    turning = replace(blind.camera, matrices=(blind.camera.matrix,) * count)
    found = shot_of(replace(blind, camera=turning), draft).place
    assert found is not None
    assert found.cue == still.cue
    assert found.depth == pytest.approx(still.depth, abs=0.1 * still.deviation)
    matrices = np.repeat(np.array(blind.camera.matrix)[None], count, axis=0)
    matrices[:, 0, 3] += np.linspace(0, 0.1, count)
    travelling = replace(blind.camera, matrix=as_matrix(matrices[0]), matrices=tuple(map(as_matrix, matrices)))
    assert shot_of(replace(blind, camera=travelling), draft).place is None
