"""Errors of the depth at which smoke is placed, as the box reaches below it: a Markdown table.

By the floor contact, and where the depth of its lower end is given: upright at that depth, and as it is estimated.

    python -m benchmarks.accuracy.axis plume-1/truth.npz two-1/truth.npz crossing-1/truth.npz ...

`benchmarks.truth` bakes such files. Six cameras, at three heights before and behind the box, see the true densities as
optical depths without light or noise. The floor of the box lies some centimetres below the true one. Errors are root
mean squares (m) of the axis against the smoke's true mean depth, over the smoke of 24 frames by height.
"""

from __future__ import annotations

import argparse
from collections.abc import Iterator
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import numpy.typing as npt

from benchmarks.tables import markdown
from smokelift.checks.array_types import Doubles
from smokelift.density.axis import SmokeAxis
from smokelift.density.axis_cues import estimate_axis
from smokelift.evaluation.truth import Truth
from smokelift.render import Renderer
from smokelift.scene import Camera, Domain, Medium

FRAMES, OBSERVED = 24, 16
LOWER_END = 0.1
"""Fraction of the smoke's mass, from below, that is its lower end."""

BOX = (-1.0, -1.0, 0.0), (1.0, 1.0, 3.0)
CAMERAS = [(side, height) for side in (1, -1) for height in (1.0, 1.5, 2.5)]
LOWERED = (0.0, 0.04, 0.08, 0.12, 0.17, 0.25)
NAMES = ("the domain's axis", "upright at the lower end", "estimated", "estimated from the lower end")


@dataclass(frozen=True)
class AxisCase:
    """A scene from one of the cameras.

    Attributes
    ----------
    camera
    amounts
        Optical depths (rows, columns) of some frames.
    heights, mass, depths : (nz,)
        Of the truth: meters above the floor, mass, and mean depth away from the camera (m).
    """

    camera: Camera
    amounts: list[npt.NDArray[np.float32]]
    heights: Doubles
    mass: Doubles
    depths: Doubles


def shots(truth: Truth) -> Iterator[AxisCase]:
    """Yield the scene from all cameras."""
    h = truth.voxel_size
    across, heights = ((np.arange(n) + 0.5) * h for n in truth.shape[1:])
    densities = [truth.density(frame) for frame in range(FRAMES)]
    total = np.sum(densities, 0, dtype=np.float64).sum(0)
    mass = total.sum(0)
    mean = (total * (across + BOX[0][1])[:, None]).sum(0) / np.maximum(mass, 1e-9)
    domain = Domain(*BOX, truth.shape)
    for side, height in CAMERAS:
        camera = Camera.look_at((0, -7 * side, height), (0, 0, 1.5), fov_y_degrees=32, size=(128, 192))
        renderer = Renderer(camera, domain, Medium(extinction=5.0), (), np.ones(3, np.float32), "absorption")
        observed = np.unique(np.linspace(0, FRAMES - 1, OBSERVED).round().astype(int))
        amounts = [-np.log(np.maximum(renderer.image(densities[frame])[..., 0], 1e-9)) for frame in observed]
        seen = [np.where(amount > 0.01, amount, 0).astype(np.float32) for amount in amounts]
        yield AxisCase(camera, seen, heights, mass, side * mean)


def errors(path: Path) -> Doubles:
    """Return the errors (shots, lowered, 4) of a scene, of the axes that `NAMES` lists."""
    truth = Truth.load(path)
    h = truth.voxel_size
    table = []
    for shot in shots(truth):
        for lowered in LOWERED:
            below = round(lowered / h)
            low, shape = (*BOX[0][:2], BOX[0][2] - below * h), (*truth.shape[:2], truth.shape[2] + below)
            domain = Domain(low, BOX[1], shape)
            base = lower_end(shot)
            estimates = (estimate_axis(shot.amounts, shot.camera, domain, base=known).axis for known in (None, base))
            axes = (SmokeAxis.upright(), SmokeAxis.upright(base), *estimates)
            table.append([error(shot, domain, axis) for axis in axes])
    return np.reshape(table, (-1, len(LOWERED), len(NAMES)))


def lower_end(shot: AxisCase) -> float:
    """Return the mean depth (m) of the smoke's lower end."""
    low = np.cumsum(shot.mass) <= LOWER_END * shot.mass.sum()
    low[np.argmax(shot.mass > 0)] = True
    return float(np.average(shot.depths[low], weights=shot.mass[low]))


def error(shot: AxisCase, domain: Domain, found: SmokeAxis) -> float:
    """Return the error of an axis (m), weighted by the smoke's mass."""
    heights = shot.heights - domain.centre[2]
    difference = found.at(heights, np.zeros_like(heights)) - shot.depths
    return float(np.sqrt(np.average(difference**2, weights=shot.mass)))


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description="Measure the depth at which smoke is placed.")
    parser.add_argument("truth", type=Path, nargs="+", help="truth.npz of a scene")
    with ProcessPoolExecutor() as pool:
        found = np.concatenate(list(pool.map(errors, parser.parse_args().truth)))
    rows = [[name, *(f"{value:.3f}" for value in row)] for name, row in zip(NAMES, found.mean(0).T, strict=True)]
    print(markdown(["floor lowered by (cm)", *(f"{100 * lowered:.0f}" for lowered in LOWERED)], rows))


if __name__ == "__main__":
    main()
