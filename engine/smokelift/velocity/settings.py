"""How a velocity is estimated."""

from __future__ import annotations

from dataclasses import dataclass, field

from smokelift.scene.checks import integer
from smokelift.velocity.solver import ProjectedCG, Solver
from smokelift.velocity.source_detection import SourceDetection


@dataclass(frozen=True)
class VelocitySettings:
    """How the default estimator finds a velocity. Weights have no unit: see the formula in `smokelift.velocity`.

    Defaults are chosen on baked scenes (plumes, jets, two sources, puffs); `benchmarks/truth` says which scenes choose
    and which only report. docs/experiments has the sweeps, under the names given here.

    Attributes
    ----------
    coarsening
        How many times the grid of the estimate is halved. The velocity is interpolated to the densities' grid.
        None takes as many in a clip as what its pictures show asks for (see `smokelift.setup`);
        between two densities alone there are none.
    levels
        Grids, each half as fine as the one before, for an estimate without a prediction: they reach several voxels a
        frame. With a prediction there is one, because fine detail aliases on coarse grids (velocity-pyramid.md).
    linearisations
        Linearisations on each grid (velocity-pyramid.md).
    large_grid
        Voxels. A finest grid of more is linearised once, which costs a third less time (velocity-pyramid.md).
    small_step
        Voxels a frame, root mean square in the smoke. A solve that changes a prediction by less is not linearised
        around again (velocity-pyramid.md).
    largest_increment
        Voxels of the grid at hand. A linearisation of the density holds no further, so the increment is clamped.
    smoothness
        Weight of the differences of vorticity.
    irrotational
        Weight of vorticity where there is no smoke that could show it (velocity-weights.md).
    kinetic
        Weight of what departs from the prediction. It only holds what nothing else does.
    unexplained
        If a prediction leaves this share of the change between the densities unexplained, `smoothness` and `kinetic`
        apply unscaled. They grow in inverse proportion to that share: a better prediction is trusted more
        (velocity-weights.md).
    least_unexplained
        Share at which that growth ends.
    worthless
        Share of the change left unexplained from which a prediction is not used: after a cut, say, or a gust.
    momentum
        Share of the fitted momentum (see `smokelift.velocity.momentum`) that an estimate without a prediction starts
        from. Below one, because the fit is to noise as well (velocity-momentum.md).
    brightening
        Without a prediction, overall brightening is allowed only if it cuts the unexplained change to this share.
        Flicker does; smoke that enters does not (velocity-momentum.md).
    sources
        How smoke that enters is found, from which no motion is taken. None looks for none.
    smoke_threshold
        Fraction of the largest density from which a voxel counts as smoke.
    blur
        Standard deviation in voxels of the Gaussian that smooths the densities. Noise asks for more, smooth densities
        for none (see `smokelift.velocity.preparation`).
    noise
        Allowed noise in the difference of two densities, divided by the root mean square gradient: voxels of motion
        (velocity-noise.md).
    smooth
        Noise in the same unit below which densities are smooth already, and neither blurred nor compressed
        (velocity-noise.md).
    solver
        `ProjectedCG`, or `PrimalDual`, which has the same minimum at several times the cost (velocity-solver.md).
    """

    coarsening: int | None = None
    levels: int = 3
    linearisations: int = 2
    large_grid: int = 500_000
    small_step: float = 0.08
    largest_increment: float = 1.0
    smoothness: float = 0.03
    irrotational: float = 0.05
    kinetic: float = 0.003
    unexplained: float = 0.25
    least_unexplained: float = 0.04
    worthless: float = 0.5
    momentum: float = 0.8
    brightening: float = 0.5
    sources: SourceDetection | None = field(default_factory=SourceDetection)
    smoke_threshold: float = 0.01
    blur: float = 0.5
    noise: float = 0.35
    smooth: float = 0.045
    solver: Solver = field(default_factory=ProjectedCG)

    def __post_init__(self) -> None:
        """Check the counts; ValueError."""
        integer(self.linearisations, "linearisations", "a whole number from 1", least=1)
        integer(self.levels, "levels", "a whole number from 1", least=1)
        if self.coarsening is not None:
            integer(self.coarsening, "coarsening", "a whole number from 0, or None", least=0)
