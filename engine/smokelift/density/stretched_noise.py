"""Noise that breaks the smooth answer's symmetry: as strong as the clip's own detail on every scale, and stretched.

Each octave is as strong as the clip's pictures are on its scale: turbulent smoke gets lobes, laminar smoke stays as it
is. Each is read where random motion of the coarser octaves has taken it from: a flow draws smoke out into sheets and
threads, where plain noise has round grains (Perlin, "An image synthesizer", 1985).
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

import smokelift._core as _core
from smokelift.density.exemplar import Picture, reduced
from smokelift.density.moment_levels import MomentLevel

MAX_NODE_DISTANCE = 2.0
"""Distance between nodes of the coarsest octave, in standard deviations of the smoke's width: a lobe is as large."""

MIN_NODE_DISTANCE = 3.5
"""Smallest distance (voxels) between nodes of the finest octave. Finer ones flicker
(docs/experiments/stretched-noise.md), and where their detail is made to last the front loses
(docs/experiments/every-view.md)."""

STRETCH = 0.2
"""Standard deviation of each octave's motion, over the distance between its nodes: more draws the smoke out into straws
(docs/experiments/stretched-noise.md)."""

LATTICE = 32
"""Nodes along each side of a lattice, which repeats."""

NODES = np.float32((2 / 3) ** 1.5)
"""Standard deviation of linear interpolation in three dimensions between nodes of unit variance."""

BODY = 0.1
"""Share of a picture's largest optical depth, blurred, from which detail is measured: faint outlines do not count."""

NEIGHBOURS = (4, 2, 1, 1 / 2, 1 / 4, 1 / 8)
"""Blurs of the octaves whose energy a band holds, over the band's own: others add less than a hundredth."""

FINE_ENOUGH = 1.5
"""Smallest standard deviation (pixels) of the blurs that measure detail: larger pictures are reduced first."""


def roughness(pictures: Sequence[Picture], width: float) -> tuple[float, ...]:
    """Standard deviation of the logarithm of some smoke's density by octave, the coarsest first.

    The pictures are optical depths, a pixel a voxel; the smoke is ``width`` voxels wide (standard deviation across its
    axis). A picture's energy in a band, the difference of blurs of s / sqrt(6) and half of that for nodes s apart, is
    divided by that of smoke with a Gaussian profile whose octaves of noise all have unit strength.
    """
    octaves = max(1, 1 + int(np.log2(MAX_NODE_DISTANCE * width / MIN_NODE_DISTANCE)))
    blurs = [MAX_NODE_DISTANCE * width / 2**octave / np.sqrt(6) for octave in range(octaves)]
    return tuple(float(np.sqrt(np.log1p(_energy(pictures, blur) / _unit_energy(blur, width)))) for blur in blurs)


def _energy(pictures: Sequence[Picture], blur: float) -> float:
    """Mean square of the detail between a blur (deviation, pixels) and half of it, over the blurred smoke's."""
    scale = 1
    while blur / (2 * scale) >= FINE_ENOUGH:
        scale *= 2
    square = amount = 0.0
    for picture in pictures:
        small = reduced(picture, scale)
        fine, coarse = (ndimage.gaussian_filter(small, each / scale) for each in (blur / 2, blur))
        body = coarse > BODY * coarse.max()
        square += float(np.sum((fine - coarse)[body] ** 2 / coarse[body], dtype=np.float64))
        amount += float(np.sum(coarse[body], dtype=np.float64))
    return square / amount


def _unit_energy(blur: float, width: float) -> float:
    """`_energy` of octaves of unit strength: each is blurred white noise, of which a ray averages independent parts."""
    own = np.array([each * blur for each in NEIGHBOURS])
    square = own**2
    bands = 1 / (square + blur**2 / 4) - 2 / (square + blur**2 * 5 / 8) + 1 / (square + blur**2)
    return float(np.sum(square * bands * own / np.hypot(own, width)))


