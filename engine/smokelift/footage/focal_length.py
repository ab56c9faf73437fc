"""The focal length of a lens from how the picture changes while the camera turns about its centre.

Turned by R, a picture changes by the homography K R K^-1, which holds the focal length: the longer the lens, the more
evenly all of the picture moves (Szeliski and Shum, "Creating full view panoramic image mosaics and environment maps",
1997). It is fitted to pairs of frames that are far apart together with the turn of each, as
`smokelift.footage.alignment` fits the turn alone. How far the pairs agree says how well it is known: where the camera
hardly turned, not at all.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import combinations

import numpy as np
from scipy.spatial.transform import Rotation

from smokelift.footage.alignment import (
    SAME,
    Array,
    Lens,
    Level,
    Points,
    cell_correlations,
    levels,
    points_of,
    robust_weights,
)
from smokelift.footage.clip import Clip
from smokelift.footage.turning import Turns

FRAMES = 12
"""Frames that pairs are made of."""

PAIRS = 8
"""Pairs that are fitted: those farthest apart."""

NEAREST, FARTHEST = 0.04, 0.5
"""How far apart the frames of a pair look, in widths of the picture: less shows nothing of the lens, of more too little
is in both."""

MIN_PAIRS = 3
"""Pairs from which on their spread says something."""

STARTS = (0.0, -0.35, 0.35, -0.7, 0.7)
"""Logarithms of the focal length over the lens's from which the search begins: it may end at what smoke suggests. That
which explains most of the picture counts."""

EXPLAINED = 0.25
"""Share of the cells that have to be the same in both frames of a pair: smoke may be over most of them."""

ITERATIONS = 12
"""Steps on a level at most."""

CONVERGED = 1e-4
"""Change of the logarithm of the focal length that is the last."""

LONGEST_STEP = 0.2
"""Change of the logarithm of the focal length by a step, at most."""

FARTHEST_OFF = 1.5
"""Change of it by all steps, at most: of a lens four times as long nothing is found that is to be believed."""

FINEST = 2
"""Levels on which both are fitted: the turn is known to some pixels."""

ALIKE = 0.6
"""Correlation of a cell in two pictures from which on it counts: smoke looks unlike itself. It is less than where two
pictures are judged, since the lens may be wrong yet."""

KNOWN = 0.1
"""Standard deviation of the focal length, as a share of it, up to which it counts as determined: an unknown lens is
within a factor of two of the usual one."""

STEP = 1e-3
"""Change of the focal length over which its effect is measured."""


@dataclass(frozen=True)
class FocalLength:
    """A focal length that was measured.

    Attributes
    ----------
    scale
        Over that of the lens that was taken for it.
    deviation
        Standard deviation, as a share of it.
    """

    scale: float
    deviation: float

    @property
    def determined(self) -> bool:
        """Whether it is known well enough to be used."""
        return self.deviation <= KNOWN

    def of(self, lens: Lens) -> Lens:
        """Return the lens with this focal length."""
        across, down = lens.focal
        return replace(lens, focal=(self.scale * across, self.scale * down))


def focal_length(clip: Clip, turns: Turns) -> FocalLength | None:
    """Measure the focal length of a clip whose camera turns; None where too few frames look far enough apart.

    Parameters
    ----------
    clip
        The footage.
    turns
        Of its frames, found with a lens whose focal length may be wrong by a factor of two.

    Raises
    ------
    ClipError
        If a frame cannot be read.
    """
    pairs = [_Pair.of(clip, turns, *numbers) for numbers in _pairs(clip, turns)]
    if len(pairs) < MIN_PAIRS:
        return None
    same, found = max((_fitted(pairs, start) for start in STARTS), key=lambda each: each[0])
    return found if same >= EXPLAINED else None


def _fitted(pairs: Sequence[_Pair], logarithm: float) -> tuple[float, FocalLength | None]:
    """What is found from a logarithm of the focal length over the lens's, and which share of the cells it explains."""
    apart, pairs = np.inf, [pair.through(logarithm) for pair in pairs]
    for level in range(-FINEST, 0):
        for _ in range(ITERATIONS):
            reduced = [pair.normal(level, logarithm) for pair in pairs]
            slope, information = (np.array([getattr(each, name) for each in reduced]) for name in ("slope", "given"))
            if not information.sum() > 0:
                return 0.0, None
            step = float(np.clip(slope.sum() / information.sum(), -LONGEST_STEP, LONGEST_STEP))
            logarithm -= step
            pairs = [pair.turned(each, step) for pair, each in zip(pairs, reduced, strict=True)]
            if abs(logarithm) > FARTHEST_OFF:
                return 0.0, None
            if abs(step) < CONVERGED:
                break
        alone = slope / np.maximum(information, np.finfo(float).tiny)  # what each pair would have it changed by
        apart = float(np.sqrt((information * alone**2).sum() / information.sum()))
    # pairs share frames, and what parallax does to one it does to all, so that their mean is no surer than each
    found = FocalLength(float(np.exp(logarithm)), apart)
    return float(np.mean([pair.same(logarithm) for pair in pairs])), found


