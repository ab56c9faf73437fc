"""What the figures of a finished run say against its result."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

UNEXPLAINED_SHARE = 0.7
"""Root mean square of what a fit leaves, as a share of what the smoke changes: at 0.7 half of the change's energy."""

DOUBTFUL_SHARE = 0.3
"""Share left from which not all of the change may be smoke: good results leave less, those in which labels, leaves, a
head or the light are taken for smoke more (docs/clips.md)."""


def count_empty(figures: Sequence[Mapping[str, Any]]) -> int:
    """Return how many frames show no smoke."""
    return sum(not (of_frame.get("hull_share") or 0) > 0 for of_frame in figures)


def shortcomings(figures: Sequence[Mapping[str, Any]]) -> list[str]:
    """Return what the figures of the frames of a finished run say against it, a sentence each."""
    said = []
    empty = count_empty(figures)
    if empty:
        said.append(f"No smoke is seen in {empty} of {len(figures)} frames; such frames are empty.")
    errors = [of_frame["relative_error"] for of_frame in figures if of_frame.get("relative_error") is not None]
    typical = float(np.median(errors)) if errors else 0.0
    if typical > UNEXPLAINED_SHARE:
        said.append(
            f"Hardly any smoke was fitted: a typical frame still differs from the clip by {typical:.0%} of what its "
            "smoke changes there, and its psnr is as high as it is because the smoke is faint. Give the "
            "background, the light or the medium of the clip in a scene file; `smokelift inspect` says "
            "what was taken."
        )
    elif typical > DOUBTFUL_SHARE:
        said.append(
            "Not all that was taken for smoke may be smoke: a typical frame still differs from the clip by "
            f"{typical:.0%} of what changes in it. What moves, light that changes and labels look like smoke, too; "
            "`smokelift inspect` shows what was taken. Hide what is no smoke by a mask in [clip], crop the clip, cut "
            "its frames out of a longer file in which the light changes, or give a clean plate in [background]."
        )
    return said
