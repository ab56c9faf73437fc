"""Clips cut at two thirds and continued, beside what really came.

    python -m benchmarks.direct.continuation SCENES/plume-3 ... [--runs OUT/runs] [--heads RATE] [--picture FILE.png]

Every scene is continued from its true densities and velocities and, where OUT/runs holds a run `balanced` of
`benchmarks.accuracy`, from that. It is compared with the last frame held, and with the last frame carried on by its
velocity. The rise is how far the smoke of the last frame goes up by the simulated velocities, over how far it really
goes. With --heads the upper part of the smoke dissolves before anything is fitted, up to RATE (1/s) at its top.
"""

import argparse
from collections.abc import Iterator
from dataclasses import replace
from functools import partial
from pathlib import Path

import numpy as np
import numpy.typing as npt

from benchmarks.accuracy.scenes import KnownScene, baked_scene
from benchmarks.tables import markdown
from smokelift.direct.continuation import FITTED_FRAMES
from smokelift.direct.fitting import BUOYANCY_FRAMES, coarsen_state, fit_simulation, spin_up
from smokelift.direct.simulation import Physics, Simulation
from smokelift.direct.state import SmokeState, complete_velocity
from smokelift.evaluation import metrics
from smokelift.evaluation.truth import Truth, resampled
from smokelift.output.images import eight_bit, write_sheet
from smokelift.transport import Array, Velocity, advect, at_centres, on_faces

RUN = "balanced"
HEADER = ("scene", "from", "", "buoyancy", "rise", "error", "error, last frame")


def true_moment(truth: Truth, frame: int) -> SmokeState:
    """Return a moment of the truth, from frame 1."""
    velocity = replace(truth.velocity(frame - 1), closed=truth.closed)
    return SmokeState(truth.density(frame), complete_velocity(velocity))


def reconstructed_moment(folder: Path, truth: Truth, frame: int) -> SmokeState:
    """Return a moment of a run of `benchmarks.accuracy`, from frame 1."""
    with np.load(folder / f"{frame + 1:04d}.npz") as file:
        density, centers = (file[name].astype(np.float32) for name in ("density", "velocity"))
    voxel_size = truth.voxel_size * truth.shape[0] / density.shape[0]
    return SmokeState(density, complete_velocity(Velocity(on_faces(centers), voxel_size, truth.closed)))


def density_error(found: Array, true: Array) -> float:
    """Return the relative error of a density, on the true one's grid."""
    nx, ny, nz = true.shape
    return metrics.volume_error(resampled(found, (nx, ny, nz)), true)


def ways(
    moments: list[SmokeState], frames: int, dt: float, fitted: list[SmokeState] | None = None, *, true: bool
) -> Iterator[tuple[str, list[SmokeState], Physics | None]]:
    """Yield every way to continue moments by so many frames, with its moments and its physics.

    The physics is fitted to the moments, or to others in their place. True moments have their eddies, and gain none.
    """
    last = moments[-1]
    yield "held", [last] * frames, None
    carried = [last]
    for _ in range(frames):
        density = advect(carried[-1].density, last.velocity, dt, conserve=True)
        carried.append(SmokeState(density, last.velocity))
    yield "carried", carried[1:], None
    simulation = fitted_simulation(fitted or moments, dt)
    if true:
        simulation = replace(simulation, eddy_speed=0.0)
    simulated = [spin_up(simulation, moments[-FITTED_FRAMES:])]
    for step in range(1, frames + 1):
        simulated.append(simulation.next(simulated[-1], step))
    yield "simulated", simulated[1:], simulation.physics


def fitted_simulation(moments: list[SmokeState], dt: float) -> Simulation:
    """Return the simulation that `smokelift continue` goes on with."""
    earlier = [coarsen_state(moment) for moment in moments[-BUOYANCY_FRAMES:-FITTED_FRAMES]]
    return fit_simulation(moments[-FITTED_FRAMES:], dt, earlier=earlier)


