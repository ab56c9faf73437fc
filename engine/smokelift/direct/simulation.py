"""The simulation that continues a clip from its last frame.

A step of dt from density rho and velocity u to rho' and u', in the convention of a sequence, whose velocity has carried
the frame before to this one:

    u'   = Project(advect(u - a, u) + e + dt (b rho up) + a'), in inlets and fans with their own velocity
    rho' = exp(-d dt) advect(rho, u'), in inlets with their own density
    f'   = k advect(f, u') + s

where a is the ambient velocity: wind and turbulence, which all air has in addition to the flow. Outside the box there
is nothing else.

Buoyancy b and dissipation d are those of the clip (`smokelift.direct.fitting`), as is what enters
(`smokelift.direct.inflow`). Fire f is carried by the velocity of the smoke, burns out and is fed: one fraction k is
left of it in a step, and the feed s >= 0 stands still, since what burns does. So a fire whose smoke moves as in the
clip keeps its mean, and one that is blown away from its fuel burns out. It lifts nothing beside what b has.
Advection keeps the mass, and MacCormack's correction the eddies that the grid shows; e are small ones in place of what
interpolation takes (`smokelift.direct.turbulence`).
"""

import math
from dataclasses import dataclass, replace

import numpy as np

from smokelift.checks import Mask
from smokelift.direct.inflow import Inflow
from smokelift.direct.state import SmokeState
from smokelift.direct.surroundings import Solid, Surroundings
from smokelift.direct.turbulence import with_small_eddies
from smokelift.transport import Array, Velocity, advect, on_faces, project

TRACE_FRACTION = np.float32(1e-4)
"""Fraction of the largest density below which nothing is seen. Interpolation spreads such traces over the whole box."""


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
