"""The error that the benchmarks report: a relative L2 distance."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt


def relative_error(
    found: npt.NDArray[np.floating[Any]],
    truth: npt.NDArray[np.floating[Any]],
    where: npt.NDArray[np.bool_] | slice = np.s_[:],
) -> float:
    """Return |found - truth| / |truth| over some of the pixels or voxels, by default over all.

    Parameters
    ----------
    found, truth
        Two arrays of one shape.
    where
        A mask of the arrays' shape or of their first axes.
    """
    return float(np.linalg.norm((found - truth)[where]) / np.linalg.norm(truth[where]))
