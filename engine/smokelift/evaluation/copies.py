"""Whether a view is made of another view's pictures, of the same moment or another, shifted or mirrored."""

from __future__ import annotations

import numpy as np

from smokelift.evaluation import metrics
from smokelift.evaluation.picture_statistics import MOTION_SIDE, reduced
from smokelift.evaluation.series import finite_mean
from smokelift.transport import Array

REACH, STEP = 15, 3
"""Frames to both sides among which a view's source is looked for, and between two that are tried: smoke keeps most of
its detail for six frames and little for fourteen."""

SOUGHT = 6
"""Frames of the view whose source is looked for, spread over the clip."""


class CopiedDetail:
    """Compares the fine detail of a view with that of another view that it may be copied from."""

    def __init__(self) -> None:
        self._views: list[Array] = []
        self._sources: list[Array] = []

    def add(self, view: Array, source: Array) -> None:
        """Add a frame's two pictures (rows, columns): the smoke alone, as its difference from the background."""
        self._views.append(reduced(view, MOTION_SIDE))
        self._sources.append(reduced(source, MOTION_SIDE))

    def same_moment(self) -> float | None:
        """Return `metrics.aligned_detail_correlation` of both, mean over the frames; None without a frame."""
        pairs = zip(self._views, self._sources, strict=True)
        return finite_mean(metrics.aligned_detail_correlation(view, source) for view, source in pairs)

    def any_moment(self) -> float | None:
        """Return the largest over the other view's frames around, mean over some frames; None without a frame."""
        count = len(self._views)
        sought = np.unique(np.linspace(0, count - 1, min(SOUGHT, count)).round().astype(int)) if count else ()
        return finite_mean(self._largest(int(frame)) for frame in sought)

    def _largest(self, frame: int) -> float:
        around = range(frame - REACH, frame + REACH + 1, STEP)
        sources = (self._sources[other] for other in around if 0 <= other < len(self._sources))
        return max(metrics.aligned_detail_correlation(self._views[frame], source) for source in sources)
