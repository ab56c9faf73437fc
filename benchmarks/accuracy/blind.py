"""A blind trial: sheets on which the true smoke and some runs lie below each other in random order, without names.

    python -m benchmarks.accuracy.blind OUT RUNS SCENE... [--runs balanced:detail=0 balanced] [--sheets 12]

RUNS is the folder `runs` that `benchmarks.accuracy` left, with the densities of the runs; a SCENE is one of its
folders. OUT/01.png, ... each show one moment of A, B and C from ten azimuths, as an orbit page does; the SCENEs take
turns, each with another moment. OUT_key.json, beside OUT, says which is which, so that whoever gets the folder OUT
cannot see it. All are rendered by Smokelift, so that no renderer gives the truth away.
"""

from __future__ import annotations

import argparse
import json
import string
from pathlib import Path

import numpy as np

from benchmarks.accuracy.scenes import KnownScene, baked_scene
from benchmarks.accuracy.score import known_densities
from smokelift.evaluation.orbit import Orbit
from smokelift.evaluation.orbit_page import TITLES, orbit_tiles
from smokelift.output.sheet import Tile, write_sheet

FIRST = 8
"""Frames of a clip that are not shown: the first ones have hardly any before them to start from."""


def trial(
    known: KnownScene, runs: list[str], folder: Path, frame: int, rng: np.random.Generator
) -> tuple[list[list[Tile]], list[str]]:
    """Return a sheet's rows of tiles in random order, and whose they are.

    Parameters
    ----------
    known
        The scene.
    runs
        Names of runs with densities, or "truth".
    folder
        That holds a folder of each run.
    frame
        Of the clip.
    rng
        Chooses the order.
    """
    order = [runs[index] for index in rng.permutation(len(runs))]
    rows = []
    for run in order:
        if (densities := known_densities(known, run, folder / run)) is None:
            raise ValueError(f"{run}: has no densities to show from elsewhere.")
        rows.append(orbit_tiles(Orbit(densities.scene), densities.of_frame(frame)))
    return rows, order


def moments(known: KnownScene, count: int, rng: np.random.Generator) -> list[int]:
    """Return so many different frames of a scene in random order, none of the `FIRST` if there are others enough."""
    late = known.scored[min(FIRST, len(known.scored) - count) :]
    return [int(frame) for frame in rng.choice(late, count, replace=False)]


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
    parser.add_argument("--sheets", type=int, default=12)
    parser.add_argument("--seed", type=int, default=0, help="of moments and order")
    options = parser.parse_args()
    options.out.mkdir(parents=True, exist_ok=True)
    rng = np.random.default_rng(options.seed)
    scenes = [baked_scene(path, options.frames) for path in options.scenes]
    shown = [moments(known, -(-options.sheets // len(scenes)), rng) for known in scenes]
    key = {}
    for number in range(options.sheets):
        turn, index = divmod(number, len(scenes))
        known, frame = scenes[index], shown[index][turn]
        rows, order = trial(known, ["truth", *options.runs], options.done / known.name, frame, rng)
        letters = string.ascii_uppercase[: len(order)]
        name = f"{number + 1:02d}"
        write_sheet(options.out / f"{name}.png", rows, TITLES, list(letters))
        key[name] = {"scene": known.name, "frame": frame, **dict(zip(letters, order, strict=True))}
    options.out.with_name(f"{options.out.name}_key.json").write_text(json.dumps(key, indent=1) + "\n")


if __name__ == "__main__":
    main()
