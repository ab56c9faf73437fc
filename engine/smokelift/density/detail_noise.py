"""Noise that breaks the smooth density's symmetry: as strong as the clip's own detail on every scale, and stretched.

Each octave is as strong as the clip's pictures are on its scale: turbulent smoke gets lobes, laminar smoke stays as it
is. Each is read where random motion of the coarser octaves has taken it from: a flow draws smoke out into sheets and
threads, where plain noise has round grains (Perlin, "An image synthesizer", 1985).
"""

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from smokelift.density.lattice_noise import LARGEST_BLUR, NODE_BLUR, SMALLEST_BLUR, Lattice, lattices
from smokelift.density.levels import Level

STRETCH = 0.5
"""Standard deviation of each octave's motion, over its blur: more draws the smoke out into straws
(docs/experiments/every-view.md)."""


def stretched_noise(
    level: Level, moved: NDArray[np.float64], width: float, strengths: tuple[float, ...], seed: int
) -> NDArray[np.float32]:
    """Octaves of noise (n,) at the voxels that may hold smoke, each stretched by the motion of the coarser ones.

    The noise has ``moved`` (3,), and the smoke is ``width`` wide (standard deviation across its axis), both in voxels
    of the finest grid. ``strengths`` are standard deviations by octave, the coarsest first.
    """
    # an octave's noise, and three more for the motion that draws out the next
    return _sum(level, moved, width, strengths, iter(lattices(seed, 4 * len(strengths) - 3, 3)))[0]


def _sum(
    level: Level,
    moved: NDArray[np.float64],
    width: float,
    strengths: tuple[float, ...],
    unread: Iterator[Lattice],
) -> tuple[NDArray[np.float32], NDArray[np.float32], int]:
    """The sum (n,) of the octaves that a grid holds, and their number.

    Between them is the motion (3, n) in voxels that draws out the next, which is half as blurred.
    """
    where, size, octaves = level.views.where, level.coarseness, 0
    noise, motion = np.zeros(where.count, np.float32), np.zeros((3, where.count), np.float32)
    if level.coarser is not None:
        coarse, motions, octaves = _sum(level.coarser, moved, width, strengths, unread)
        for found, values in zip((noise, *motion), (coarse, *motions), strict=True):
            found[...] = level.from_coarser(level.coarser.views.volume(values))
    middle = (size - 1) / 2 - moved

    def octave(blur: float, strength: float) -> NDArray[np.float32]:
        lattice, spacing = next(unread), blur / NODE_BLUR
        shift = middle / spacing + lattice.corner
        values = where.read_lattice(lattice.values, size / spacing, shift.tolist(), motion, 1 / spacing)
        values *= np.float32(strength)
        return values

    while octaves < len(strengths):
        blur = LARGEST_BLUR * width / 2**octaves
        if octaves and blur < SMALLEST_BLUR * size:
            break
        noise += octave(blur, strengths[octaves])
        octaves += 1
        if octaves < len(strengths):
            drawn = [octave(blur, STRETCH * blur) for _ in motion]
            for along, more in zip(motion, drawn, strict=True):
                along += more
    return noise, motion, octaves
