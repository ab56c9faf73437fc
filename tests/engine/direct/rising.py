"""Smoke that rises above a floor from a round inlet, made by a simulation whose physics is known."""

from dataclasses import replace
from functools import cache
from itertools import product
from pathlib import Path

import numpy as np
from scipy.spatial import ConvexHull

from smokelift import Domain, Sequence, Velocity
from smokelift.direct.continuation import Continuation, continue_sequence
from smokelift.direct.mesh import RECORD
from smokelift.direct.simulation import Combustion, Inflow, Physics, Simulation
from smokelift.direct.state import SmokeState
from smokelift.direct.surroundings import Surroundings
from smokelift.output.writer import SequenceWriter
from smokelift.scene import Inlet
from tests.engine.output import small_sequence

DOMAIN = Domain((-1, -1, 0), (1, 1, 3), (16, 16, 24))
DT = 1 / 24
PHYSICS = Physics(buoyancy=4.0, dissipation=0.3)
LEFT = 0.8
"""Of the plume's fire after a frame."""
SCENE = replace(small_sequence.SCENE, domain=DOMAIN, closed=("z-",))


def blob(center=(0.0, 0.0, 0.8), width=0.3) -> np.ndarray:
    """A Gaussian of smoke, cut off at a thousandth."""
    places = zip(DOMAIN.min, center, DOMAIN.resolution, strict=True)
    x, y, z = np.ix_(*(low + (np.arange(n) + 0.5) * DOMAIN.voxel_size - at for low, at, n in places))
    density = np.exp(-(x**2 + y**2 + z**2) / (2 * width**2)).astype(np.float32)
    return np.where(density > 1e-3, density, np.float32(0))


def at_rest(density: np.ndarray) -> SmokeState:
    return SmokeState(density, Velocity.zero(DOMAIN.shape, DOMAIN.voxel_size, ("z-",)))


def along_x(speed: float) -> Velocity:
    """All air goes along x."""
    x, y, z = at_rest(blob()).velocity.faces
    return Velocity((x + np.float32(speed), y, z), DOMAIN.voxel_size, ("z-",))


def free(physics: Physics = PHYSICS, surroundings: Surroundings | None = None) -> Simulation:
    """A simulation without inlets."""
    nowhere = Inflow(np.zeros(DOMAIN.shape, bool), (at_rest(blob()),))
    return Simulation(physics, nowhere, surroundings or Surroundings(), DT)


def course(simulation: Simulation, state: SmokeState, frames: int) -> list[SmokeState]:
    """A state and those after it."""
    states = [state]
    for step in range(1, frames + 1):
        states.append(simulation.next(states[-1], step))
    return states


@cache
def plume(burning: bool = False) -> tuple[SmokeState, ...]:
    """Smoke from an inlet, 1 s after it has begun; if it burns, with fire that is fed from there."""
    inlet = Inlet((0.0, 0.0, 0.3), 0.3).voxels(DOMAIN)
    faces = Velocity.zero(DOMAIN.shape, DOMAIN.voxel_size, ("z-",)).faces
    faces[2][:, :, 1:] = 1.0
    entering = SmokeState(inlet.astype(np.float32), Velocity(faces, DOMAIN.voxel_size, ("z-",)))
    inflow = Inflow(inlet, (entering,))
    simulation = Simulation(
        PHYSICS, inflow, Surroundings(), DT, Combustion(LEFT, 0.2 * entering.density) if burning else None
    )
    start = at_rest(inlet.astype(np.float32))
    start = replace(start, flame=start.density) if burning else start
    return tuple(course(simulation, start, 38)[24:])


def write_plume(directory: Path, frames: int = 10, burning: bool = False) -> None:
    """The plume as a finished sequence with NumPy twins."""
    medium = replace(SCENE.medium, flame_color=(1.0, 0.4, 0.1) if burning else None)
    with SequenceWriter(directory, replace(SCENE, medium=medium), {"quality": "draft"}, npz=True) as writer:
        for number, state in enumerate(plume(burning)[:frames], 1):
            writer.write(number, state.density, state.velocity.faces, {"psnr": 30.0}, flame=state.flame)


def hull(points) -> np.ndarray:
    """The triangles around some points, with normals that point outwards."""
    points = np.array(points, float)
    found = ConvexHull(points)
    corners = points[found.simplices]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    inwards = (normals * found.equations[:, :3]).sum(axis=1) < 0
    corners[inwards] = corners[inwards, ::-1]
    return corners.astype(np.float32)


def cube(low, high) -> np.ndarray:
    """The triangles of a box, by its corners."""
    return hull(list(product(*zip(low, high, strict=True))))


def octahedron(center, radius) -> np.ndarray:
    """The triangles of an octahedron."""
    return hull(np.array(center) + radius * np.concatenate([np.eye(3), -np.eye(3)]))


def in_box(low, high) -> np.ndarray:
    """The voxels whose centers lie in a box, by its corners."""
    above, below = DOMAIN.offsets(low), DOMAIN.offsets(high)
    x, y, z = ((a >= 0) & (b <= 0) for a, b in zip(above, below, strict=True))
    return x & y & z


def write_stl(path: Path, triangles: np.ndarray) -> None:
    """Write a binary STL file."""
    records = np.zeros(len(triangles), RECORD)
    records["corners"] = triangles
    path.write_bytes(bytes(80) + len(triangles).to_bytes(4, "little") + records.tobytes())


def run(
    source: Sequence, out: Path, continuation: Continuation, *, last: int | None = None, resume: bool = False
) -> Sequence:
    """Continue a sequence, at most to a frame."""
    for number, _ in continue_sequence(source, out, continuation, npz=True, resume=resume):
        if number == last:
            break
    return Sequence.open(out)


def run_twice(source: Sequence, folder: Path, continuation: Continuation, last: int) -> tuple[Sequence, Sequence]:
    """Continue a sequence in one go, and in two: stopped after a frame, and gone on with."""
    run(source, folder / "stopped", continuation, last=last)
    return run(source, folder / "whole", continuation), run(source, folder / "stopped", continuation, resume=True)
