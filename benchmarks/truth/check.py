"""Check baked scenes: figures of the flow in every frame, and a sheet with pictures of all scenes.

    python -m benchmarks.truth.check SHEET.png plume-1/truth.npz ... [--frames]

Means and extremes over the frames are printed, and every frame on request.
"""

from __future__ import annotations

import argparse
from dataclasses import astuple, dataclass
from pathlib import Path

import matplotlib
import numpy as np
from scipy import ndimage

from smokelift.evaluation.truth import Truth
from smokelift.transport import advect, divergence

matplotlib.use("Agg")
from matplotlib import pyplot

SHOWN = (0, 13, 26, 39)
EXTINCTION = 5.0  # 1/m per unit of density, as in the pictures


@dataclass(frozen=True)
class Figures:
    """Figures of the flow in one frame.

    Attributes
    ----------
    mass
        Sum of the density times a voxel's volume (m3).
    densest
        Largest density.
    mean_speed, fastest
        Mean and largest speed in smoke (voxels a frame).
    divergence
        Largest divergence in smoke, two voxels from the inlet (per frame).
    warp_error
        Relative L2 error of the density that the velocity carries, against the next frame's, without the inlet.
    unmoved_error
        The same error of the density that stays where it is.
    """

    mass: float
    densest: float
    mean_speed: float
    fastest: float
    divergence: float
    warp_error: float
    unmoved_error: float


def figures(truth: Truth, frame: int) -> Figures:
    """Find the figures of a frame that has a next one."""
    before, after, velocity = truth.density(frame), truth.density(frame + 1), truth.velocity(frame)
    inlet = truth.inflow(frame) | truth.inflow(frame + 1)
    smoke = after > 0.01 * after.max()
    free = smoke & ~ndimage.binary_dilation(inlet, iterations=2)
    speed = np.linalg.norm(velocity.centres(), axis=-1)[smoke] * truth.dt / truth.voxel_size
    carried = advect(before, velocity, truth.dt)

    def error(found: np.ndarray) -> float:
        return float(np.linalg.norm((found - after)[~inlet]) / np.linalg.norm(after[~inlet]))

    return Figures(
        mass=float(before.sum(dtype=float)) * truth.voxel_size**3,
        densest=float(before.max()),
        mean_speed=float(speed.mean()),
        fastest=float(speed.max()),
        divergence=float(np.abs(divergence(velocity)[free]).max()) * truth.dt,
        warp_error=error(carried),
        unmoved_error=error(before),
    )


def projections(truth: Truth, frame: int) -> np.ndarray:
    """Opacity from the front and from the side [row, column], beside one another."""
    depth = EXTINCTION * truth.voxel_size * truth.density(frame)
    views = [1 - np.exp(-depth.sum(axis)).T[::-1] for axis in (1, 0)]
    return np.hstack([np.pad(view, 1, constant_values=0.5) for view in views])


def line(name: str, row: tuple[float, ...]) -> str:
    """Lay out a line of the table."""
    return f"{name:24s}" + "".join(f"{value:10.3f}" for value in row)


def main() -> None:
    """Print a table and draw the sheet."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("sheet", type=Path)
    parser.add_argument("truths", type=Path, nargs="+")
    parser.add_argument("--frames", action="store_true", help="every frame, not only means")
    options = parser.parse_args()
    sheet, axes = pyplot.subplots(
        len(options.truths), len(SHOWN), figsize=(12, 2.6 * len(options.truths)), squeeze=False, layout="compressed"
    )
    print(" " * 24 + "".join(f"{name.replace('_', ' '):>10s}"[:10] for name in Figures.__dataclass_fields__))
    for path, row in zip(options.truths, axes, strict=True):
        truth, name = Truth.load(path), path.parent.name
        rows = [astuple(figures(truth, frame)) for frame in range(truth.frames - 1)]
        for frame, values in enumerate(rows if options.frames else []):
            print(line(f"{name} {frame}", values))
        print(line(f"{name} mean", tuple(np.mean(rows, axis=0))))
        print(line(f"{name} largest", tuple(np.max(rows, axis=0))), flush=True)
        for frame, axis in zip(SHOWN, row, strict=True):
            axis.imshow(projections(truth, frame), cmap="gray", vmin=0, vmax=1)
            axis.set_title(f"{name}, frame {frame}: front, side", fontsize=9)
            axis.set_axis_off()
    sheet.savefig(options.sheet, dpi=60, bbox_inches="tight")


if __name__ == "__main__":
    main()
