"""Bake a scene with Mantaflow in Blender 3.4.

    blender -b --factory-startup -P manta_scene.py -- NAME ACROSS FRAMES STEPS OUT

ACROSS is the number of voxels along x, STEPS that of solver steps per frame; OUT is the file to write, in the format
that truth.py reads. The velocity of a frame carries its smoke to the next one if a step is a frame; with several it is
left out. A voxel on every side is simulated and cut off, so that the floor and the open sides lie on the box's sides.
"""

import json
import sys
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np

sys.path.insert(0, str(Path(__file__).parent))
from mantaflow import boot, view
from scenes import BOX_MIN, BOX_SIZE, FPS, Inlet, Scene, scene

COOLING = 0.4  # decay of the heat (1/s)
DRAFT = 0.06  # strength of the air's first motion (m/s)
FAINTEST = 1e-3  # densities below it are not smoke
MARGIN = 6  # voxels around the smoke within which the velocity is kept
KEPT = slice(1, -1)
MULTIGRID = 3  # Mantaflow's PcMGStatic: the flags never change


class Noise:
    """Smooth noise in space and time: a sum of waves with random directions, frequencies and phases.

    Parameters
    ----------
    rng
        Source of the random numbers.
    shortest, longest
        Range of the wavelengths (m).
    rate
        Largest frequency in time (1/s).
    """

    def __init__(self, rng: np.random.Generator, shortest: float, longest: float, rate: float) -> None:
        direction = rng.normal(size=(3, 32))
        wavelength = np.exp(rng.uniform(np.log(shortest), np.log(longest), 32))
        self.waves = (2 * np.pi * direction / np.linalg.norm(direction, axis=0) / wavelength).astype(np.float32)
        self.frequencies = 2 * np.pi * rng.uniform(-rate, rate, 32)
        self.phases = rng.uniform(0, 2 * np.pi, 32)

    def __call__(self, points: np.ndarray, time: float) -> np.ndarray:
        """Values of unit variance at points (..., 3) at a time (s)."""
        angles = self.frequencies * time + self.phases
        return sum(np.cos(points @ wave + angle) for wave, angle in zip(self.waves.T, angles, strict=True)) / 4


