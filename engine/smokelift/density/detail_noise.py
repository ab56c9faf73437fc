"""Noise that breaks the smooth answer's symmetry: as strong as the clip's own detail on every scale, and stretched.

Each octave is as strong as the clip's pictures are on its scale: turbulent smoke gets lobes, laminar smoke stays as it
is. Each is read where random motion of the coarser octaves has taken it from: a flow draws smoke out into sheets and
threads, where plain noise has round grains (Perlin, "An image synthesizer", 1985).
"""

from __future__ import annotations

from collections.abc import Iterator
from functools import lru_cache
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from smokelift.density.levels import Level

MAX_NODE_DISTANCE = 2.0
"""Distance between nodes of the coarsest octave, in standard deviations of the smoke's width: a lobe is as large."""

MIN_NODE_DISTANCE = 3.5
"""Smallest distance (voxels) between nodes of the finest octave. Finer ones flicker
(docs/experiments/every-view.md), and where their detail is made to last the front loses
(docs/experiments/every-view.md)."""

STRETCH = 0.2
"""Standard deviation of each octave's motion, over the distance between its nodes: more draws the smoke out into straws
(docs/experiments/every-view.md)."""

LATTICE = 32
"""Nodes along each side of a lattice, which repeats."""

NODES = np.float32((2 / 3) ** 1.5)
"""Standard deviation of linear interpolation in three dimensions between nodes of unit variance."""


def stretched_noise(
    level: Level, moved: NDArray[np.float64], width: float, strengths: tuple[float, ...], seed: int
) -> NDArray[np.float32]:
    """Octaves of noise (n,) at the voxels that may hold smoke, each stretched by the motion of the coarser ones.

    The noise has ``moved`` (3,), and the smoke is ``width`` wide (standard deviation across its axis), both in voxels
    of the finest grid. ``strengths`` are standard deviations by octave, the coarsest first.
    """
    # an octave's noise, and three more for the motion that draws out the next
    return _sum(level, moved, width, strengths, iter(_lattices(seed, 4 * len(strengths) - 3)))[0]


def _sum(
    level: Level,
    moved: NDArray[np.float64],
    width: float,
    strengths: tuple[float, ...],
    lattices: Iterator[_Lattice],
) -> tuple[NDArray[np.float32], NDArray[np.float32], int]:
    """The sum (n,) of the octaves that a grid holds, and their number.

    Between them is the motion (3, n) in voxels that draws out the next, whose nodes are half as far apart.
    """
    where, size, octaves = level.views.where, level.coarseness, 0
    noise, motion = np.zeros(where.count, np.float32), np.zeros((3, where.count), np.float32)
    if level.coarser is not None:
        coarse, motions, octaves = _sum(level.coarser, moved, width, strengths, lattices)
        for found, values in zip((noise, *motion), (coarse, *motions), strict=True):
            found[...] = level.coarser.finer(level.coarser.views.volume(values), level)
    middle = (size - 1) / 2 - moved

    def octave(spacing: float, strength: float) -> NDArray[np.float32]:
        lattice = next(lattices)
        shift = middle / spacing + lattice.corner
        values = where.read_lattice(lattice.values, size / spacing, shift.tolist(), motion, 1 / spacing)
        values *= np.float32(strength)
        return values

    while octaves < len(strengths):
        spacing = MAX_NODE_DISTANCE * width / 2**octaves
        if octaves and spacing < MIN_NODE_DISTANCE * size:
            break
        noise += octave(spacing, strengths[octaves])
        octaves += 1
        if octaves < len(strengths):
            drawn = [octave(spacing, STRETCH * spacing) for _ in motion]
            for along, more in zip(motion, drawn, strict=True):
                along += more
    return noise, motion, octaves


class _Lattice(NamedTuple):
    """Values at nodes, of unit variance between them, and the place (3,) of the domain's low corner, in nodes."""

    values: NDArray[np.float32]
    corner: NDArray[np.float64]


@lru_cache(maxsize=1)
def _lattices(seed: int, count: int) -> tuple[_Lattice, ...]:
    """The lattices of a clip's octaves, the same in all of its frames."""
    random = np.random.default_rng(seed)
    return tuple(
        _Lattice(
            random.standard_normal((LATTICE,) * 3).astype(np.float32) / NODES,
            random.uniform(0, LATTICE, 3),
        )
        for _ in range(count)
    )
