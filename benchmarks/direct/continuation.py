"""Clips cut at two thirds and continued, beside what really came.

    python -m benchmarks.direct.continuation SCENES/plume-3 ... [--runs OUT/runs] [--picture FILE.png]

Every scene is continued from its true densities and velocities and, where OUT/runs holds a run `balanced` of
`benchmarks.accuracy`, from that. It is compared with the last frame held, and with the last frame carried on by its
velocity.
"""

import argparse
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import numpy.typing as npt

from benchmarks.accuracy.scenes import KnownScene, baked_scene
from benchmarks.direct.clips import density_error, picture_psnr, reconstructed_moment, true_moment
from benchmarks.tables import markdown
from smokelift.direct import Moment, fit_simulation, spun_up
from smokelift.direct.continuation import FITTED_MOMENTS
from smokelift.output.images import eight_bit
from smokelift.output.sheet import write_sheet
from smokelift.transport import Array, advect, divergence

RUN = "balanced"
HEADER = ["scene", "from", "", "error", "error, last frame", "new views (dB)", "mass over the truth's", "divergence"]


def ways(moments: list[Moment], frames: int, dt: float) -> Iterator[tuple[str, list[Moment]]]:
    """Yield every way to continue moments by so many frames, with its moments."""
    last = moments[-1]
    yield "held", [last] * frames
    carried = [last]
    for _ in range(frames):
        density = advect(carried[-1].density, last.velocity, dt, conserve=True)
        carried.append(Moment(density, last.velocity))
    yield "carried", carried[1:]
    fitted = moments[-FITTED_MOMENTS:]
    simulation = fit_simulation(fitted, dt)
    simulated = [spun_up(simulation, fitted)]
    for step in range(1, frames + 1):
        simulated.append(simulation.next(simulated[-1], step))
    yield "simulated", simulated[1:]


def largest_divergence(moment: Moment) -> float:
    """Return the largest |div u| times voxel size over the largest |u|."""
    largest = max(float(np.abs(component).max()) for component in moment.velocity.faces)
    return float(np.abs(divergence(moment.velocity)).max()) * moment.velocity.voxel_size / largest


def table(known: KnownScene, folder: Path | None) -> Iterator[list[str]]:
    """Yield the rows of a scene from its truth, or from a run in a folder."""
    truth = known.truth
    assert truth is not None
    count = truth.frames if folder is None else len(list(folder.glob("[0-9]*.npz")))
    cut = 2 * count // 3
    if folder is None:
        moments = [true_moment(truth, frame) for frame in range(max(1, cut - FITTED_MOMENTS), cut)]
    else:
        moments = [reconstructed_moment(folder, truth, frame) for frame in range(max(1, cut - FITTED_MOMENTS), cut)]
    frames = range(cut, count)
    run, at = ("truth", Path()) if folder is None else (RUN, folder)
    for how, found in ways(moments, len(frames), truth.dt):
        errors = [density_error(m.density, truth.density(f)) for m, f in zip(found, frames, strict=True)]
        views = picture_psnr(known, [m.density for m in found[::3]], frames[::3], run, at)
        share = truth.density(cut).size / found[-1].density.size
        mass = share * found[-1].density.sum(dtype=float) / truth.density(frames[-1]).sum(dtype=float)
        figures = [f"{np.mean(errors):.2f}", f"{errors[-1]:.2f}", f"{views:.1f}", f"{mass:.2f}"]
        yield [known.name, "truth" if folder is None else "clip", how, *figures, f"{largest_divergence(found[-1]):.0e}"]


def tile(density: Array, white: float) -> npt.NDArray[np.uint8]:
    """Return the mean density along y as a picture, z up."""
    return eight_bit(np.repeat((density.mean(axis=1).T[::-1] / white)[..., None].astype(np.float32), 3, axis=-1))


def picture(known: KnownScene, path: Path) -> None:
    """Write a sheet: what came and every way to continue, over time."""
    truth = known.truth
    assert truth is not None
    cut = 2 * truth.frames // 3
    frames = range(cut, truth.frames)
    moments = [true_moment(truth, frame) for frame in range(max(1, cut - FITTED_MOMENTS), cut)]
    shown = [0, len(frames) // 3, 2 * len(frames) // 3, len(frames) - 1]
    white = float(max(truth.density(f).mean(axis=1).max() for f in frames))
    columns = {"what came": [truth.density(frames[i]) for i in shown]}
    for how, found in ways(moments, len(frames), truth.dt):
        columns[how] = [found[i].density for i in shown]
    rows = [[tile(column[i], white) for column in columns.values()] for i in range(len(shown))]
    write_sheet(path, rows, tuple(columns), [f"+{i + 1}" for i in shown])


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("scenes", nargs="+", type=Path, metavar="SCENE")
    parser.add_argument("--runs", type=Path)
    parser.add_argument("--picture", type=Path, help="of the first scene")
    options = parser.parse_args()
    rows: list[list[str]] = []
    for scene in options.scenes:
        known = baked_scene(scene, 10**6)
        rows += table(known, None)
        if options.runs and (folder := options.runs / scene.name / RUN).is_dir():
            rows += table(known, folder)
    print(markdown(HEADER, rows), flush=True)
    if options.picture:
        picture(baked_scene(options.scenes[0], 10**6), options.picture)


if __name__ == "__main__":
    main()
