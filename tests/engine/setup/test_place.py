"""Where the smoke stands in depth, and how well that is known."""

from dataclasses import replace

import numpy as np
import pytest

from smokelift.density.axis import AxisEstimate, Cue, SmokeAxis
from smokelift.density.screen import view_frame
from smokelift.scene import Inlet, as_matrix
from smokelift.setup.prepare import place_estimate
from smokelift.setup.settings import Settings
from tests.engine.setup.shots import shot_of


@pytest.mark.parametrize(
    ("cue", "depth", "kind"),
    [
        ("box", 0.0, "axis depth by box"),
        ("floor contact", -0.25, "axis depth by floor contact"),
        ("inlets", 0.1, "axis depth by inlets"),
        ("distance", 0.1, "axis depth by distance"),
    ],
)
def test_the_cue_and_the_uncertainty_are_kept(cue: Cue, depth: float, kind: str) -> None:
    estimate = place_estimate(AxisEstimate(SmokeAxis.upright(depth), cue, depth, 0.123))
    assert (estimate.kind, estimate.figures, estimate.spread) == (kind, {"depth": depth}, 0.123)
    assert (estimate.value == "undetermined") == (estimate.source == "assumed") == (cue == "box")
    assert (estimate.source == "given") == (cue == "distance")


def test_a_shot_knows_where_its_smoke_stands(plume, draft: Settings) -> None:
    blind = replace(plume.scene, inlets=())
    found = shot_of(blind, draft)
    assert found.place is not None and found.estimates[-1] == place_estimate(found.place)
    marked = shot_of(replace(blind, inlets=(Inlet(plume.scene.domain.centre, 0.2),)), draft)
    assert marked.place is not None and marked.place.cue == "inlets"
    along = view_frame(blind.camera)[1]
    middle = (np.array(blind.domain.centre) - blind.camera.position) @ along
    given = replace(draft, distance=float(middle) + 0.1)
    known = shot_of(blind, given)
    assert known.place is not None and known.place.cue == "distance"
    assert known.place.depth == pytest.approx(0.1, abs=0.05)
    assert known.estimates[-1].source == "given"
    blank = shot_of(blind, Settings.preset(draft.quality, method="paper"))
    assert blank.place is None
    assert "axis depth" not in [choice.what for choice in blank.estimates]
    with pytest.raises(ValueError, match="The inlets say where the smoke stands; leave the distance out"):
        shot_of(replace(blind, inlets=(Inlet(plume.scene.domain.centre, 0.2),)), given)


def test_a_distance_sets_the_scale_where_no_box_is_given(plume, draft: Settings) -> None:
    """Of a camera that is not given, and of a box that is not; the smoke stands in the middle of that."""
    for camera in (None, plume.scene.camera):
        near, far = (
            shot_of(replace(plume.scene, inlets=(), camera=camera, domain=None), replace(draft, distance=distance))
            for distance in (3.0, 6.0)
        )
        for shot, distance in ((near, 3.0), (far, 6.0)):
            ahead = (np.array(shot.scene.domain.centre) - shot.scene.camera.position) @ view_frame(shot.scene.camera)[1]
            assert ahead == pytest.approx(distance, rel=1e-3)
            assert shot.place is not None and shot.place.depth == pytest.approx(0, abs=0.02 * distance)
        sizes = [np.subtract(shot.scene.domain.max, shot.scene.domain.min) for shot in (near, far)]
        np.testing.assert_allclose(sizes[1], 2 * sizes[0], rtol=0.05)


def test_a_camera_that_only_turns_tells_the_place_as_one_that_stands(plume, draft: Settings) -> None:
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
    middle = (np.array(blind.domain.centre) - blind.camera.position) @ view_frame(blind.camera)[1]
    given = shot_of(replace(blind, camera=travelling), replace(draft, distance=float(middle) + 0.1)).place
    assert given is not None and given.depth == pytest.approx(0.1)
