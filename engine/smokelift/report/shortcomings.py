"""What figures say against a result: those of a finished run, and before one those of its set-up."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from smokelift.checks import Doubt
from smokelift.setup.shot import Shot

UNEXPLAINED_SHARE = 0.7
"""Root mean square of what a fit leaves, as a share of what the smoke changes: half of the change's energy."""

DOUBTFUL_SHARE = 0.3
"""Share left above which some of the change may be no smoke. Good results leave less; those that take labels, leaves, a
head or the light for smoke leave more (docs/clips.md)."""

FORESEEN_SHARE = 0.25
"""Share that a coarse fit leaves of the pixels that it leaves out, above which a run is likely to leave more than
`DOUBTFUL_SHARE`. The example as it is, with leaves and with light that flickers leaves .04 to .07 (a run .05 to .12),
with a person in it .12, .16, .29 and .35 (.14, .23, .37 and .39), with labels .10 (.27)."""


def foreseen(shot: Shot) -> list[Doubt]:
    """Return the doubts about a run that the set-up of its shot gives reason for."""
    if shot.fire is not None or any(remark.kind == "likely wrong light" for remark in shot.remarks):
        return []
    figures = next((estimate.figures for estimate in shot.estimates if estimate.what == "scattering"), {})
    error = figures.get("error", 0.0)
    assert isinstance(error, float)
    return [Doubt("not all may be smoke", {"error": error})] if error > FORESEEN_SHARE else []


def count_empty(figures: Sequence[Mapping[str, Any]]) -> int:
    """Return how many frames show no smoke."""
    return sum(not (of_frame.get("hull_share") or 0) > 0 for of_frame in figures)


def shortcomings(figures: Sequence[Mapping[str, Any]], *, burns: bool = False) -> list[Doubt]:
    """Return doubts about a finished run by its frames' figures; ``burns`` if there is fire."""
    doubts = []
    empty = count_empty(figures)
    if empty:
        doubts.append(Doubt("empty frames", {"empty": empty, "frames": len(figures)}))
    errors = [of_frame["relative_error"] for of_frame in figures if of_frame.get("relative_error") is not None]
    typical = float(np.median(errors)) if errors else 0.0
    if burns and typical > DOUBTFUL_SHARE:
        doubts.append(Doubt("fire beside what is fitted", {"error": typical}))
    elif typical > UNEXPLAINED_SHARE:
        doubts.append(Doubt("hardly any smoke fitted", {"error": typical}))
    elif typical > DOUBTFUL_SHARE:
        doubts.append(Doubt("not all is smoke", {"error": typical}))
    return doubts
