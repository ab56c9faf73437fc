"""The small eddies that an estimated velocity lacks, made up as strong as the smallest that it shows.

Smoke that is carried by a smooth velocity is drawn out into sheets. True smoke has as much motion in each octave of
sizes below a tenth of its width (docs/experiments/continuation.md); estimates lack the fine ones by a factor of ten.
What is missing is added once, where the smoke is, and moves on by itself.
"""

from __future__ import annotations

from dataclasses import replace
from typing import NamedTuple

import numpy as np
from scipy import ndimage

from smokelift.direct.moment import Moment
from smokelift.direct.turbulence import Turbulence
from smokelift.transport import Velocity, at_centres, on_faces, project


class _Octave(NamedTuple):
    """Motion that an average over some voxels leaves out and a narrower one does not, and eddies of its size."""

    average: int
    eddy: float


OCTAVES = (_Octave(3, 2.2), _Octave(7, 4.0), _Octave(13, 8.0), _Octave(27, 16.0))
"""Voxels, from the finest to the one that estimates show."""

IN_SMOKE = np.float32(0.05)
"""Share of the largest density above which a voxel is in the smoke."""

EDGE = 5
"""Voxels over which the eddies end beside the smoke."""


def with_small_eddies(moment: Moment) -> Moment:
    """A moment with the eddies that it lacks; as it is in a box that is too narrow to show any, or without smoke."""
    smoke, velocity = moment.density > IN_SMOKE * moment.density.max(), moment.velocity
    if min(smoke.shape) < OCTAVES[-1].average or not smoke.any():
        return moment
    found, wider = np.zeros(len(OCTAVES)), at_centres(velocity.faces)
    for number, octave in enumerate(OCTAVES):
        averaged = [ndimage.uniform_filter(component, octave.average) for component in wider]
        parts = [np.mean(np.square((u - mean)[smoke])) for u, mean in zip(wider, averaged, strict=True)]
        found[number], wider = float(np.sum(parts)), (averaged[0], averaged[1], averaged[2])
    near = ndimage.uniform_filter(smoke.astype(np.float32), EDGE)
    share = on_faces(np.repeat(near[..., None], 3, axis=-1))
    faces = list(velocity.faces)
    for seed, (octave, square) in enumerate(zip(OCTAVES[:-1], found[:-1], strict=True)):
        speed = float(max(0.0, found[-1] - square)) ** 0.5
        eddies = Turbulence(speed, octave.eddy * velocity.voxel_size, seed).velocity(velocity, 0.0)
        faces = [u + part * eddy for u, part, eddy in zip(faces, share, eddies, strict=True)]
    stirred = project(velocity.with_faces(faces))
    return replace(moment, velocity=Velocity(stirred.faces, stirred.voxel_size, velocity.closed))
