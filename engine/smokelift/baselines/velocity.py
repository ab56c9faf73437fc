"""The paper's velocity (algorithm 5): one grid, one linearization around rest, first-order smoothness, primal-dual.

It minimizes, over velocities u without divergence in voxels per frame,

    sum (after - before + g . u)^2 / s^2 + smoothness * sum |grad u|^2 + kinetic * sum |u|^2

with g and s as in `smokelift.velocity`. Source: Cen, Zhang, Liang (2023), Entropy 25, 1348, section 3.3.
"""

from dataclasses import dataclass, field

from smokelift.transport import StaggeredGrid, Velocity
from smokelift.velocity.estimator import DensityPair, in_meters, motion_weight, predict_velocity
from smokelift.velocity.linearization import blurred, least_squares, linearize
from smokelift.velocity.optical_flow import PicturePair
from smokelift.velocity.solver import PrimalDual, Solver


@dataclass(frozen=True)
class PaperVelocity:
    """The paper's estimator (a `VelocityEstimator`), by the paper's splitting."""

    smoothness: float = 0.03
    kinetic: float = 0.003
    """Weights, without unit, of the squared differences of velocity and of the squared velocity. The latter only
    decides what nothing else does."""
    blur: float = 0.5
    """Standard deviation in voxels of the Gaussian that smooths the densities."""
    solver: Solver = field(default_factory=PrimalDual)

    def estimate(
        self, pair: DensityPair, prediction: Velocity | None = None, pictures: PicturePair | None = None
    ) -> Velocity:
        """Estimate as by `smokelift.velocity.estimate_velocity`; neither prediction nor pictures are used."""
        rest = StaggeredGrid.zero(pair.before.shape, 1.0, pair.closed)
        before, after = (blurred(density, self.blur) for density in (pair.before, pair.after))
        linear = linearize(before, after, motion_weight(rest.shape, pair.inflow), rest)
        if linear is None:
            return Velocity.zero(rest.shape, pair.voxel_size, pair.closed)
        problem = least_squares(linear, rest, first_order=self.smoothness, kinetic=self.kinetic)
        u, figures = self.solver.solve(problem, rest)
        measures = {name: figures[name] for name in ("iterations", "products", "projections", "residual")}
        return in_meters(u, pair, measures)

    def predict(self, velocity: Velocity, dt: float) -> Velocity:
        """The velocity of the next frame if no force acts."""
        return predict_velocity(velocity, dt)
