"""What the figures of a finished run say against its result."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from smokelift.checks import Doubt

UNEXPLAINED_SHARE = 0.7
"""Root mean square of what a fit leaves, as a share of what the smoke changes: half of the change's energy."""

DOUBTFUL_SHARE = 0.3
"""Share left above which some of the change may be no smoke. Good results leave less; those that take labels, leaves, a
head or the light for smoke leave more (docs/clips.md)."""


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
