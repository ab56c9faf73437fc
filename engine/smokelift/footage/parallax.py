"""Whether a camera travels or zooms: what it films keeps its shape, yet no turn lays one frame on another.

Every cell of a picture with texture is followed on its own (Lucas and Kanade, "An iterative image registration
technique", 1981). Before a camera that travels, houses and trees stay what they are and move each in its own way, by
how far they are. Smoke and people, which move before a camera that stands still as well, do not stay what they are.
"""

from __future__ import annotations

from collections.abc import Collection, Sequence

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from smokelift.footage.alignment import CELLS, SAME, Array, Lens, Level, Points, cell_correlations, levels, points_of
from smokelift.footage.alignment import judged as turned_by
from smokelift.footage.clip import Clip

FRAMES = 12
"""Frames on either side of the middle one that are judged: the first that no turn explains. Later ones show other
things."""

TEXTURE_EVERYWHERE = 1 / 3
"""Share of the picture's cells that need texture: less may be smoke alone before something smooth."""

KEPT = 0.5
"""Share of the cells with texture that have to be found again in most of those frames."""

STOOD = 0.5
"""Most of them that may be where they were, as a share of those that are found again."""

STEPS = 8
"""Steps on a level at most."""

CONVERGED = 0.02
"""Pixels of a step that is the last."""

LONGEST_STEP = 2.0
"""Pixels of a step at most."""

STIFFNESS = 1e-3
"""What keeps cells without texture in one direction from moving along it, in squared slopes."""


def travels(clip: Clip, lens: Lens, unexplained: Collection[int]) -> bool:
    """Return whether the camera of a clip travels or zooms.

    Parameters
    ----------
    clip
        The footage.
    lens
        Of its frames.
    unexplained
        Frames that no turn lays on the middle one.

    Raises
    ------
    ClipError
        If a frame cannot be read.
    """
    middle = len(clip) // 2
    key = points_of(levels(clip.frame(middle), lens))
    if _textured(key[-1]) < TEXTURE_EVERYWHERE:
        return False
    kept, stood = [], []
    for numbers in (range(middle + 1, len(clip)), range(middle - 1, -1, -1)):
        moved = np.zeros((CELLS**2, 2))
        judged = 0
        for number in numbers:
            picture = levels(clip.frame(number), lens)
            moved, found = _followed(key, picture, moved)
            if number in unexplained:
                kept.append(found)
                stood.append(turned_by(key[-1], picture[-1], Rotation.identity()).same)
                judged += 1
            if judged == FRAMES:
                break
    return bool(np.median(kept) >= KEPT and np.median(stood) <= STOOD * np.median(kept)) if kept else False


def _textured(points: Points) -> float:
    """Share of a picture's cells that have the texture to be found again."""
    inside = np.ones(len(points.values), np.bool_)
    textured = np.isfinite(cell_correlations(points, points.values, inside)).sum()
    width, height = points.lens.size
    return float(textured / (CELLS**2 * min(width, height) / max(width, height)))


def _followed(first: Sequence[Points], second: Sequence[Level], moved: Array) -> tuple[Array, float]:
    """Follow each cell of one picture into another.

    Parameters
    ----------
    first, second
        Both from coarse to fine.
    moved : (cells, 2)
        By how much each cell is thought to have moved across and down, in widths of the picture.

    Returns
    -------
    (cells, 2)
        By how much it has. A cell that is lost moves as most others do.
    float
        Share of the cells with texture that are found again.
    """
    moved = moved.copy()
    for points, level in zip(first, second, strict=True):
        width = level.lens.size[0]
        for _ in range(STEPS):
            values, inside = _seen(points, level, moved)
            step = _step(points, np.where(inside, values - points.values, 0.0), inside)
            moved += step / width
            if np.abs(step).max() < CONVERGED:
                break
    correlation = cell_correlations(first[-1], *_seen(first[-1], second[-1], moved))
    textured, same = np.isfinite(correlation), correlation >= SAME
    if same.any():
        moved[~same] = np.median(moved[same], axis=0)
    return moved, float(same.sum() / max(textured.sum(), 1))


def _seen(points: Points, level: Level, moved: Array) -> tuple[Array, NDArray[np.bool_]]:
    """The values at the points in another picture where each cell has moved, and which are inside it."""
    return level.at(points.lens.pixels(points.rays) + moved[points.cells] * level.lens.size[0])


def _step(points: Points, residual: Array, inside: NDArray[np.bool_]) -> Array:
    """Pixels (cells, 2) by which each cell moves on: least squares over its points."""

    def total(of: Array) -> Array:
        return np.asarray(np.bincount(points.cells, of * inside, CELLS**2), np.float64)

    across, down = points.gradient.T
    a, b, c = total(across**2) + STIFFNESS, total(across * down), total(down**2) + STIFFNESS
    p, q = total(across * residual), total(down * residual)
    step = -np.column_stack([c * p - b * q, a * q - b * p]) / (a * c - b**2)[:, None]
    return np.asarray(np.clip(step, -LONGEST_STEP, LONGEST_STEP))