def with_dissolving_heads(moments: list[SmokeState], dt: float, rate: float) -> list[SmokeState]:
    """Return moments whose smoke dissolves since the first: above 30 % of its height, up to a rate (1/s) at its top."""
    layers = moments[-1].density.sum((0, 1))
    top = int(np.flatnonzero(layers > 1e-3 * layers.max())[-1])
    fraction = np.clip((np.arange(len(layers)) / top - 0.3) / 0.7, 0, 1)
    left = [np.exp(-rate * dt * number * fraction).astype(np.float32) for number in range(len(moments))]
    return [replace(moment, density=moment.density * each) for moment, each in zip(moments, left, strict=True)]


def rise(velocities: list[Velocity], density: Array, dt: float) -> float:
    """Return how far (m) a density goes up that velocities carry."""
    way = 0.0
    for velocity in velocities:
        upwards = at_centres(velocity.faces)[2]
        way += dt * float(np.vdot(density, upwards)) / float(density.sum(dtype=np.float64))
        density = advect(density, velocity, dt, conserve=True)
    return way


def cut_at_two_thirds(truth: Truth, folder: Path | None = None) -> tuple[list[SmokeState], range]:
    """Return the last moments before the cut, of the truth or of a run in a folder, and the frames behind it."""
    count = truth.frames if folder is None else len(list(folder.glob("[0-9]*.npz")))
    cut = 2 * count // 3
    moment = true_moment if folder is None else partial(reconstructed_moment, folder)
    return [moment(truth, frame) for frame in range(max(1, cut - BUOYANCY_FRAMES), cut)], range(cut, count)


def table(known: KnownScene, folder: Path | None, heads: float) -> Iterator[list[str]]:
    """Yield the rows of a scene from its truth, or from a run in a folder; its head dissolves at a rate (1/s)."""
    truth = known.truth
    assert truth is not None
    moments, frames = cut_at_two_thirds(truth, folder)
    really = rise([truth.velocity(frame - 1) for frame in frames], truth.density(frames[0] - 1), truth.dt)
    fitted = with_dissolving_heads(moments, truth.dt, heads)
    for how, found, physics in ways(moments, len(frames), truth.dt, fitted, true=folder is None):
        errors = [density_error(m.density, truth.density(f)) for m, f in zip(found, frames, strict=True)]
        up = rise([moment.velocity for moment in found], moments[-1].density, truth.dt) / really
        own = [f"{physics.buoyancy:.2f}", f"{up:.2f}"] if physics else ["", ""]
        source = "truth" if folder is None else "clip"
        yield [known.name, source, how, *own, f"{np.mean(errors):.2f}", f"{errors[-1]:.2f}"]


def tile(density: Array, white: float) -> npt.NDArray[np.uint8]:
    """Return the mean density along y as a picture, z up."""
    return eight_bit(np.repeat((density.mean(axis=1).T[::-1] / white)[..., None].astype(np.float32), 3, axis=-1))


def picture(known: KnownScene, path: Path) -> None:
    """Write a sheet: what came and every way to continue, over time."""
    truth = known.truth
    assert truth is not None
    moments, frames = cut_at_two_thirds(truth)
    shown = [0, len(frames) // 3, 2 * len(frames) // 3, len(frames) - 1]
    white = float(max(truth.density(f).mean(axis=1).max() for f in frames))
    columns = {"what came": [truth.density(frames[i]) for i in shown]}
    for how, found, _ in ways(moments, len(frames), truth.dt, true=True):
        columns[how] = [found[i].density for i in shown]
    rows = [[tile(column[i], white) for column in columns.values()] for i in range(len(shown))]
    write_sheet(path, rows, tuple(columns), [f"+{i + 1}" for i in shown])


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("scenes", nargs="+", type=Path, metavar="SCENE")
    parser.add_argument("--runs", type=Path)
    parser.add_argument("--heads", type=float, default=0.0, metavar="RATE", help="at which heads dissolve, in 1/s")
    parser.add_argument("--picture", type=Path, help="of the first scene")
    options = parser.parse_args()
    rows: list[list[str]] = []
    for scene in options.scenes:
        known = baked_scene(scene)
        rows += table(known, None, options.heads)
        if options.runs and (folder := options.runs / scene.name / RUN).is_dir():
            rows += table(known, folder, options.heads)
    print(markdown(HEADER, rows), flush=True)
    if options.picture:
        picture(baked_scene(options.scenes[0]), options.picture)


if __name__ == "__main__":
    main()
