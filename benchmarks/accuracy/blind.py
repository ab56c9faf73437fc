"""A blind trial: sheets on which the true smoke and some runs lie below each other in random order, without names.

    python -m benchmarks.accuracy.blind OUT RUNS SCENE... [--runs balanced:detail=0 balanced]

RUNS is the folder `runs` that `benchmarks.accuracy` left, with the densities of the runs; a SCENE is one of its
folders. Every scene is a trial: OUT/01.png, ... show consecutive frames of A, B and C from 45 and 90 degrees, which the
runs did not see. OUT/key.json says which is which: whoever judges must not see it. All are rendered by Smokelift, so
that no renderer gives the truth away.
"""

from __future__ import annotations

import argparse
import json
import string
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.accuracy.scenes import KnownScene, baked_scene
from benchmarks.accuracy.score import BETWEEN, BLACK, SIDE, known_densities
from smokelift.footage.images import area_average
from smokelift.output.images import eight_bit
from smokelift.output.sheet import Tile, write_sheet
from smokelift.render import scene_renderer

ANGLES = (BETWEEN, SIDE)

FRAMES = 4
"""Consecutive ones from each angle: enough to see what moves on and what pops up."""

FIRST = 8
"""Frames of a clip that are not shown: the first ones have hardly any before them to start from."""

SHOWN = 0.75
"""Size of a tile against the camera's picture."""


def trial(known: KnownScene, runs: list[str], folder: Path, rng: np.random.Generator) -> tuple[list[Any], list[str]]:
    """Return a sheet's rows of tiles in random order, and whose they are.

    Parameters
    ----------
    known
        The scene.
    runs
        Names of runs with densities, or "truth".
    folder
        That holds a folder of each run.
    rng
        Chooses frames and order.
    """
    last = len(known.scored) - FRAMES
    first = int(rng.integers(min(FIRST, last), last + 1))
    order = [runs[index] for index in rng.permutation(len(runs))]
    return [_row(known, run, folder / run, known.scored[first : first + FRAMES]) for run in order], order


def _row(known: KnownScene, run: str, folder: Path, frames: range) -> list[Tile]:
    if (densities := known_densities(known, run, folder)) is None:
        raise ValueError(f"{run}: has no densities to look at from elsewhere.")
    shown = []
    for angle in ANGLES:
        renderer = scene_renderer(densities.scene, known.cameras[angle], BLACK)
        for frame in frames:
            picture = renderer.image(densities.of_frame(frame))
            rows, columns = (round(SHOWN * count) for count in picture.shape[:2])
            shown.append(eight_bit(area_average(picture, columns, rows)))
    return shown


def main() -> None:
    """Write sheets and key."""
    parser = argparse.ArgumentParser(
        prog="python -m benchmarks.accuracy.blind", description="Sheets for a blind trial."
    )
    parser.add_argument("out", type=Path)
    parser.add_argument("done", type=Path, metavar="RUNS", help="folder with SCENE/RUN of benchmarks.accuracy")
    parser.add_argument("scenes", type=Path, nargs="+", help="folders with truth.npz and its pictures")
    parser.add_argument("--runs", nargs="+", default=["balanced:detail=0", "balanced"], help="beside the truth")
    parser.add_argument("--frames", type=int, default=24, help="of every scene that the runs have")
    parser.add_argument("--seed", type=int, default=0, help="of the order")
    options = parser.parse_args()
    options.out.mkdir(parents=True, exist_ok=True)
    rng = np.random.default_rng(options.seed)
    titles = [f"{angle} degrees, {number}" for angle in ANGLES for number in range(1, FRAMES + 1)]
    key = {}
    for number, path in enumerate(options.scenes, 1):
        known = baked_scene(path, options.frames)
        rows, order = trial(known, ["truth", *options.runs], options.done / known.name, rng)
        letters = string.ascii_uppercase[: len(order)]
        write_sheet(options.out / f"{number:02d}.png", rows, titles, list(letters))
        key[f"{number:02d}"] = {"scene": known.name, **dict(zip(letters, order, strict=True))}
    (options.out / "key.json").write_text(json.dumps(key, indent=1) + "\n")


if __name__ == "__main__":
    main()
