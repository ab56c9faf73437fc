"""How a velocity is estimated."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from smokelift.scene import Side

LEVELS = 3
"""Grids where nobody says how many."""


@dataclass(frozen=True)
class VelocitySettings:
    """How a velocity is estimated. Weights have no unit: see the formula in `smokelift.velocity`.

    Defaults were chosen on baked scenes (plumes, jets, two sources, puffs); `benchmarks/truth` says which, and which
    others only report.

    Attributes
    ----------
    method
        ``"default"``, or ``"paper"``: one grid, one linearisation, first-order smoothness, primal-dual.
    solver
        ``"projected-cg"``, conjugate gradients on velocities without divergence; ``"primal-dual"``, the
        paper's splitting, with the same minimum at several times the cost; ``"auto"``: the one of the method.
    halvings
        How often the grid of the estimate is half as fine as that of the densities, which the velocity is then
        interpolated to. None takes as many in a clip as what its pictures show asks for (see `smokelift.setup`);
        between two densities alone there are none.
    levels
        Grids, each half as fine as the one before, for an estimate without a prediction. None takes as many as the
        motion in a clip asks for (see `smokelift.setup`); between two densities alone three, which reach several
        voxels a frame. With a prediction there is one: fine detail aliases on coarse grids, which costs more than they
        bring.
    warps
        Linearisations on each grid, but one on a finest grid of more than half a million voxels. A second gains a few
        hundredths of error, a third nothing (measured).
    smoothness
        Weight of the differences of vorticity (default) or velocity (paper).
    irrotational
        Weight of vorticity where there is no smoke, and so nothing that could show it. Fast jets want less, slow ones
        more: from 0.01 to 0.1 errors move by 0.01, fast jets' by 0.1.
    kinetic
        Weight of what departs from the prediction. Only there to hold what nothing else does.
    unexplained
        Share of the change between the densities that the prediction leaves unexplained at which `smoothness` and
        `kinetic` hold as they are. They grow in inverse proportion: the more a prediction proves right, the more it is
        trusted. Twice or half as much changes errors by 0.01.
    least_unexplained
        Where that growth ends.
    momentum
        Part of the momentum that fits the change best (see `smokelift.velocity.momentum`) which an estimate without a
        prediction starts from. Below one, because the fit is to noise as well; 0.6 and 1 are hardly worse.
    sources
        Look for smoke that enters, and take no motion from it.
    smoke_threshold
        Fraction of the largest density from which a voxel counts as smoke.
    blur
        Standard deviation in voxels of the Gaussian that smooths the densities; more is taken where noise asks for it,
        none by the default where they are smooth already (see `smokelift.velocity.noise`).
    tolerance
        Projected CG stops at this fraction of the (preconditioned) gradient at rest.
    iterations
        Limit for each solve by projected CG. Ten are as exact against known velocities as a hundred.
    sigma, tau, theta
        Primal-dual: dual step, primal step (the paper's gamma) and over-relaxation; sigma * tau <= 1. Ten
        times smaller sigma or larger tau is further from the minimum after the same time.
    absolute_tolerance, relative_tolerance
        Primal-dual: stops when the change is at most sqrt(3) absolute sqrt(voxels) + relative |u|, in voxels
        per frame: two in a hundred from the minimum.
    primal_dual_iterations
        Limit of its steps; a few tens are usual, and the paper knows none.
    inner_tolerance, inner_iterations
        Primal-dual: by how much, and in how many steps at most, the conjugate gradients in each proximal
        operator reduce their residual. Less exact costs less and changes nothing.
    closed
        Sides of the box that are walls. None by default: the box of a video is cut out of the air around the
        smoke, which goes in and out through it freely. A floor, say, is ``("z-",)``.
    threads
        Processor cores; 0 takes all. The result is the same for any number.
    """

    method: Literal["default", "paper"] = "default"
    solver: Literal["auto", "projected-cg", "primal-dual"] = "auto"
    halvings: int | None = None
    levels: int | None = None
    warps: int = 2
    smoothness: float = 0.03
    irrotational: float = 0.05
    kinetic: float = 0.003
    unexplained: float = 0.25
    least_unexplained: float = 0.04
    momentum: float = 0.8
    sources: bool = True
    smoke_threshold: float = 0.01
    blur: float = 0.5
    tolerance: float = 0.01
    iterations: int = 10
    sigma: float = 0.1
    tau: float = 10.0
    theta: float = 1.0
    absolute_tolerance: float = 1e-4
    relative_tolerance: float = 1e-3
    primal_dual_iterations: int = 100
    inner_tolerance: float = 0.3
    inner_iterations: int = 50
    closed: tuple[Side, ...] = ()
    threads: int = 0

    @property
    def grids(self) -> int:
        """The number of grids, the usual one where it was left open."""
        return LEVELS if self.levels is None else self.levels
