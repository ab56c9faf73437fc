"""Where smoke enters in the last moments of a clip, and what enters after them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import pairwise

import numpy as np
from scipy import ndimage

from smokelift.checks.array_types import Mask
from smokelift.direct.constraint import FaceMasks, faces_of
from smokelift.direct.moment import Moment
from smokelift.direct.source_detection import ResidualMeans, SourceDetection
from smokelift.scene.domain import box_around
from smokelift.transport import Array, advect, faces_in

MOTION = 0.5
"""Share of its change that may be motion in a voxel of an inlet, at most."""

PROMINENT = 0.25
"""Share of the strongest inlet's smoke that lasts in an inlet at least, where the weaker half of the moments counts:
inlets of one scene are of one kind, and what a wrong velocity leaves is scattered and moves on."""

MIN_DENSITY_SHARE = 0.01
"""Share of the largest density below which a voxel is not in the smoke."""

MARGIN_VOXELS = 1
"""Voxels around an inlet that belong to it: its smoke is taken from the clip until it is outside."""


@dataclass(frozen=True, eq=False)
class Inflow:
    """The inlets, and the moments of the clip that are replayed in them.

    Forwards and backwards in turn, so that no frame jumps and the statistics stay those of the clip.

    Attributes
    ----------
    voxels : (nx, ny, nz) bool
        Those of all inlets, in a box around them.
    moments
        Of the clip, in their order, in that box.
    first
        The simulation's voxel at which that box begins.
    """

    voxels: Mask
    moments: Sequence[Moment]
    first: tuple[int, ...] = (0, 0, 0)

    def at(self, step: int) -> Moment:
        """The moment that is replayed so many steps after the last one."""
        last = len(self.moments) - 1
        return self.moments[abs(last - step % (2 * last))] if last else self.moments[0]

    def forwards(self) -> Inflow:
        """The inflow from the first moment on, so that step n replays moment n."""
        return replace(self, moments=self.moments[::-1])

    @property
    def box(self) -> tuple[slice, ...]:
        """The box around the inlets in the simulation's voxels."""
        return tuple(slice(first, first + n) for first, n in zip(self.first, self.voxels.shape, strict=True))

    @cached_property
    def faces(self) -> FaceMasks:
        """The faces of the inlets' voxels, in their box."""
        return faces_of(self.voxels)

    def density_into(self, density: Array, step: int, solid: Mask | None) -> None:
        """Set the density (nx, ny, nz) in the inlets to what enters, outside of what is solid."""
        inlets = self.voxels if solid is None else self.voxels & ~solid[self.box]
        density[self.box][inlets] = self.at(step).density[inlets]

    def velocity_into(self, faces: Sequence[Array], step: int) -> None:
        """Set the velocity on the faces of the inlets to that of what enters."""
        x, y, z = faces
        for here, inlets, entering in zip(
            faces_in((x, y, z), self.box), self.faces, self.at(step).velocity.faces, strict=True
        ):
            here[inlets] = entering[inlets]

    def cropped(self) -> Inflow:
        """Inflow in the smallest box."""
        box = box_around(self.voxels, 0)
        if not self.voxels.any():
            box = (slice(0, 1),) * 3  # a moment has a voxel at least
        moments = [
            Moment(m.density[box].copy(), m.velocity.with_faces(u.copy() for u in faces_in(m.velocity.faces, box)))
            for m in self.moments
        ]
        return Inflow(self.voxels[box], moments, tuple(a + side.start for a, side in zip(self.first, box, strict=True)))


def find_inflow(moments: Sequence[Moment], dt: float, marked: Mask | None = None) -> Inflow:
    """Find the inlets of a clip from its last moments, two at least, `dt` seconds apart.

    Inlets that are known are marked (nx, ny, nz); otherwise they are found from what the velocities do not explain.
    """
    voxels = _detect_inlets(moments, dt) if marked is None else marked
    if voxels.any():
        voxels = ndimage.binary_dilation(voxels, ndimage.generate_binary_structure(3, 3), MARGIN_VOXELS)
    return Inflow(voxels, moments)


def _detect_inlets(moments: Sequence[Moment], dt: float) -> Mask:
    """The voxels of inlets by the mean over all moments, for inlets stand still and errors do not."""
    changes = [_unexplained(before, after, dt) for before, after in pairwise(moments)]
    means = _means(changes)
    middle = len(moments) // 2
    halves = [_means(part).mean for part in (changes[:middle], changes[middle:]) if part]
    densest = changes[-1][1]
    entering = SourceDetection().weight(means, densest > MIN_DENSITY_SHARE * densest.max()) < MOTION
    given = np.zeros_like(densest)
    for moment in moments:
        given += _given_away(moment)
    return _strongest_inlets(entering, means.mean, np.minimum.reduce(halves), given)


def _unexplained(before: Moment, after: Moment, dt: float) -> tuple[Array, Array]:
    """The change that a velocity does not explain, and the larger density of what it explains and what there is."""
    carried = advect(before.density, after.velocity, dt)
    return after.density - carried, np.maximum(after.density, carried)


def _means(changes: Sequence[tuple[Array, Array]]) -> ResidualMeans:
    """Means over changes, one at least, that velocities do not explain."""
    means = None
    for number, (residual, densest) in enumerate(changes, 1):
        means = SourceDetection(news=1 / number).means(residual, densest, means)
    assert means is not None
    return means


def _given_away(moment: Moment) -> Array:
    """Smoke that flows from each voxel into others of the box, less what flows from there into it, times m/s."""
    given = np.zeros_like(moment.density)
    for axis, component in enumerate(moment.velocity.faces):
        density, flow = np.moveaxis(moment.density, axis, 0), np.moveaxis(component, axis, 0)[1:-1]
        through = 0.5 * flow * (density[1:] + density[:-1])
        along = np.moveaxis(given, axis, 0)
        along[:-1] += through
        along[1:] -= through
    return given


def _strongest_inlets(entering: Mask, strength: Array, lasting: Array, given: Array) -> Mask:
    """The connected components of voxels (nx, ny, nz) in which most smoke enters all the time, and goes into the box.

    Where smoke gathers before it leaves the box, more appears than velocities explain as well; it flows in from there.
    """
    labels, count = ndimage.label(entering)
    if count == 0:
        return entering
    numbers = np.arange(1, count + 1)
    sums, lasting_sums, given_sums = (ndimage.sum_labels(each, labels, numbers) for each in (strength, lasting, given))
    sums = np.where(given_sums > 0, sums, 0)
    kept: Mask = np.isin(labels, numbers[(sums > 0) & (lasting_sums >= PROMINENT * sums.max())])
    return kept
