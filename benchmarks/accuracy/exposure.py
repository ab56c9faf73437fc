"""One gain a camera: how far pictures differ when the cameras' unknown exposures do not count."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from scipy.optimize import minimize_scalar

from smokelift.evaluation.frame_means import eight_bit_values
from smokelift.render import Image

LARGEST_GAIN = 4.0
"""Gains are searched for between this and its inverse."""


def best_gain(shown: Sequence[Image], seen: Sequence[Image]) -> float:
    """Return the factor to the radiance shown in all frames that comes nearest to what was seen, in 8-bit sRGB values.

    Parameters
    ----------
    shown, seen : sequence of (rows, columns, 3)
        Linear radiance of the same frames; 1 is returned if nothing is shown.
    """
    lit = [picture > 0 for picture in shown]  # a gain changes nothing else
    ours = np.concatenate([picture[where] for picture, where in zip(shown, lit, strict=True)])
    true = eight_bit_values(np.concatenate([picture[where] for picture, where in zip(seen, lit, strict=True)]))
    if not ours.size:
        return 1.0

    def misfit(stops: float) -> float:
        return float(np.mean((eight_bit_values(2**stops * ours) - true) ** 2))

    most = np.log2(LARGEST_GAIN)
    found = minimize_scalar(misfit, bounds=(-most, most), method="bounded", options={"xatol": 0.005})
    return float(2**found.x)
