"""Where smoke enters in the last frames of a clip, and what enters after them.

Where a velocity is wrong, the change that it leaves unexplained has both signs side by side, because smoke is moved and
not made. Where smoke enters, the change is positive all over. So an inlet shows in the mean of the residual over a few
voxels, beside the mean of its magnitude: their ratio, the coherence, is near one in an inlet and near zero elsewhere.

An inlet also stands out from what is left unexplained in the rest of the smoke, and from other inlets. The front of
smoke that is faster than the velocity looks like a wide, weak one.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise

import numpy as np
from scipy import ndimage

import smokelift._core as _core
from smokelift.checks import Mask
from smokelift.direct.state import SmokeState
from smokelift.scene.domain import box_around
from smokelift.transport import Array, advect, faces_in
from smokelift.transport.pressure import FaceMasks, faces_of
from smokelift.velocity.linearization import SMOKE_THRESHOLD

BLUR_VOXELS = 2.0
"""Standard deviation, in voxels, of the Gaussian that takes the means. Wider ones miss small inlets
(docs/experiments/velocity-solver.md)."""

COHERENCE = (0.4, 0.6)
"""Mean residual over mean magnitude: nothing is an inlet below the first, everything that stands out is one above the
second."""

STRENGTH = (3.0, 6.0)
"""Mean residual in medians of its magnitude over the smoke, likewise."""

PROMINENCE = (0.1, 0.2)
"""Mean residual over that of the strongest inlet, likewise: inlets of one scene are of one kind
(docs/experiments/velocity-solver.md)."""

MIN_SCORE = 0.5
"""Score above which a voxel is in an inlet."""

MIN_LASTING_FRACTION = 0.25
"""Smoke that lasts in an inlet over that of the strongest, at least, where the weaker half of the frames counts: what a
wrong velocity leaves is scattered and moves on."""

MIN_RESIDUAL_FRACTION = np.float32(1e-4)
"""Fraction of the largest density below which a residual means nothing."""

MARGIN_VOXELS = 1
"""Voxels around an inlet that belong to it: its smoke is taken from the clip until it is outside."""


@dataclass(frozen=True, eq=False)
class Inflow:
    """The inlets, and the frames of the clip that are replayed in them.

    Forwards and backwards in turn, so that no frame jumps and the statistics stay those of the clip.
    """

    voxels: Mask
    """(nx, ny, nz) bool: those of all inlets, in a box around them."""
    states: Sequence[SmokeState]
    """Of the clip, in their order, in that box."""
    first: tuple[int, ...] = (0, 0, 0)
    """The simulation's voxel at which that box begins."""

    def at(self, step: int) -> SmokeState:
        """The state that is replayed so many steps after the last one."""
        last = len(self.states) - 1
        return self.states[abs(last - step % (2 * last))] if last else self.states[0]

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

    def cropped(self) -> "Inflow":
        """Inflow in the smallest box."""
        box = box_around(self.voxels, 0)
        if not self.voxels.any():
            box = (slice(0, 1),) * 3  # a box has a voxel at least
        states = [
            SmokeState(m.density[box].copy(), m.velocity.with_faces(u.copy() for u in faces_in(m.velocity.faces, box)))
            for m in self.states
        ]
        return Inflow(self.voxels[box], states, tuple(a + side.start for a, side in zip(self.first, box, strict=True)))


def find_inflow(states: Sequence[SmokeState], dt: float, marked: Mask | None = None) -> Inflow:
    """Find the inlets of a clip from the states of its last frames, two at least, `dt` seconds apart.

    Inlets that are known are marked (nx, ny, nz); otherwise they are found from what the velocities do not explain.
    """
    voxels = _detect_inlets(states, dt) if marked is None else marked
    return Inflow(ndimage.binary_dilation(voxels, np.ones((3, 3, 3)), MARGIN_VOXELS), states)


def _detect_inlets(states: Sequence[SmokeState], dt: float) -> Mask:
    """The voxels of inlets by the mean over all frames, for inlets stand still and errors do not."""
    changes = []
    for before, after in pairwise(states):
        carried = advect(before.density, after.velocity, dt)
        largest = np.maximum(after.density, carried)
        changes.append((after.density - carried) / max(largest.max(), np.float32(1e-30)))
    entering = inlet_score(changes, largest > SMOKE_THRESHOLD * largest.max()) > MIN_SCORE
    middle = len(states) // 2
    lasting = np.minimum.reduce([_blurred_mean(part) for part in (changes[:middle], changes[middle:]) if part])
    outflow = sum(map(_outflow, states[1:]), _outflow(states[0]))
    return _strongest_inlets(entering, _blurred_mean(changes), lasting, outflow)


def inlet_score(changes: Sequence[Array], smoke: Mask) -> Array:
    """Return how surely smoke enters in each voxel (nx, ny, nz), from 0 to 1.

    The changes, one at least, are what the velocity leaves unexplained of each step, in units of the largest density.
    """
    mean, magnitude = _blurred_mean(changes), _blurred_mean([np.abs(change) for change in changes])
    typical = float(np.median(np.abs(mean[smoke]))) if smoke.any() else 0.0
    if typical == 0.0:
        return np.zeros(mean.shape, np.float32)
    coherent = _ramp(mean / (magnitude + MIN_RESIDUAL_FRACTION), COHERENCE)
    strong = _ramp(mean / np.float32(typical), STRENGTH)
    prominent = _ramp(mean / max(np.max(coherent * mean), MIN_RESIDUAL_FRACTION), PROMINENCE)
    return np.asarray(coherent * strong * prominent)


def _blurred_mean(changes: Sequence[Array]) -> Array:
    """The mean over steps and over a few voxels."""
    return _core.blur(sum(changes[1:], changes[0]) / np.float32(len(changes)), BLUR_VOXELS, 3.0)


def _ramp(values: Array, ends: tuple[float, float]) -> Array:
    low, high = ends
    return np.clip((values - np.float32(low)) / np.float32(high - low), 0, 1)


def _outflow(state: SmokeState) -> Array:
    """Smoke that flows from each voxel into others of the box, less what flows from there into it, times m/s."""
    outflow = np.zeros_like(state.density)
    for axis, component in enumerate(state.velocity.faces):
        density, flow = np.moveaxis(state.density, axis, 0), np.moveaxis(component, axis, 0)[1:-1]
        through = 0.5 * flow * (density[1:] + density[:-1])
        along = np.moveaxis(outflow, axis, 0)
        along[:-1] += through
        along[1:] -= through
    return outflow


def _strongest_inlets(entering: Mask, strength: Array, lasting: Array, outflow: Array) -> Mask:
    """The connected components of voxels (nx, ny, nz) in which most smoke enters all the time, and goes into the box.

    Where smoke gathers before it leaves the box, more appears than velocities explain as well; it flows in from there.
    """
    labels, count = ndimage.label(entering)
    if count == 0:
        return entering
    numbers = np.arange(1, count + 1)
    entered, lasted, left = (ndimage.sum_labels(each, labels, numbers) for each in (strength, lasting, outflow))
    entered = np.where(left > 0, entered, 0)
    return np.asarray(np.isin(labels, numbers[(entered > 0) & (lasted >= MIN_LASTING_FRACTION * entered.max())]))
