"""The simulation that continues a clip from its last frame.

A step of dt from density rho and velocity u to rho' and u', in the convention of a sequence, whose velocity has carried
the frame before to this one:

    u'   = Project(advect(u - a, u) + e + dt (b rho up) + a'), in inlets and fans with their own velocity
    rho' = exp(-d dt) advect(rho, u'), in inlets with their own density
    f'   = k advect(f, u') + s

where a is the ambient velocity: wind and turbulence, which all air has in addition to the flow. Outside the box there
is nothing else.

Buoyancy b and dissipation d are those of the clip, as is what enters (`smokelift.direct.fitting`). Fire f is carried by
the velocity of the smoke, burns out and is fed: one fraction k is left of it in a step, and the feed s >= 0 stands
still, since what burns does. So a fire whose smoke moves as in the clip keeps its mean, and one that is blown away from
its fuel burns out. It lifts nothing beside what b has.

Advection keeps the mass, and MacCormack's correction the eddies that the grid shows; e are small ones. True smoke has
as much motion in each octave of sizes below a tenth of its width, about a seventh of its speed
(docs/experiments/continuation.md). An estimated velocity lacks it, and smoke that a smooth velocity carries is drawn
out into sheets and threads. `with_small_eddies` makes up what is missing, and what interpolation takes away in every
step: random motion, new in each (stochastic backscatter: Mason and Thomson 1992). To make the eddies that are there
faster would keep their directions, in which the smooth velocity has drawn them out.
"""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from scipy import ndimage

from smokelift.checks import Mask
from smokelift.direct.state import SmokeState
from smokelift.direct.surroundings import Solid, Surroundings, Turbulence
from smokelift.scene.domain import box_around
from smokelift.transport import Array, Velocity, advect, at_centres, faces_in, on_faces, project
from smokelift.transport.pressure import FaceMasks, faces_of

TRACE_FRACTION = np.float32(1e-4)
"""Fraction of the largest density below which nothing is seen. Interpolation spreads such traces over the whole box."""

SIZES = ((3, 2.2), (7, 4.0), (13, 8.0), (27, 16.0))
"""Octaves of motion, from the finest on; what is larger the estimate shows. Voxels of an average that leaves an octave
out, while the narrower one before does not, and of eddies of its size."""

INTENSITY = 0.23
"""Speed of an octave's eddies, of each component, over that of a clip's smoke: .14 of the true one, of which estimates
show .6 (docs/experiments/continuation.md)."""

MIN_DENSITY_FRACTION = np.float32(0.05)
"""Fraction of the largest density above which a voxel is in the smoke."""

EDGE_VOXELS = 5
"""Voxels over which the eddies end beside the smoke."""


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


@dataclass(frozen=True)
class Physics:
    """What acts on the smoke of a clip."""

    buoyancy: float
    """Upward acceleration at density 1, in m/s2, below zero for smoke that sinks."""
    dissipation: float
    """Rate at which smoke dissolves, in 1/s, at least 0."""
    contradicted_buoyancy: float = 0.0
    """One that was fitted and is not taken, because the clip's smoke moves the other way; 0 if there is none."""


@dataclass(frozen=True, eq=False)
class Combustion:
    """How fire goes on."""

    remaining: float
    """Fraction of the emission that is left of it after a step, 0 to 1."""
    feed: Array
    """(nx, ny, nz): emission that a step adds."""


