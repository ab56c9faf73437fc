"""What is said of a result: where its parts come from, and which figures say that it may be wrong."""

from collections.abc import Mapping, Sequence
from functools import partial
from typing import Any

import numpy as np

from smokelift.checks import Finding
from smokelift.density.synthesis import unseen_sides
from smokelift.density.turntable import Turntable
from smokelift.setup.shot import Shot

MAX_FITTED_ERROR = 0.7
"""Root mean square of what a fit leaves, as a fraction of what the smoke changes: half of the change's energy."""

MAX_SMOKE_ERROR = 0.3
"""Fraction left above which some of the change may be no smoke. Good results leave less; those that take labels,
leaves, a head or the light for smoke leave more (docs/clips.md)."""

MAX_COARSE_ERROR = 0.25
"""Fraction that a coarse fit leaves of the pixels that it leaves out, above which a run is likely to leave more than
`MAX_SMOKE_ERROR` (measured: the example as it is, with leaves and with light that flickers leaves .04 to .07, a run .05
to .12; with a person in it .12, .16, .29 and .35, a run .14, .23, .37 and .39; with labels .10, a run .27)."""


def provenance(shot: Shot) -> list[Finding]:
    """Return where the parts of a shot's result come from, the best known first."""
    settings, cameras = shot.settings, {"cameras": len(shot.views)}
    taken = "thin fog" if len(shot.views) > 1 else "the view from the side"
    if settings.method != "paper":
        taken = "the smoke's width"
    depth = f"depth by {taken} in {'several views' if len(shot.views) > 1 else 'one view'}"
    parts = [
        *(found for found in shot.clip.findings() if found.about),
        Finding("pictures that are fitted", cameras, about="optical depth of every ray", source="measured"),
        Finding("velocity between frames", about="velocity", source="estimated"),
        Finding(depth, cameras, about="distribution along the rays", source="assumed"),
    ]
    if shot.fire is not None:
        parts.append(Finding("emission along the rays", about="emission of fire", source="assumed"))
    return [*parts, *made_up(shot)]


def made_up(shot: Shot) -> list[Finding]:
    """Return what a run will make up, with the settings that choose it: if there is a side without a camera near it."""
    settings, cameras = shot.settings, [view.working.camera for view in shot.views]
    if settings.detail == 0 or not unseen_sides(Turntable.facing(cameras[0], shot.optics.domain), cameras):
        return []
    chosen = {"detail": settings.detail, "seed": settings.seed}
    return [Finding("texture of the clip", chosen, about="fine structure along the rays", source="made up")]


def expected_shortcomings(shot: Shot) -> list[Finding]:
    """Return the doubts about a run that the set-up of its shot gives reason for."""
    if shot.fire is not None or any(found.kind == "likely wrong light" for found in shot.findings):
        return []
    figures = next((found.figures for found in shot.findings if found.about == "scattering"), {})
    error = figures.get("error", 0.0)
    assert isinstance(error, float)
    return [Finding("not all may be smoke", {"error": error}, doubt=True)] if error > MAX_COARSE_ERROR else []


def count_empty(figures: Sequence[Mapping[str, Any]]) -> int:
    """Return how many frames show no smoke."""
    return sum(not (of_frame.get("hull_share") or 0) > 0 for of_frame in figures)


def shortcomings(figures: Sequence[Mapping[str, Any]], *, burns: bool = False) -> list[Finding]:
    """Return doubts about a finished run by its frames' figures; ``burns`` if there is fire."""
    doubt, doubts = partial(Finding, doubt=True), []
    empty = count_empty(figures)
    if empty:
        doubts.append(doubt("empty frames", {"empty": empty, "frames": len(figures)}))
    errors = [of_frame["relative_error"] for of_frame in figures if of_frame.get("relative_error") is not None]
    typical = float(np.median(errors)) if errors else 0.0
    if burns and typical > MAX_SMOKE_ERROR:
        doubts.append(doubt("fire beside what is fitted", {"error": typical}))
    elif typical > MAX_FITTED_ERROR:
        doubts.append(doubt("hardly any smoke fitted", {"error": typical}))
    elif typical > MAX_SMOKE_ERROR:
        doubts.append(doubt("not all is smoke", {"error": typical}))
    return doubts
