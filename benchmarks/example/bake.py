"""Bake smoke with a known flow: runs inside Blender 3.4, whose `manta` module is Mantaflow.

    blender -b --factory-startup -P bake.py -- OUT.npz [--kind plume] [--seed 1] [...]

The domain is 2 x 2 x 3 m from [-1, -1, 0], open at the sides and at the top, with a floor. One solver step is
one frame, so the velocity stored with frame f is what carries its smoke to frame f + 1 (by a MacCormack step;
the inlet adds smoke afterwards).
"""

import argparse
import sys
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "truth"))
from mantaflow import boot, view

DOMAIN_MIN = np.array([-1.0, -1.0, 0.0])
DOMAIN_SIZE = np.array([2.0, 2.0, 3.0])
VELOCITY_MARGIN = 6  # voxels around the smoke within which the velocity is stored


@dataclass(frozen=True)
class Inlet:
    """A short cylinder that blows warm smoke.

    Parameters
    ----------
    position : tuple of float
        Centre (m).
    radius : float
        Radius (m).
    velocity : tuple of float
        Mean velocity of what comes out (m/s); it gives the cylinder's axis as well.
    frames : float
        Length of the burst, in frames; infinite for a steady source.
    """

    position: tuple[float, float, float]
    radius: float
    velocity: tuple[float, float, float]
    frames: float = np.inf


@dataclass(frozen=True)
class Kind:
    """A kind of scene.

    Parameters
    ----------
    inlets : list of Inlet
        Where the smoke comes from.
    buoyancy : float
        Acceleration of the hottest air (m/s2).
    """

    inlets: list[Inlet]
    buoyancy: float


KINDS = {
    "plume": Kind([Inlet((-0.14, 0.10, 0.14), 0.21, (0.0, 0.0, 1.1))], 6.5),
    "puff": Kind([Inlet((-0.25, 0.05, 0.30), 0.32, (0.35, 0.0, 0.9), frames=9)], 3.5),
    "jet": Kind([Inlet((-0.80, 0.05, 0.80), 0.15, (2.0, 0.0, 0.3))], 2.0),
    "two_sources": Kind(
        [
            Inlet((-0.40, 0.15, 0.14), 0.17, (0.15, 0.0, 0.7)),
            Inlet((0.42, -0.20, 0.14), 0.14, (-0.1, 0.0, 0.85)),
        ],
        6.5,
    ),
}


class Noise:
    """Smooth noise in space and time: a sum of waves with random directions, frequencies and phases.

    Parameters
    ----------
    rng : numpy.random.Generator
        Source of the random numbers.
    shortest, longest : float
        Range of the wavelengths (m).
    rate : float
        Largest frequency in time (1/s).
    """

    def __init__(self, rng: np.random.Generator, shortest: float, longest: float, rate: float) -> None:
        direction = rng.normal(size=(3, 32))
        wavelength = np.exp(rng.uniform(np.log(shortest), np.log(longest), 32))
        self.waves = 2 * np.pi * direction / np.linalg.norm(direction, axis=0) / wavelength
        self.frequencies = 2 * np.pi * rng.uniform(-rate, rate, 32)
        self.phases = rng.uniform(0, 2 * np.pi, 32)

    def __call__(self, points: np.ndarray, time: float) -> np.ndarray:
        """Return values of unit variance at points (..., 3) at a time (s)."""
        angles = points @ self.waves + self.frequencies * time + self.phases
        return np.cos(angles).sum(axis=-1) / 4.0


