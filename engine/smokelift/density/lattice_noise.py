"""Noise between random values at the nodes of a lattice, along as many axes as are asked for, and its octaves.

Between two nodes, t from one and 1 - t from the other, the other counts 3 t^2 - 2 t^3 (Perlin, "An image synthesizer",
1985): the noise has no creases, as it would have if it were linear. So an octave is white noise, blurred as by a
Gaussian of `NODE_BLUR` of the distance between its nodes.
"""

from functools import lru_cache
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from smokelift.checks import Doubles

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

DEVIATION = (26 / 35) ** 0.5
"""Standard deviation of the noise of nodes of unit variance, for each axis: the root of the mean sum of squares of both
weights (by definition)."""


class Lattice(NamedTuple):
    """Values at nodes, of unit variance between them, and the place (axes,) in nodes of what lies at 0."""

    values: NDArray[np.float32]
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
            (random.standard_normal((NODES,) * axes) / DEVIATION**axes).astype(np.float32),
            random.uniform(0, NODES, axes),
        )
        for _ in range(count)
    )