class Simulation:
    """Smoke and heat carried by an incompressible flow above a floor, open above and at the sides.

    Parameters
    ----------
    manta
        Mantaflow.
    scene
        What to simulate.
    across
        Voxels along x.
    step_time
        Length of a step (s).
    """

    def __init__(self, manta: Any, scene: Scene, across: int, step_time: float) -> None:
        self.manta, self.scene, self.step_time = manta, scene, step_time
        self.voxel = BOX_SIZE[0] / across
        self.shape = tuple(round(size / self.voxel) + 2 for size in BOX_SIZE)
        self.scale = step_time / self.voxel  # m/s -> voxels per step, Mantaflow's unit here
        axes = [
            low + np.arange(-0.5, count - 1, dtype=np.float32) * self.voxel
            for low, count in zip(BOX_MIN, self.shape, strict=True)
        ]
        self.points = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1)

        rng = np.random.default_rng(scene.seed)
        self.wisps = Noise(rng, 0.15, 0.45, 2.0)
        self.gusts = [Noise(rng, 0.20, 0.60, 2.0) for _ in range(3)]
        self.wobble = [Noise(rng, 1.0, 2.0, 1.2) for _ in range(2)]
        drafts = [Noise(rng, 0.4, 1.2, 0.0) for _ in range(3)]

        solver = manta.Solver(name="smoke", gridSize=manta.vec3(*self.shape), dim=3)
        solver.timestep = 1.0
        create = solver.create
        self.flags, self.velocity = create(manta.FlagGrid), create(manta.MACGrid)
        self.smoke, self.heat, self.pressure = (create(manta.RealGrid) for _ in range(3))
        self.flags.initDomain(boundaryWidth=0)
        self.flags.fillGrid()
        manta.setOpenBound(
            flags=self.flags, bWidth=1, openBound="xXyYZ", type=manta.CellType_TypeOutflow | manta.CellType_TypeEmpty
        )
        velocity = view(self.velocity, self.shape, 3)
        for axis, (draft, wind) in enumerate(zip(drafts, scene.wind, strict=True)):
            velocity[..., axis] = self.scale * (wind + DRAFT * draft(self.points, 0.0))
        self.air = velocity.copy()
        self.make_incompressible()
        self.solver = solver  # the last attribute, so that it goes after its grids

    def make_incompressible(self) -> None:
        """Project the velocity."""
        self.manta.setWallBcs(flags=self.flags, vel=self.velocity)
        self.manta.solvePressure(
            flags=self.flags, vel=self.velocity, pressure=self.pressure, cgAccuracy=1e-4, preconditioner=MULTIGRID
        )
        # Mantaflow leaves out the faces of the open sides that belong to cells beyond the box
        velocity, pressure = view(self.velocity, self.shape, 3), view(self.pressure, self.shape)
        velocity[-1, KEPT, KEPT, 0] += pressure[-2, KEPT, KEPT]
        velocity[KEPT, -1, KEPT, 1] += pressure[KEPT, -2, KEPT]
        velocity[KEPT, KEPT, -1, 2] += pressure[KEPT, KEPT, -2]

    def step(self, time: float) -> np.ndarray:
        """Advance by a step, to a time (s); return the cells [x, y, z] where smoke was put in."""
        manta, fields = self.manta, {"flags": self.flags, "vel": self.velocity}
        for grid in (self.smoke, self.heat, self.velocity):
            manta.advectSemiLagrange(**fields, grid=grid, order=2)
        manta.resetOutflow(flags=self.flags, real=self.smoke)
        manta.resetOutflow(flags=self.flags, real=self.heat)

        smoke, heat = view(self.smoke, self.shape), view(self.heat, self.shape)
        velocity = view(self.velocity, self.shape, 3)
        lift = self.scene.buoyancy * self.step_time * self.scale
        velocity[:, :, 1:, 2] += lift * 0.5 * (heat[:, :, 1:] + heat[:, :, :-1])
        heat *= np.exp(-COOLING * self.step_time)
        smoke *= np.exp(-self.scene.dissipation * self.step_time)
        self.blow_wind(velocity)
        cells = np.zeros(self.shape, bool)
        if time < self.scene.blowing:
            for inlet in self.scene.inlets:
                cells |= self.blow(inlet, time, smoke, heat, velocity)
        self.make_incompressible()
        return cells[KEPT, KEPT, KEPT]

    def blow_wind(self, velocity: np.ndarray) -> None:
        """Renew the air on the sides that the wind comes from, in place."""
        for axis, wind in enumerate(self.scene.wind):
            if wind:
                side = [slice(None)] * 3
                side[axis] = slice(0, 1) if wind > 0 else slice(-1, None)
                velocity[tuple(side)] = self.air[tuple(side)]

    def blow(self, inlet: Inlet, time: float, smoke: np.ndarray, heat: np.ndarray, velocity: np.ndarray) -> np.ndarray:
        """Set the fields in one inlet, in place, and return its cells."""
        mean = np.array(inlet.velocity)
        speed = np.linalg.norm(mean)
        axis = mean / speed
        center = np.array(inlet.position)
        sway = np.array([wobble(center, time) for wobble in self.wobble])
        center[:2] += 0.25 * inlet.radius * sway
        offset = self.points - center.astype(np.float32)
        along = offset @ axis.astype(np.float32)
        radius = np.sqrt((offset**2).sum(-1) - along**2)
        cells = (np.abs(along) < inlet.half_length) & (radius < inlet.radius)
        where = self.points[cells]
        rim = np.clip(2.0 * (1.0 - radius[cells] / inlet.radius), 0.0, 1.0)
        strength = np.clip(1.0 + 0.4 * self.wisps(where, time), 0.1, 1.6) * rim
        smoke[cells] = np.maximum(smoke[cells], strength)
        heat[cells] = np.maximum(heat[cells], np.minimum(strength, 1))
        for component, gust in enumerate(self.gusts):
            blown = mean[component] + self.scene.gust * speed * gust(where, time)
            velocity[..., component][cells] = self.scale * blown
        return cells

    def density(self) -> np.ndarray:
        """Return the smoke's density [x, y, z] in the box."""
        smoke = view(self.smoke, self.shape)[KEPT, KEPT, KEPT]
        return np.where(smoke > FAINTEST, smoke, 0).astype(np.float16)

    def faces(self, smoke: np.ndarray) -> list[np.ndarray]:
        """Return the velocity on x, y and z faces (m/s) near a density [x, y, z], in the box."""
        near = np.pad(smoke > 0, MARGIN)
        for axis in range(3):  # as far as MARGIN along each axis: a cube around every cell
            count = smoke.shape[axis]
            near = np.logical_or.reduce([near.take(range(s, s + count), axis) for s in range(2 * MARGIN + 1)])
        velocity = view(self.velocity, self.shape, 3) / self.scale
        faces = []
        for axis in range(3):
            kept = [KEPT] * 3
            kept[axis] = slice(1, None)
            ends = [(0, 0)] * 3
            ends[axis] = (1, 1)
            padded = np.pad(near, ends)
            low, high = (padded.take(range(s, s + near.shape[axis] + 1), axis) for s in (0, 1))
            faces.append(np.where(low | high, velocity[(*kept, axis)], 0).astype(np.float16))
        return faces


def main() -> None:
    """Bake one scene."""
    name, across, frames, steps, out = sys.argv[sys.argv.index("--") + 1 :]
    made, frames, steps = scene(name), int(frames), int(steps)
    step_time = 1 / (FPS * steps)
    simulation = Simulation(boot(), made, int(across), step_time)
    warm_up = round(made.warm_up * FPS)
    densities, faces, inflows = [], [], []
    for step in range((warm_up + frames) * steps):
        cells = simulation.step(step * step_time)
        frame, within = divmod(step, steps)
        if within:
            continue
        print(f"frame {frame - warm_up}", flush=True)
        if frame < warm_up:
            continue
        densities.append(simulation.density())
        if steps == 1:
            faces.append(simulation.faces(densities[-1]))
            inflows.append(np.packbits(cells))
    flow = {}
    if steps == 1:
        flow = {f"velocity_{axis}": np.stack([f[i] for f in faces]) for i, axis in enumerate("xyz")}
        flow |= {"velocity_frames": np.arange(frames), "inflow_packed": np.stack(inflows)}
    np.savez_compressed(
        out,
        density=np.stack(densities),
        **flow,
        voxel_size=simulation.voxel,
        fps=FPS,
        closed=np.array(["z-"]),
        made_by=json.dumps(asdict(made)),
    )


if __name__ == "__main__":
    main()