def _pairs(clip: Clip, turns: Turns) -> list[tuple[int, int]]:
    """Frames that look as far apart as allowed, the farthest first."""
    numbers, width = clip.spread(FRAMES), turns.lens.size[0]
    ahead = turns.lens.rays(np.array([turns.lens.centre]))

    def apart(pair: tuple[int, int]) -> float:
        here, there = (turns.rotations[number].apply(ahead) for number in pair)
        return float(np.linalg.norm(turns.lens.pixels(here) - turns.lens.pixels(there)) / width)

    far = {pair: apart(pair) for pair in combinations(numbers, 2)}
    allowed = [pair for pair, distance in far.items() if NEAREST <= distance <= FARTHEST]
    return sorted(allowed, key=lambda pair: -far[pair])[:PAIRS]


@dataclass(frozen=True, eq=False)
class _Normal:
    """The normal equations of a pair, of which the turn is eliminated.

    Attributes
    ----------
    slope, given
        Right side and matrix of the equation for the logarithm of the focal length.
    turn, bent : (3,)
        Change of the turn where the focal length is right, and by how much less for a change of its logarithm.
    """

    slope: float
    given: float
    turn: Array
    bent: Array


@dataclass(frozen=True, eq=False)
class _Pair:
    """Two frames, and how the camera turned from one to the other."""

    first: tuple[Points, ...]
    second: tuple[Level, ...]
    turn: Rotation

    @staticmethod
    def of(clip: Clip, turns: Turns, here: int, there: int) -> _Pair:
        """Return the pair of two frames."""
        first, second = (levels(clip.frame(number), turns.lens)[-FINEST:] for number in (here, there))
        return _Pair(points_of(first), second, turns.rotations[there].inv() * turns.rotations[here])

    def through(self, logarithm: float) -> _Pair:
        """Return the pair with the turn that moves the picture's middle as far through another lens."""
        shorter = np.exp(-logarithm)
        return replace(self, turn=Rotation.from_rotvec(self.turn.as_rotvec() * [shorter, shorter, 1.0]))

    def same(self, logarithm: float) -> float:
        """Share of the cells that show the same in both."""
        points = self.first[-1]
        found = cell_correlations(points, *self.second[-1].at(_places(points, self.turn, logarithm)))
        found = found[np.isfinite(found)]
        return float((found >= SAME).mean()) if len(found) else 0.0

    def normal(self, which: int, logarithm: float) -> _Normal:
        """Return the normal equations on a level, at a logarithm of the focal length over the lens's."""
        points, level = self.first[which], self.second[which]
        seen, inside = level.at(_places(points, self.turn, logarithm))
        same = cell_correlations(points, seen, inside)[points.cells] >= ALIKE
        inside &= same if same.any() else True
        residual = np.where(inside, seen - points.values, 0.0)
        weight = robust_weights(residual, inside)
        moved = _places(points, self.turn, logarithm + STEP) - _places(points, self.turn, logarithm - STEP)
        slopes = np.column_stack([points.slopes, (points.gradient * moved).sum(1) / (2 * STEP)])
        weighted = slopes * weight[:, None]
        matrix, right = weighted.T @ slopes, weighted.T @ residual
        turn, bent = np.linalg.lstsq(matrix[:3, :3], np.column_stack([right[:3], matrix[:3, 3]]), rcond=None)[0].T
        slope, given = right[3] - matrix[3, :3] @ turn, matrix[3, 3] - matrix[3, :3] @ bent
        return _Normal(float(slope), float(given), turn, bent)

    def turned(self, normal: _Normal, step: float) -> _Pair:
        """Return the pair with its turn changed, for a step of the logarithm."""
        return replace(self, turn=self.turn * Rotation.from_rotvec(-(normal.turn - step * normal.bent)))


def _places(points: Points, turn: Rotation, logarithm: float) -> Array:
    """Where the points of a picture lie in another, through a lens whose focal length differs."""
    scale = np.exp(logarithm)
    rays = points.rays * np.array([1 / scale, 1 / scale, 1.0])
    turned = turn.apply(rays)
    return points.lens.pixels(turned * np.array([scale, scale, 1.0]))
