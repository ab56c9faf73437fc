"""Noise that makes smoke irregular: fine detail of its density, and how the middles of rays wander in depth.

Both lie between random values at the nodes of a lattice (`Lattice`). Between two nodes, t from one and 1 - t from the
other, the other counts 3 t^2 - 2 t^3 (Perlin, "An image synthesizer", 1985): the noise has no creases, as it would have
if it were linear. So an octave is white noise, blurred as by a Gaussian of `NODE_BLUR` of the distance between its
nodes.

Detail (`stretched_noise`) breaks the smooth density's symmetry. Each octave is as strong as the clip's pictures are on
its scale: turbulent smoke gets lobes, laminar smoke stays as it is. Each is read where random motion of the coarser
octaves has taken it from: a flow draws smoke out into sheets and threads, where plain noise has round grains.

Offsets (`Wander`) put the middle of each ray's smoke beside the axis. The axis of one picture's smoke is a mean: from
the side, smoke about it looks turned on a lathe. In true smoke the rays' middles scatter about it by a part of the
smoke's depth (docs/experiments/wander.md). The lobes that scatter them roughen the pictures too. So each octave of the
scatter is as strong as the clip's detail on its scale, and laminar smoke stays straight. Both travel with the smoke.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from functools import lru_cache
from typing import NamedTuple

import numpy as np
from scipy import ndimage

from smokelift.checks import Array, Doubles
from smokelift.density.objective import Level
from smokelift.density.upright_plane import PlaneRays, view_frame
from smokelift.scene import Camera, Domain

LARGEST_BLUR = 0.82
"""Blur of the coarsest octave, in standard deviations of the smoke's width: a lobe is as large. That of the next ones
is half as large each."""

SMALLEST_BLUR = 1.43
"""Smallest blur (voxels) of the finest octave. Finer ones flicker, and where their detail is made to last the front
loses (docs/experiments/every-view.md)."""

NODES = 32
"""Nodes along each side of a lattice, which repeats."""

NODE_BLUR = (2 / 15) ** 0.5
"""Standard deviation of what a node adds about it, in distances between nodes (by definition)."""

NODE_DEVIATION = (26 / 35) ** 0.5
"""Standard deviation of the noise of nodes of unit variance, for each axis: the root of the mean sum of squares of both
weights (by definition)."""

STRETCH = 0.5
"""Standard deviation of each octave's motion, over its blur: more draws the smoke out into straws
(docs/experiments/every-view.md)."""

DEVIATION = 0.5
"""Standard deviation of the rays' middles over the smoke's in depth, where all octaves are of unit strength
(docs/experiments/wander.md)."""

NODE_DISTANCES = (2.5, 1.25)
"""Distances between nodes of the octaves, in standard deviations of the smoke's width: lobes, and half of them
(docs/experiments/wander.md)."""

LARGEST_DEVIATION = 0.9
"""Bound of the standard deviation of the rays' middles over the smoke's: the rest is each ray's own depth."""

LARGEST = 2.0
"""Bound of the scatter, in its standard deviations: smoke stays where the domain is likely to hold it."""


class Lattice(NamedTuple):
    """Values at nodes, of unit variance between them, and the place (axes,) in nodes of what lies at 0."""

    values: Array
    corner: Doubles

    def read(self, places: Doubles) -> Doubles:
        """Values at places (axes, ...), in nodes; `MarkedVoxels.read_lattice` reads them at voxels."""
        at = places + self.corner.reshape(-1, *[1] * (places.ndim - 1))
        node = np.floor(at)
        part = at - node
        smooth = node + part * part * (3 - 2 * part)
        return np.asarray(ndimage.map_coordinates(self.values, smooth, np.float64, order=1, mode="grid-wrap"))


@lru_cache(maxsize=2)
def lattices(seed: int, count: int, axes: int) -> tuple[Lattice, ...]:
    """So many lattices, the same for all frames of a clip."""
    random = np.random.default_rng(seed)
    return tuple(
        Lattice(
            (random.standard_normal((NODES,) * axes) / NODE_DEVIATION**axes).astype(np.float32),
            random.uniform(0, NODES, axes),
        )
        for _ in range(count)
    )


def stretched_noise(level: Level, moved: Doubles, width: float, strengths: tuple[float, ...], seed: int) -> Array:
    """Octaves of noise (n,) at the voxels that may hold smoke, each stretched by the motion of the coarser ones.

    The noise has ``moved`` (3,), and the smoke is ``width`` wide (standard deviation across its axis), both in voxels
    of the finest grid. ``strengths`` are standard deviations by octave, the coarsest first.
    """
    # an octave's noise, and three more for the motion that draws out the next
    return _sum(level, moved, width, strengths, iter(lattices(seed, 4 * len(strengths) - 3, 3)))[0]


def _sum(
    level: Level, moved: Doubles, width: float, strengths: tuple[float, ...], unread: Iterator[Lattice]
) -> tuple[Array, Array, int]:
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

    def octave(blur: float, strength: float) -> Array:
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


@dataclass(frozen=True, eq=False)
class Scatter:
    """Where the middles of the rays' smoke stand at one moment.

    `offset` (rows, columns) is how far they stand behind the axis, over the smoke's standard deviation in depth;
    `deviation` is the standard deviation of that. `width` is the smoke's standard deviation (m) across its axis: a lobe
    moves as one.
    """

    offset: Array
    deviation: float
    width: float


@dataclass(frozen=True, eq=False)
class Wander:
    """How the smoke of one camera's clip wanders.

    `velocity` (3,) is in voxels per frame, `width` the standard deviation of the smoke across its axis in voxels.
    `roughness` is the standard deviation of the logarithm of its density by octave, the coarsest first: see
    `stretched_noise`.
    """

    velocity: Doubles
    width: float
    roughness: tuple[float, ...]
    seed: int

    @property
    def deviation(self) -> float:
        """Standard deviation of the rays' middles, over that of the smoke in depth."""
        return float(np.linalg.norm(self._deviations))

    def scatter(self, camera: Camera, domain: Domain, frame: int) -> Scatter:
        """How the rays of a camera's pixels scatter in a frame."""
        lateral, _, height = view_frame(camera)
        rays = PlaneRays.of(camera, domain)
        crossed = zip((rays.height, rays.lateral), (height, lateral), strict=True)
        places = np.stack([place / domain.voxel_size - frame * (self.velocity @ along) for place, along in crossed])
        return Scatter(self.offset(places).astype(np.float32), self.deviation, self.width * domain.voxel_size)

    def offset(self, places: Doubles) -> Doubles:
        """How far the rays' middles stand behind the axis, over the smoke's standard deviation in depth.

        ``places`` (2, rows, columns) are where the pixels' rays cross the upright plane through the domain's center:
        heights and laterals from there in voxels, less what the smoke has moved since the first frame.
        """
        octaves = zip(self._deviations, NODE_DISTANCES, lattices(self.seed, len(NODE_DISTANCES), 2), strict=False)
        offset = sum(deviation * lattice.read(places / (nodes * self.width)) for deviation, nodes, lattice in octaves)
        return np.asarray(np.clip(offset, -LARGEST * self.deviation, LARGEST * self.deviation))

    @property
    def _deviations(self) -> Doubles:
        """`deviation` by octave."""
        deviations = DEVIATION * np.array(self.roughness[: len(NODE_DISTANCES)])
        return deviations * (LARGEST_DEVIATION / max(float(np.linalg.norm(deviations)), LARGEST_DEVIATION))
