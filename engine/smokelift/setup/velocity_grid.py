"""Grids that velocities are estimated on: as fine as pictures can show, and as many as the fastest smoke needs."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from smokelift.render import Volume
from smokelift.scene import Domain
from smokelift.setup.estimate import Estimate, given, measured
from smokelift.velocity import VelocitySettings, estimate_velocity
from smokelift.velocity.settings import LEVELS

FASTEST = 99
"""Percentile of the smoke's speed that counts as the largest: single wisps may be wrong."""

REACH_FACTOR = 1.25
"""Factor by which grids reach further than the motion that is found, since coarse densities show less than there is."""


def choose_coarsening(domain: Domain, settings: VelocitySettings, finest: int) -> Estimate[int]:
    """Choose how much coarser than the densities the grid of the velocity is, and leave at least eight voxels a side.

    Parameters
    ----------
    domain
        With its final resolution.
    settings
        How velocities are estimated.
    finest
        Voxels along the longest side at most.
    """
    if settings.coarsening is not None:
        return given("velocity grid coarsening", settings.coarsening)
    coarsening, longest, shortest = 0, max(domain.resolution), min(domain.resolution)
    while longest > finest and shortest >= 16:
        coarsening, longest, shortest = coarsening + 1, -(-longest // 2), -(-shortest // 2)
    return measured("velocity grid coarsening", coarsening, {"voxels": float(longest)}, tolerance=finest)


def levels_for(motion: float) -> int:
    """Grids that reach a motion (voxels of the finest a frame), as many as usual at most: more were never better.

    Every linearisation reaches a voxel of its own grid, so grids 1, 2, 4, ... voxels wide reach 2^levels - 1 together.
    """
    return min(max(int(np.ceil(np.log2(REACH_FACTOR * motion + 1) - 1e-9)), 1), LEVELS)


def choose_levels(
    pairs: Sequence[tuple[Volume, Volume]], coarse: Domain, final: Domain, settings: VelocitySettings
) -> Estimate[int]:
    """Choose the number of grids.

    Parameters
    ----------
    pairs
        Coarse densities (nx, ny, nz) of frames that follow one another.
    coarse, final
        Their domain, and that of the run.
    settings
        How velocities are estimated.
    """
    if not pairs:
        return Estimate("velocity levels without motion", what="velocity levels", value=LEVELS, source="assumed")
    finer = coarse.voxel_size / final.voxel_size
    motion = finer * max(_motion(before, after, settings) for before, after in pairs)
    levels = levels_for(motion / 2 ** (settings.coarsening or 0))
    return measured("velocity levels", levels, {"voxels_a_frame": motion})


def _motion(before: Volume, after: Volume, settings: VelocitySettings) -> float:
    """Speed of the fastest smoke, in voxels a frame."""
    settings = replace(settings, coarsening=0, levels=LEVELS)
    velocity = estimate_velocity(before, after, 1.0, 1.0, settings)
    smoke = after > settings.smoke_threshold * after.max(initial=0.0)
    if not smoke.any():
        return 0.0
    return float(np.percentile(np.linalg.norm(velocity.centres()[smoke], axis=-1), FASTEST))
