"""How many grids a velocity without a past is looked for on: as many as the fastest smoke needs."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from smokelift.render.renderer import Volume
from smokelift.scene import Scene
from smokelift.selection.choice import Choice
from smokelift.velocity import VelocitySettings, estimate_velocity
from smokelift.velocity.settings import LEVELS

FASTEST = 99
"""Percentile of the smoke's speed that counts as the largest: single wisps may be wrong."""

MARGIN = 1.25
"""By how much grids reach further than the motion that is found, since coarse densities show less than there is."""


def levels_for(motion: float) -> int:
    """Grids that reach a motion (voxels of the finest a frame), as many as usual at most: more were never better.

    Every linearisation reaches a voxel of its own grid, so grids 1, 2, 4, ... voxels wide reach 2^levels - 1 together.
    """
    return min(max(int(np.ceil(np.log2(MARGIN * motion + 1) - 1e-9)), 1), LEVELS)


def choose_levels(
    pairs: Sequence[tuple[Volume, Volume]], coarse: Scene, scene: Scene, settings: VelocitySettings
) -> Choice:
    """Choose the number of grids.

    Parameters
    ----------
    pairs
        Coarse densities (nx, ny, nz) of frames that follow one another.
    coarse
        Scene with their domain.
    scene
        Scene with the final domain.
    settings
        How velocities are estimated.
    """
    assert coarse.domain is not None and scene.domain is not None
    if not pairs:
        return Choice("velocity levels", LEVELS, f"Velocity grids: {LEVELS}, since there is no motion to measure.")
    finer = coarse.domain.voxel_size / scene.domain.voxel_size
    motion = finer * max(_motion(before, after, settings) for before, after in pairs)
    levels = levels_for(motion)
    reason = f"Velocity grids: {levels}, because the fastest smoke goes {motion:.1f} voxels a frame."
    return Choice("velocity levels", levels, reason, {"voxels_a_frame": motion})


def _motion(before: Volume, after: Volume, settings: VelocitySettings) -> float:
    """Speed of the fastest smoke, in voxels a frame."""
    velocity = estimate_velocity(before, after, 1.0, 1.0, replace(settings, method="default", levels=LEVELS))
    smoke = after > settings.smoke_threshold * after.max(initial=0.0)
    if not smoke.any():
        return 0.0
    return float(np.percentile(np.linalg.norm(velocity.centres()[smoke], axis=-1), FASTEST))
