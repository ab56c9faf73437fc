"""Transport by known velocities: mass, detail, and whether a bent way back pays. A table in Markdown.

    python -m benchmarks.velocity.transport [--speed 3] plume-1/truth.npz jet-1/truth.npz ...

benchmarks/truth bakes such files. Mass is compared with what is left after what goes out of the box; errors are
relative L2 in the smoke and the two voxels around it, without the inlet. `--speed` multiplies the velocities; then
there are no errors, for there is no truth.
"""

from __future__ import annotations

import argparse
from pathlib import Path

import numpy as np
import numpy.typing as npt
from scipy import ndimage

from smokelift.evaluation.truth import Truth
from smokelift.transport import advect, project

FRAMES = range(6, 22)
Array = npt.NDArray[np.float32]
WAYS = {
    "semi-Lagrangian": {"scheme": "semi-lagrangian"},
    "MacCormack": {},
    "MacCormack, conserve": {"conserve": True},
}


def mass(density: Array) -> float:
    """In voxels at density 1."""
    return float(density.sum(dtype=np.float64))


def carried(truth: Truth, speed: float, way: dict[str, object]) -> tuple[float, float, float]:
    """Mass gained in a step (mean) and in all of them, and the error of a step (mean)."""
    dt, steps, errors = speed * truth.dt, [], []
    density = truth.density(FRAMES.start)
    kept = mass(density)
    for frame in FRAMES:
        velocity, now = truth.velocity(frame), truth.density(frame)
        moved = advect(now, velocity, dt, **way)
        steps.append(mass(moved) / mass(advect(now, velocity, dt, conserve=True)) - 1)
        errors.append(error(moved, truth.density(frame + 1), near(truth, frame)))
        kept *= mass(advect(density, velocity, dt, conserve=True)) / mass(density)
        density = advect(density, velocity, dt, **way)
    return float(np.mean(steps)), mass(density) / kept - 1, float(np.mean(errors))


def near(truth: Truth, frame: int) -> npt.NDArray[np.bool_]:
    """The smoke of the next frame and two voxels around it, without the inlet."""
    after = truth.density(frame + 1)
    inlet = ndimage.binary_dilation(truth.inflow(frame) | truth.inflow(frame + 1))
    return ndimage.binary_dilation(after > 0.01 * after.max(), iterations=2) & ~inlet


def error(found: Array, wanted: Array, where: npt.NDArray[np.bool_]) -> float:
    """Relative L2."""
    return float(np.linalg.norm((found - wanted)[where]) / np.linalg.norm(wanted[where]))


def predicted(truth: Truth) -> npt.NDArray[np.float64]:
    """Errors of the next velocity, and of the density that it carries: one step, a midpoint step, two half steps."""
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
            [error(u.centres(), wanted, near(truth, frame)) for u in found]
            + [error(advect(now, u, dt), after, near(truth, frame + 1)) for u in found]
        )
    return np.mean(rows, axis=0)


def main() -> None:
    """Print the tables."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("truths", nargs="+", type=Path, metavar="TRUTH.npz")
    parser.add_argument("--speed", type=float, default=1.0)
    options = parser.parse_args()
    print("| scene | | mass, one step | mass, sixteen | error |")
    print("|---|---|---|---|---|")
    truths = {path.parent.name: Truth.load(path) for path in options.truths}
    for name, truth in truths.items():
        for way, arguments in WAYS.items():
            step, all_steps, wrong = carried(truth, options.speed, arguments)
            shown = f"{wrong:.4f}" if options.speed == 1 else ""
            print(f"| {name} | {way} | {step:+.2%} | {all_steps:+.1%} | {shown} |", flush=True)
    if options.speed == 1:
        print("\n| scene | next velocity: one, midpoint, two half steps | density carried by it |\n|---|---|---|")
        for name, truth in truths.items():
            cells = [f"{value:.3f}" for value in predicted(truth)]
            print(f"| {name} | {', '.join(cells[:3])} | {', '.join(cells[3:])} |", flush=True)


if __name__ == "__main__":
    main()
