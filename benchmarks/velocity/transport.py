"""Transport by known velocities: the mass that a step gains, its error, and the order of its path in time.

    python -m benchmarks.velocity.transport [--speed 3] plume-1/truth.npz jet-1/truth.npz ...

`benchmarks.truth` bakes such files. The tables are Markdown. The gain in mass leaves out what flows out of the box.
Errors are relative L2 in the smoke and the two voxels around it, without the inlet. With `--speed`, which multiplies
the velocities, there is no truth and no error.
"""

from __future__ import annotations

import argparse
from collections.abc import Callable
from functools import partial
from pathlib import Path

import numpy as np
import numpy.typing as npt

from benchmarks.errors import relative_error
from benchmarks.tables import markdown
from benchmarks.velocity.pairs import Mask, away_from, near_smoke
from smokelift.evaluation.truth import Truth
from smokelift.transport import Velocity, advect, project

FRAMES = range(6, 22)
Array = npt.NDArray[np.float32]
Scheme = Callable[[Array, Velocity, float], Array]
CONSERVING: Scheme = partial(advect, conserve=True)
SCHEMES: dict[str, Scheme] = {
    "semi-Lagrangian": partial(advect, scheme="semi-lagrangian"),
    "MacCormack": advect,
    "MacCormack, conserve": CONSERVING,
}


def mass(density: Array) -> float:
    """Return the sum of a density over its voxels."""
    return float(density.sum(dtype=np.float64))


def carried(truth: Truth, speed: float, scheme: Scheme) -> tuple[float, float, float]:
    """Return the relative gain of mass in a step (mean) and in all of them, and the error of a step (mean)."""
    dt, steps, errors = speed * truth.dt, [], []
    density = truth.density(FRAMES.start)
    kept = mass(density)
    for frame in FRAMES:
        velocity, now = truth.velocity(frame), truth.density(frame)
        moved = scheme(now, velocity, dt)
        steps.append(mass(moved) / mass(CONSERVING(now, velocity, dt)) - 1)
        errors.append(relative_error(moved, truth.density(frame + 1), counted(truth, frame)))
        kept *= mass(CONSERVING(density, velocity, dt)) / mass(density)
        density = scheme(density, velocity, dt)
    return float(np.mean(steps)), mass(density) / kept - 1, float(np.mean(errors))


def counted(truth: Truth, frame: int) -> Mask:
    """Return the voxels near the smoke of the next frame and away from the inlet."""
    return near_smoke(truth.density(frame + 1)) & away_from(truth.inflow(frame) | truth.inflow(frame + 1))


def predicted(truth: Truth) -> npt.NDArray[np.float64]:
    """Return errors of the next velocity, and of the density that it carries.

    Each for one step along straight lines, a midpoint step and two half steps.
    """
    rows = []
    for frame in FRAMES[2::4]:
        velocity, dt = truth.velocity(frame), truth.dt
        middle = advect(velocity, velocity, dt / 2, scheme="semi-lagrangian")
        half = advect(velocity, velocity, dt / 2)
        found = [
            project(u)
            for u in (advect(velocity, velocity, dt), advect(velocity, middle, dt), advect(half, velocity, dt / 2))
        ]
        now, after = truth.density(frame + 1), truth.density(frame + 2)
        wanted = truth.velocity(frame + 1).centres()
        rows.append(
            [relative_error(u.centres(), wanted, counted(truth, frame)) for u in found]
            + [relative_error(advect(now, u, dt), after, counted(truth, frame + 1)) for u in found]
        )
    return np.asarray(np.mean(rows, axis=0))


def main() -> None:
    """Print the tables."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("truths", nargs="+", type=Path, metavar="TRUTH.npz")
    parser.add_argument("--speed", type=float, default=1.0)
    options = parser.parse_args()
    truths = {path.parent.name: Truth.load(path) for path in options.truths}
    rows = []
    for name, truth in truths.items():
        for scheme, step in SCHEMES.items():
            one, all_steps, error = carried(truth, options.speed, step)
            shown = f"{error:.4f}" if options.speed == 1 else ""
            rows.append([name, scheme, f"{one:+.2%}", f"{all_steps:+.1%}", shown])
    print(markdown(["scene", "", "mass, one step", f"mass, {len(FRAMES)} steps", "error"], rows), end="\n\n")
    if options.speed == 1:
        rows = []
        for name, truth in truths.items():
            cells = [f"{value:.3f}" for value in predicted(truth)]
            rows.append([name, ", ".join(cells[:3]), ", ".join(cells[3:])])
        header = ["scene", "next velocity: one, midpoint, two half steps", "density carried by it"]
        print(markdown(header, rows))


if __name__ == "__main__":
    main()
