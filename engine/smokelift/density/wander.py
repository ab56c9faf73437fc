"""Smoke that wanders in depth: where the middle of each ray's smoke stands beside the axis.

The axis of one picture's smoke is a mean. From the side, smoke about it looks turned on a lathe. In true smoke the
rays' middles scatter about it by a part of the smoke's depth (docs/experiments/wander.md). The lobes that scatter them
roughen the pictures too. So each octave of the scatter is as strong as the clip's detail on its scale, and laminar
smoke stays straight. The scatter travels with the smoke.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from smokelift.checks import Doubles
from smokelift.density.lattice_noise import lattices
from smokelift.density.upright_plane import PlaneRays, view_frame
from smokelift.scene import Camera, Domain

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


@dataclass(frozen=True, eq=False)
class Scatter:
    """Where the middles of the rays' smoke stand at one moment.

    `offset` (rows, columns) is how far they stand behind the axis, over the smoke's standard deviation in depth;
    `deviation` is the standard deviation of that. `width` is the smoke's standard deviation (m) across its axis: a lobe
    moves as one.
    """

    offset: NDArray[np.float32]
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