@dataclass(frozen=True, eq=False)
class Simulation:
    """A simulation with the forces, inlets and fire of a clip, and with what the artist has placed."""

    physics: Physics
    """Fitted to the clip."""
    inflow: Inflow
    """Of the clip."""
    surroundings: Surroundings
    """What the artist has placed."""
    dt: float
    """Time of a step in seconds."""
    fire: Combustion | None = None
    """Of the clip; None without any."""
    eddy_speed: float = 0.0
    """Of the small eddies that the smoke keeps, in m/s; 0 leaves the flow to itself."""

    def next(self, state: SmokeState, step: int) -> SmokeState:
        """Return the state one step later; step 1 starts from the clip's last state."""
        solid = self.surroundings.solid(step, self.dt)
        velocity = self.velocity(state, step, solid)
        obstacle = None if solid is None else solid.voxels
        if step == 1 and obstacle is not None:  # what an obstacle is put into vanishes; later it displaces smoke
            state = state.scaled(np.float32(1) - obstacle)
        density = self._advected(state.density, velocity, obstacle)
        density *= np.float32(math.exp(-self.physics.dissipation * self.dt))
        self.inflow.density_into(density, step, obstacle)
        flame = None
        if self.fire is not None and state.flame is not None:
            carried = self._advected(state.flame, velocity, obstacle)
            flame = np.float32(self.fire.remaining) * carried + self.fire.feed
            if obstacle is not None:
                flame[obstacle] = 0
        return SmokeState(density, velocity, flame)

    def velocity(self, state: SmokeState, step: int, solid: Solid | None = None) -> Velocity:
        """The velocity of the state one step later, around what is solid."""
        before = state.velocity
        air = self.surroundings.air(before, (step - 1) * self.dt)
        flow = before.with_faces(u - a for u, a in zip(before.faces, air, strict=True))
        moved = advect(flow, before, self.dt)
        # the air outside the box is at rest beside the wind
        from_inside = advect(np.ones(before.shape, np.float32), before, self.dt, scheme="semi-lagrangian")
        inside = on_faces(np.stack([from_inside] * 3, axis=-1))
        moved = moved.with_faces(u * weight for u, weight in zip(moved.faces, inside, strict=True))
        if self.eddy_speed > 0:
            moved = with_small_eddies(moved, state.density, self.eddy_speed, step)
        faces = [component.copy() for component in moved.faces]
        lifted = 0.5 * (state.density[:, :, 1:] + state.density[:, :, :-1])
        faces[2][:, :, 1:-1] += np.float32(self.dt * self.physics.buoyancy) * lifted
        for fan_faces, fan_velocity in self.surroundings.fan_faces:
            for component, blown, speed in zip(faces, fan_faces, fan_velocity, strict=True):
                component[blown] = speed
        self.inflow.velocity_into(faces, step)
        air = self.surroundings.air(moved, step * self.dt)
        driven = moved.with_faces(u + a for u, a in zip(faces, air, strict=True))
        return project(driven) if solid is None else solid.projected(driven)

    def in_larger_box(self, ends: tuple[tuple[int, int], ...], surroundings: Surroundings) -> "Simulation":
        """The simulation in a larger box with what is placed there.

        The low and the high side move outwards by these ends, in voxels, along x, y and z.
        """
        first = tuple(start + low for start, (low, _) in zip(self.inflow.first, ends, strict=True))
        inflow = replace(self.inflow, first=first)
        fire = None if self.fire is None else replace(self.fire, feed=np.pad(self.fire.feed, ends))
        return replace(self, inflow=inflow, surroundings=surroundings, fire=fire)

    def _advected(self, values: Array, velocity: Velocity, solid: Mask | None) -> Array:
        """The values with zero for traces and in obstacles, where interpolation puts some, and with their sum kept."""
        moved = advect(values, velocity, self.dt, conserve=True)
        there = moved > TRACE_FRACTION * moved.max()
        if solid is not None:
            there &= ~solid
        cleared = np.where(there, moved, np.float32(0))
        mass, mass_left = (float(amount.sum(dtype=np.float64)) for amount in (moved, cleared))
        return cleared * np.float32(mass / mass_left) if mass_left > 0 else cleared


def small_eddy_speed(states: Sequence[SmokeState]) -> float:
    """The speed in m/s, root mean square of each component, that eddies of each of `SIZES` should have in a clip."""
    squares = [_mean_square(at_centres(m.velocity.faces), [_in_smoke(m.density)] * 3) for m in states]
    return INTENSITY * math.sqrt(float(np.median(squares)))


def with_small_eddies(velocity: Velocity, density: Array, speed: float, step: int = 0) -> Velocity:
    """A velocity whose smoke has eddies of each of `SIZES` of a `small_eddy_speed`; it may have divergence.

    What is missing is added, with other eddies in every step, so that they have nothing to do with the flow and their
    energy adds to its own.
    """
    faces = list(velocity.faces)
    smoke = _in_smoke(density)
    soft = ndimage.uniform_filter(smoke, EDGE_VOXELS)
    inside, near = (on_faces(np.stack([each] * 3, -1)) for each in (smoke, soft))
    for number, (size, found) in enumerate(_octaves(velocity)):
        missing = 3 * speed**2 - _mean_square(found, inside)
        if missing > 0:
            eddies = Turbulence(missing**0.5, size * velocity.voxel_size, step * len(SIZES) + number)
            added = eddies.velocity(velocity, 0.0)
            faces = [u + weight * eddy for u, weight, eddy in zip(faces, near, added, strict=True)]
    return velocity.with_faces(faces)


def _octaves(velocity: Velocity) -> Iterator[tuple[float, list[Array]]]:
    """Voxels of the eddies of each octave that a box holds, and a velocity's motion in it on faces."""
    wider = list(velocity.faces)
    for average, eddy in SIZES:
        if average < min(velocity.shape):
            averaged = [ndimage.uniform_filter(component, average) for component in wider]
            yield eddy, [u - mean for u, mean in zip(wider, averaged, strict=True)]
            wider = averaged


def _in_smoke(density: Array) -> Array:
    return np.asarray((density > MIN_DENSITY_FRACTION * density.max()).astype(np.float32))


def _mean_square(components: Sequence[Array], weights: Sequence[Array]) -> float:
    """The mean square of a vector by its components, each with weights; 0 where there is no weight."""
    return sum(
        float(np.vdot(w, np.square(u))) / max(float(w.sum(dtype=np.float64)), 1e-30)
        for u, w in zip(components, weights, strict=True)
    )
