"""What is said of a shot's box."""

from __future__ import annotations

from dataclasses import replace

from smokelift.checks import Remark
from smokelift.report.facts import boundaries
from smokelift.scene import Inlet
from smokelift.scene.complete import completed
from smokelift.setup.settings import Settings


def test_how_smoke_gets_in_and_out_is_said(plume, draft) -> None:
    """Marked or found, open or closed."""
    assert boundaries(completed(plume.scene), draft) == (Remark("inlets found later"), Remark("open box"))
    marked = replace(plume.scene, inlets=(Inlet((0.01, 0.02, 0.21), 0.01),), closed=("x+", "z-"))
    assert boundaries(completed(marked), draft) == (
        Remark("inlets", {"inlets": 1, "voxels": 1}),
        Remark("closed sides", {"sides": "x+, z-"}),
    )
    assert boundaries(completed(plume.scene), Settings.preset(method="paper"))[0] == Remark("no inlets")