@dataclass(frozen=True, eq=False)
class StretchedNoise:
    """Octaves of noise, each stretched by the motion of the coarser ones.

    The noise has `moved` (3,), and the smoke is `width` wide (standard deviation across its axis), both in voxels of
    the finest grid. `strengths` are standard deviations by octave, the coarsest first.
    """

    moved: NDArray[np.float64]
    width: float
    strengths: tuple[float, ...]
    seed: int

    def at(self, level: MomentLevel) -> NDArray[np.float32]:
        """Noise (n,) at the voxels that may hold smoke."""
        # an octave's noise, and three more for the motion that draws out the next
        return self._sum(level, iter(_lattices(self.seed, 4 * len(self.strengths) - 3))).noise

    def _sum(self, level: MomentLevel, lattices: Iterator[_Lattice]) -> _Octaves:
        """The octaves that a grid holds, and the motion that draws out the next, whose nodes are half as far apart."""
        hull, size, octaves = level.views.hull, level.coarseness, 0
        places = _core.marked(hull).astype(np.float32)
        places *= size
        places += ((size - 1) / 2 - self.moved[:, None]).astype(np.float32)
        noise, motion = np.zeros(places.shape[1], np.float32), np.zeros_like(places)
        if level.coarser is not None:
            coarse = self._sum(level.coarser, lattices)
            octaves = coarse.number
            noise, *motions = (_finer(values, level.coarser, level) for values in (coarse.noise, *coarse.motion))
            motion = np.stack(motions)
        moved = np.empty_like(places)
        while octaves < len(self.strengths):
            spacing = MAX_NODE_DISTANCE * self.width / 2**octaves
            if octaves and spacing < MIN_NODE_DISTANCE * size:
                break
            octave = _octave(np.add(places, motion, out=moved), spacing, next(lattices))
            octave *= np.float32(self.strengths[octaves])
            noise += octave
            octaves += 1
            if octaves < len(self.strengths):
                reach = np.float32(STRETCH * spacing)
                drawn = [_octave(np.add(places, motion, out=moved), spacing, next(lattices)) for _ in motion]
                for along, octave in zip(motion, drawn, strict=True):
                    octave *= reach
                    along += octave
        return _Octaves(noise, motion, octaves)


class _Octaves(NamedTuple):
    """The sum (n,) of some octaves of noise, the motion (3, n) in voxels that draws out the next, and their number."""

    noise: NDArray[np.float32]
    motion: NDArray[np.float32]
    number: int


def _finer(values: NDArray[np.float32], coarser: MomentLevel, level: MomentLevel) -> NDArray[np.float32]:
    """Values at the voxels of one grid that may hold smoke, at those of the next finer one."""
    field = np.zeros(coarser.views.hull.shape, np.float32)
    coarser.views.where.put(values, field)
    return coarser.finer(field, level)


class _Lattice(NamedTuple):
    """Values at nodes, of unit variance between them, and the place (3, 1) of the domain's low corner, in nodes."""

    values: NDArray[np.float32]
    corner: NDArray[np.float32]


@lru_cache(maxsize=1)
def _lattices(seed: int, count: int) -> tuple[_Lattice, ...]:
    """The lattices of a clip's octaves, the same in all of its frames."""
    random = np.random.default_rng(seed)
    return tuple(
        _Lattice(
            random.standard_normal((LATTICE,) * 3).astype(np.float32) / NODES,
            random.uniform(0, LATTICE, (3, 1)).astype(np.float32),
        )
        for _ in range(count)
    )


def _octave(places: NDArray[np.float32], spacing: float, lattice: _Lattice) -> NDArray[np.float32]:
    """Noise (n,) of unit variance at places (3, n), linear between nodes so many voxels apart; uses the places up."""
    places /= np.float32(spacing)
    places += lattice.corner
    return _core.read_lattice(lattice.values, places)