class Simulation:
    """Smoke and heat carried by an incompressible flow.

    Parameters
    ----------
    manta : module
        Mantaflow.
    options : argparse.Namespace
        The command line's options.
    """

    def __init__(self, manta: Any, options: argparse.Namespace) -> None:
        self.manta, self.options = manta, options
        across = options.resolution
        self.shape = (across, across, across * 3 // 2)
        self.voxel = DOMAIN_SIZE[0] / across
        self.dt = 1.0 / options.fps
        self.scale = self.dt / self.voxel  # m/s -> voxels a frame, Mantaflow's unit here
        axes = [lo + (np.arange(n) + 0.5) * self.voxel for lo, n in zip(DOMAIN_MIN, self.shape, strict=True)]
        self.points = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1)

        rng = np.random.default_rng(options.seed)
        self.wisps = Noise(rng, 0.10, 0.30, 2.0)
        self.gusts = [Noise(rng, 0.12, 0.50, 2.0) for _ in range(3)]
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
            flags=self.flags,
            bWidth=1,
            openBound="xXyYZ",
            type=manta.CellType_TypeOutflow | manta.CellType_TypeEmpty,
        )
        velocity = view(self.velocity, self.shape, 3)
        for axis, draft in enumerate(drafts):
            velocity[..., axis] = options.draft * self.scale * draft(self.points, 0.0)
        manta.setWallBcs(flags=self.flags, vel=self.velocity)
        manta.solvePressure(flags=self.flags, vel=self.velocity, pressure=self.pressure)
        self.solver = solver  # the last attribute, so that it goes after its grids

    def step(self, frame: int) -> np.ndarray:
        """Advance to a frame (negative during the run-up, without smoke) and return the inlet's cells."""
        manta, options, fields = self.manta, self.options, {"flags": self.flags, "vel": self.velocity}
        for grid in (self.smoke, self.heat, self.velocity):
            manta.advectSemiLagrange(**fields, grid=grid, order=2)
        manta.resetOutflow(flags=self.flags, real=self.smoke)
        manta.resetOutflow(flags=self.flags, real=self.heat)
        manta.vorticityConfinement(**fields, strength=options.vorticity)

        smoke, heat = view(self.smoke, self.shape), view(self.heat, self.shape)
        velocity = view(self.velocity, self.shape, 3)
        lift = options.buoyancy * self.dt * self.scale
        velocity[:, :, 1:, 2] += lift * 0.5 * (heat[:, :, 1:] + heat[:, :, :-1])
        heat *= np.exp(-options.cooling * self.dt)

        time = frame * self.dt
        cells = np.zeros(self.shape, bool)
        for inlet in options.inlets:
            if frame < inlet.frames:
                cells |= self.blow(inlet, time, frame >= 0, smoke, heat, velocity)
        manta.setWallBcs(**fields)
        manta.solvePressure(**fields, pressure=self.pressure)
        return cells if frame >= 0 else np.zeros_like(cells)

    def blow(
        self,
        inlet: Inlet,
        time: float,
        smoking: bool,
        smoke: np.ndarray,
        heat: np.ndarray,
        velocity: np.ndarray,
    ) -> np.ndarray:
        """Set the fields in one inlet, in place, and return its cells."""
        mean = np.array(inlet.velocity)
        axis = mean / np.linalg.norm(mean)
        centre = np.array(inlet.position)
        sway = np.array([wobble(centre, time) for wobble in self.wobble])
        centre[:2] += 0.25 * inlet.radius * sway
        offset = self.points - centre
        along = offset @ axis
        radius = np.linalg.norm(offset - along[..., None] * axis, axis=-1)
        cells = (np.abs(along) < 0.06) & (radius < inlet.radius)
        where = self.points[cells]
        rim = np.clip(2.0 * (1.0 - radius[cells] / inlet.radius), 0.0, 1.0)
        strength = np.clip(0.7 + 0.4 * self.wisps(where, time), 0.05, 1.0) * rim
        if smoking:
            smoke[cells] = np.maximum(smoke[cells], strength)
        heat[cells] = np.maximum(heat[cells], strength)
        speed = np.linalg.norm(mean)
        for component, gust in enumerate(self.gusts):
            blown = mean[component] + 0.30 * speed * gust(where, time)
            velocity[..., component][cells] = self.scale * blown
        return cells

    def record(self) -> tuple[np.ndarray, np.ndarray]:
        """Return copies of the smoke's density and of the velocity (m/s) near it, faces in the last axis."""
        smoke = np.clip(view(self.smoke, self.shape), 0.0, None)
        smoke = np.where(smoke > 1e-4, smoke, 0.0).astype(np.float16)
        near = np.zeros(self.shape, bool)
        if smoke.any():
            box = [(np.min(i), np.max(i) + 1) for i in np.nonzero(smoke)]
            near[tuple(slice(max(lo - VELOCITY_MARGIN, 0), hi + VELOCITY_MARGIN) for lo, hi in box)] = True
        velocity = view(self.velocity, self.shape, 3) / self.scale
        return smoke, np.where(near[..., None], velocity, 0.0).astype(np.float16)


def parse(arguments: list[str]) -> argparse.Namespace:
    """Read the command line and resolve the inlets."""
    parser = argparse.ArgumentParser(prog="bake.py", description=__doc__.splitlines()[0])
    parser.add_argument("out", type=Path)
    parser.add_argument("--kind", choices=KINDS, default="plume")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--frames", type=int, default=48, help="frames kept; smoke enters in the second")
    parser.add_argument("--run-up", type=int, default=24, help="frames of warm clear air before")
    parser.add_argument("--resolution", type=int, default=64, help="voxels across 2 m; even")
    parser.add_argument("--fps", type=float, default=24.0)
    parser.add_argument("--inlet", type=float, nargs=3, help="moves the first inlet: X Y Z (m)")
    parser.add_argument("--radius", type=float, help="of the first inlet (m)")
    parser.add_argument("--buoyancy", type=float, help="acceleration of the hottest air (m/s2)")
    parser.add_argument("--cooling", type=float, default=0.4, help="decay of the heat (1/s)")
    parser.add_argument("--vorticity", type=float, default=0.1, help="vorticity confinement")
    parser.add_argument("--draft", type=float, default=0.06, help="strength of the air's first motion (m/s)")
    options = parser.parse_args(arguments)
    kind = KINDS[options.kind]
    options.buoyancy = kind.buoyancy if options.buoyancy is None else options.buoyancy
    first, *others = kind.inlets
    position = tuple(options.inlet or first.position)
    moved = Inlet(position, options.radius or first.radius, first.velocity, first.frames)
    options.inlets = [moved, *others]
    return options


def main() -> None:
    """Bake one scene into a file in the format of the project's ground truth."""
    options = parse(sys.argv[sys.argv.index("--") + 1 :])
    simulation = Simulation(boot(), options)
    densities, velocities, inflows = [], [], []
    for frame in range(-options.run_up, options.frames):
        cells = simulation.step(frame - 1)
        if frame < 0:
            continue
        density, velocity = simulation.record()
        densities.append(density)
        velocities.append(velocity)
        inflows.append(np.packbits(cells))
        speed = np.abs(velocity).max(axis=(0, 1, 2))
        mass = density.sum(dtype=float) * simulation.voxel**3
        print(f"frame {frame:3d}  smoke {mass:.4f} m3  |velocity| <= {speed} m/s", flush=True)
    faces = {}
    for axis, name in enumerate("xyz"):
        high = [(0, 0)] * 4
        high[axis + 1] = (0, 1)
        faces[f"velocity_{name}"] = np.pad(np.stack([v[..., axis] for v in velocities]), high)
    np.savez_compressed(
        options.out,
        density=np.stack(densities),
        **faces,
        velocity_frames=np.arange(options.frames),
        voxel_size=simulation.voxel,
        fps=options.fps,
        inflow_packed=np.stack(inflows),
    )


if __name__ == "__main__":
    main()
