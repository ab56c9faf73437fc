"""Whether a view is made of another view's pictures, of the same moment or another, shifted or mirrored."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from smokelift.evaluation import metrics
from smokelift.evaluation.picture_statistics import MOTION_SIDE, reduced
from smokelift.evaluation.series import finite_mean
from smokelift.transport import Array

_Small = npt.NDArray[np.float16]

REACH, STEP = 15, 3
"""Frames to both sides among which the side's source is looked for, and between two that are tried: smoke keeps most of
its detail for six frames and little for fourteen."""

SOUGHT = 6
"""Frames of the side whose source is looked for, spread over the clip."""


class SideCopies:
    """What the fine detail of a view from the side has in common with other views of the same density.

    It keeps small pictures of all frames, 50 kB each.
    """

    def __init__(self) -> None:
        self._in_place: list[float] = []
        self._aligned: list[float] = []
        self._between: list[float] = []
        self._sides: list[_Small] = []
        self._fronts: list[_Small] = []

    def add(self, front: Array, between: Array, side: Array) -> None:
        """Add a frame's pictures (rows, columns): the smoke alone, as its difference from the background.

        Parameters
        ----------
        front
            From where the input was filmed.
        between
            From an angle between front and side.
        side
            Of the front's size if they are to be compared in place.
        """
        if side.shape == front.shape:
            self._in_place.append(metrics.detail_correlation(side, front))
        front, between, side = (reduced(picture, MOTION_SIDE) for picture in (front, between, side))
        self._aligned.append(metrics.aligned_detail_correlation(side, front))
        self._between.append(metrics.aligned_detail_correlation(side, between))
        self._sides.append(side.astype(np.float16))
        self._fronts.append(front.astype(np.float16))

    def figures(self) -> dict[str, float | None]:
        """Return means over the frames; None where there is nothing to say.

        ``detail_correlation`` is that of side and front in place, ``copied_detail`` the largest under any shift,
        mirrored or not, ``copied_detail_moments`` that with the front in any frame around, of `SOUGHT` frames,
        ``copied_detail_between`` that with the view between.
        """
        count = len(self._sides)
        sought = np.unique(np.linspace(0, count - 1, min(SOUGHT, count)).round().astype(int)) if count else ()
        return {
            "detail_correlation": finite_mean(self._in_place),
            "copied_detail": finite_mean(self._aligned),
            "copied_detail_moments": finite_mean(self._from_any_moment(int(frame)) for frame in sought),
            "copied_detail_between": finite_mean(self._between),
        }

    def _from_any_moment(self, frame: int) -> float:
        around = range(frame - REACH, frame + REACH + 1, STEP)
        fronts = (self._fronts[other] for other in around if 0 <= other < len(self._fronts))
        return max(metrics.aligned_detail_correlation(self._sides[frame], front) for front in fronts)
