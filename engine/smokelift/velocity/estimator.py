"""What every way to estimate a velocity has in common."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np
import numpy.typing as npt
from scipy import ndimage

from smokelift.checks import Mask, densities, require_kind
from smokelift.scene import Side
from smokelift.scene.checks import set_fields
from smokelift.scene.domain import checked_sides
from smokelift.transport import (
    Array,
    StaggeredGrid,
    Velocity,
    advect,
    project,
    require_positive,
    require_same_shape,
    without_divergence,
)
from smokelift.velocity.optical_flow import PicturePair

Density = npt.NDArray[np.floating[Any]]


@dataclass(frozen=True, eq=False)
class DensityPair:
    """Two densities, and what is known of the box between them.

    Attributes
    ----------
    before, after : (nx, ny, nz)
        Densities >= 0, kept as float32.
    dt
        Time between them in seconds.
    voxel_size
        Edge of a voxel in meters.
    closed
        Sides of the box that are walls.
    inflow : (nx, ny, nz)
        True where smoke enters; None where that is not known.

    Raises
    ------
    ValueError
        For what no estimator takes: see `smokelift.velocity.estimate_velocity`.
    """

    before: Density
    after: Density
    dt: float
    voxel_size: float
    closed: tuple[Side, ...] = ()
    inflow: Mask | None = None

    def __post_init__(self) -> None:
        require_positive("dt", self.dt)
        require_positive("voxel_size", self.voxel_size)
        first = densities(self.before, "before")
        second = densities(self.after, "after", first.shape)
        require_kind(self.inflow, np.ndarray | None, "inflow", "an array of booleans, one per voxel")
        if self.inflow is not None:
            require_same_shape("inflow", self.inflow.shape, first.shape)
        set_fields(self, before=first, after=second, closed=checked_sides(self.closed))


class VelocityEstimator(Protocol):
    """A way to find the velocity between two densities, and to predict the next one."""

    def estimate(
        self, pair: DensityPair, prediction: Velocity | None = None, pictures: PicturePair | None = None
    ) -> Velocity:
        """Estimate the velocity that carries one density into the next: see `estimate_velocity`.

        It may be on a coarser grid than the densities (`refine` leads back), and so may the prediction. Pictures are
        there if one camera alone saw the smoke, and stood still.
        """
        ...

    def predict(self, velocity: Velocity, dt: float) -> Velocity:
        """The velocity of the next frame if no force acts, on the grid of the one given: see `predict_velocity`."""
        ...


def predict_velocity(velocity: Velocity, dt: float) -> Velocity:
    """The velocity after ``dt`` seconds in which no force acts: carried along by itself, then projected."""
    return project(advect(velocity, velocity, dt))


def in_meters(u: StaggeredGrid, pair: DensityPair, figures: Mapping[str, float]) -> Velocity:
    """The velocity (m/s) of an estimate u in voxels per frame, projected a last time, and what is known of it."""
    u, largest = without_divergence(u)
    for component in u.faces:
        component *= np.float32(pair.voxel_size / pair.dt)
    return Velocity(u.faces, pair.voxel_size, u.closed, figures={**figures, "divergence": largest})


def motion_weight(shape: tuple[int, ...], inflow: Mask | None) -> Array:
    """1 in voxels (nx, ny, nz) where changes may be taken for motion, 0 where smoke is known to enter."""
    if inflow is None:
        return np.broadcast_to(np.float32(1), shape)
    # blur and gradients take the change there one voxel further
    weight: Array = (~ndimage.binary_dilation(inflow)).astype(np.float32)
    return weight
