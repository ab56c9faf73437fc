"""Other smoke: the baked one made thicker, darker or forward scattering, and smoke that enters, leaves or splits.

Its pictures are single scattering on the simulation's grid. The light is as strong as the exposure of the camera needs.
"""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
from scipy import ndimage

from benchmarks.disturbances.known import Known, Take
from benchmarks.disturbances.spoiled import GRAY, LENGTH, taken, usual
from smokelift.transport import Array

BRIGHTEST = 0.6
"""Linear radiance of the brightest pixel in front."""

SLIDE, SPLIT = 1 / 8, 1 / 16
"""Fractions of the box's width that smoke slides in a frame, three voxels of the small grid, and that its halves do."""

THICK = 0.5
"""Density of a box that is full, relative to the smoke's largest."""


def optical_depth(known: Known, depth: float) -> Take:
    """Smoke of an optical depth along the thickest column that the camera looks along."""
    part = usual(known)
    _, _, z = part.densities.shape[1:]
    voxel = (part.domain.max[2] - part.domain.min[2]) / z
    now = part.medium.extinction * voxel * float(part.densities.sum(axis=2).max())
    return taken(exposed(part.with_medium(extinction=part.medium.extinction * depth / now)))


def anisotropy(known: Known, mean_cosine: float) -> Take:
    """Smoke that scatters forward (up to 1) or backward (down to -1)."""
    return taken(exposed(usual(known).with_medium(anisotropy=mean_cosine)))


def albedo(known: Known, fraction: float) -> Take:
    """Smoke that scatters a fraction of the light that it stops, before a gray background, which is given."""
    return replace(taken(usual(known).with_medium(albedo=fraction).pictured(), GRAY), behind=GRAY)


def event(known: Known, number: float) -> Take:
    """Smoke that does what `EVENTS` has under a number."""
    return taken(exposed(list(EVENTS.values())[int(number)](usual(known))))


def exposed(known: Known) -> Known:
    """Return it pictured in a light that makes the brightest pixel in front as bright as `BRIGHTEST`."""
    pictured = known.pictured()
    gain = BRIGHTEST / float(pictured.front.radiance.max())
    views = {view: seen.scattering(gain) for view, seen in pictured.views.items()}
    return replace(pictured, scene=replace(known.scene, lights=(known.brighter_light(gain),)), views=views)


def _stands(known: Known) -> Known:
    still = known.at([0] * LENGTH)
    return replace(still, velocities=np.zeros_like(still.velocities), inlets=np.zeros_like(still.inlets))


def _slides(first: int) -> Callable[[Known], Known]:
    """Smoke that does not change slides along x, from where it is so many frames later."""

    def slides(known: Known) -> Known:
        still = _stands(known)
        density = [_moved(each, (first + k) * SLIDE) for k, each in enumerate(still.densities)]
        width = known.domain.max[0] - known.domain.min[0]
        velocity = np.array([SLIDE * width * known.fps, 0, 0], np.float32)
        return replace(still, densities=np.stack(density), velocities=still.velocities + velocity)

    return slides


def _splits(known: Known) -> Known:
    still = _stands(known)
    left = still.densities * (np.arange(still.densities.shape[1]) < still.densities.shape[1] // 2)[:, None, None]
    parts = zip(left, still.densities - left, strict=True)
    halves = [_moved(one, -k * SPLIT) + _moved(other, k * SPLIT) for k, (one, other) in enumerate(parts)]
    return _unknown_flow(replace(still, densities=np.stack(halves)))


def _fills(known: Known) -> Known:
    fraction = np.linspace(0, 1, LENGTH, dtype=np.float32)[:, None, None, None]
    full = np.float32(THICK * known.densities.max())
    return _unknown_flow(replace(known, densities=np.maximum(known.densities, fraction * full)))


def _fades(*fractions: float) -> Callable[[Known], Known]:
    """Smoke of which a fraction is there at each moment."""

    def fades(known: Known) -> Known:
        density = known.densities * np.array(fractions, np.float32)[:, None, None, None]
        return _unknown_flow(replace(known, densities=density))

    return fades


def _unknown_flow(known: Known) -> Known:
    return replace(known, velocities=np.full_like(known.velocities, np.nan))


def _moved(density: Array, fraction: float) -> Array:
    """Return a density (x, y, z) moved along x by a fraction of the box; nothing comes in."""
    return np.asarray(ndimage.shift(density, (round(fraction * len(density)), 0, 0), order=0))


EVENTS: dict[str, Callable[[Known], Known]] = {
    "flows": lambda known: known,
    "stands still": _stands,
    "slides in": _slides(-LENGTH),
    "slides out": _slides(1),
    "splits": _splits,
    "fills the box": _fills,
    "appears": _fades(0, 0, 1, 1, 1, 1),
    "vanishes": _fades(1, 1, 0.5, 0.1, 0, 0),
}
"""What smoke may do, the first being what it does."""
