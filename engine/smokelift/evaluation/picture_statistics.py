"""Statistics of a camera's pictures of smoke that need no true picture of it: spectrum, detail, steadiness, motion."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from smokelift.evaluation import metrics
from smokelift.evaluation.series import finite_mean, flicker_of
from smokelift.footage.images import area_average
from smokelift.transport import Array

MOTION_SIDE = 192
"""Pixels along the longer side of the picture whose motion is measured: two a voxel of the usual grid."""

BLOCKS = 16
"""Blocks along a picture's longer side for its flicker: coarser than any motion from frame to frame."""

MOTION = ("flow_speed", "flow_divergence", "flow_warp_error")
"""Means over the frames of the fields of `metrics.PictureMotion`."""


@dataclass(frozen=True, eq=False)
class PictureStatistics:
    """What a clip of smoke looks like, whatever it shows.

    Attributes
    ----------
    power
        In each of `metrics.OCTAVES`, summed over the frames.
    figures
        ``row_constant_detail``, ``flicker`` and `MOTION`; None where there are too few frames or no smoke.
    """

    power: npt.NDArray[np.float64]
    figures: dict[str, float | None]


class PictureSeries:
    """Gathers the statistics of a camera's consecutive pictures."""

    def __init__(self) -> None:
        self._power: list[npt.NDArray[np.float64]] = []
        self._blocks: list[Array] = []
        self._row_constant: list[float] = []
        self._motion: list[metrics.PictureMotion] = []
        self._before: Array | None = None

    def add(self, smoke: Array) -> None:
        """Add a picture (rows, columns): the smoke alone, as its difference from the background.

        Raises
        ------
        ValueError
            If a value is not finite.
        """
        self._power.append(metrics.octave_power(smoke))
        self._blocks.append(reduced(smoke, BLOCKS))
        if np.any(smoke):
            self._row_constant.append(metrics.row_constant_detail(smoke))
        before, self._before = self._before, reduced(smoke, MOTION_SIDE)
        if before is not None and (motion := metrics.picture_motion(before, self._before)) is not None:
            self._motion.append(motion)

    def statistics(self) -> PictureStatistics:
        """Return the statistics of all pictures so far, of which there is at least one."""
        figures: dict[str, float | None] = {
            "row_constant_detail": finite_mean(self._row_constant),
            "flicker": flicker_of(self._blocks),
            "flow_speed": finite_mean(motion.speed for motion in self._motion),
            "flow_divergence": finite_mean(motion.divergence for motion in self._motion),
            "flow_warp_error": finite_mean(motion.warp_error for motion in self._motion),
        }
        return PictureStatistics(np.sum(self._power, axis=0), figures)


def beside_references(found: PictureStatistics, references: Sequence[PictureStatistics]) -> dict[str, Any]:
    """Compare what one camera shows with what smoke looks like in other clips, or from another side.

    Without a true picture this says whether a view looks like smoke: what a view from another angle looks like is, in
    its statistics, what a front looks like. How bright it is does not count.

    Parameters
    ----------
    found
        Of the view.
    references
        Of the clips; each counts alike.

    Returns
    -------
    ``reference_octaves``, each octave's share of the power less its mean share in the references (dB, the mean of
    decibels); ``reference_distance``, their root mean square; and ``row_constant_detail_reference``. None where nothing
    is seen.
    """
    seen = [reference for reference in references if reference.power.sum() > 0]
    if found.power.sum() <= 0 or not seen:
        return {"reference_distance": None, "reference_octaves": None, "row_constant_detail_reference": None}
    shares = [metrics.octave_shares(statistics.power) for statistics in (found, *seen)]
    octaves = shares[0] - np.mean(shares[1:], axis=0)
    return {
        "reference_distance": float(np.sqrt(np.mean(octaves**2))),
        "reference_octaves": octaves.tolist(),
        "row_constant_detail_reference": finite_mean(reference.figures["row_constant_detail"] for reference in seen),
    }


def reduced(picture: Array, side: int) -> Array:
    """Return a picture (rows, columns) with so many pixels along its longer side, or as it is if it has fewer."""
    rows, columns = picture.shape
    edge = max(rows, columns) / side
    return area_average(picture, max(1, round(columns / edge)), max(1, round(rows / edge))) if edge > 1 else picture
