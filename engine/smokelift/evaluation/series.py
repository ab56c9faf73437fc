"""Single figures of what was measured frame by frame; None where there is nothing to say."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np


def finite_mean(values: Iterable[float | None]) -> float | None:
    """The mean of what is known and finite (equal pictures have infinite decibels); None where nothing is."""
    finite = [value for value in values if value is not None and np.isfinite(value)]
    return float(np.mean(finite)) if finite else None
