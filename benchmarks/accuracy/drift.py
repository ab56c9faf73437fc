"""Whether a long run stays what it was: its figures by parts of the clip, beside the truth's.

    python -m benchmarks.accuracy.drift OUT SCENE [--runs balanced:detail=0 balanced] [--frames 500]

A SCENE is a folder with a truth.npz and what `benchmarks.truth.picture` makes of it. A run that is in OUT already,
where `benchmarks.accuracy` puts it, is not repeated. OUT gets drift.md: of every part the mass over the truth's, the
fastest smoke, and from consecutive frames in its middle the front and how like smoke it looks from all around.
"""

from __future__ import annotations

import argparse
from collections.abc import Iterator
from dataclasses import replace
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.accuracy.report import ORBIT_COLUMNS, Column, markdown
from benchmarks.accuracy.scenes import KnownScene, baked_scene
from benchmarks.accuracy.score import reconstructed, score
from smokelift.evaluation.truth import Truth
from smokelift.transport import Array

COLUMNS: list[Column] = [
    ("mass, least, largest", ["mass", "mass_least", "mass_largest"], ".2f"),
    ("fastest, median of frames (true)", ["fastest", "fastest_truth"], ".1f"),
    ("fastest, largest (true)", ["fastest_ever", "fastest_ever_truth"], ".1f"),
    ("PSNR input, new", ["psnr_0", "psnr_new"], ".1f"),
    *ORBIT_COLUMNS,
]


PARTS = 5

WATCHED = 24
"""Consecutive frames of a part whose pictures are compared."""


def parts_of(known: KnownScene, count: int) -> Iterator[KnownScene]:
    """Yield a scene that is scored on a part of its frames, for each of so many parts of about equal length."""
    edges = np.linspace(known.scored.start, known.scored.stop, count + 1).round().astype(int).tolist()
    for first, end in pairwise(edges):
        yield replace(known, name=f"frames {first} to {end - 1}", scored=range(first, end))


def watched(part: KnownScene) -> KnownScene:
    """Return a part that is scored on the `WATCHED` frames in its middle."""
    first = part.scored[max(0, len(part.scored) - WATCHED) // 2]
    return replace(part, scored=range(first, min(first + WATCHED, part.scored.stop)))


def course(known: KnownScene, truth: Truth, folder: Path) -> dict[str, float]:
    """Return the mass over the truth's and the largest speeds (m/s) of a run's frames, and those of the true ones."""
    masses, found, true = [], [], []
    for frame in known.scored:
        with np.load(folder / f"{frame - known.frames[0] + 1:04d}.npz") as file:
            density, velocity = file["density"], file["velocity"]
        share = truth.density(frame).size / density.size
        masses.append(share * density.sum(dtype=float) / max(truth.density(frame).sum(dtype=float), 1e-30))
        if frame > known.frames[0]:  # the first frame has no motion yet
            found.append(_largest(velocity))
            true.append(_largest(truth.velocity(frame - 1).centres()))
    speeds = {"": found, "_truth": true}
    return {
        "mass": float(np.mean(masses)),
        "mass_least": float(np.min(masses)),
        "mass_largest": float(np.max(masses)),
        **{
            f"fastest{when}{whose}": float(of(values))
            for whose, values in speeds.items()
            for when, of in (("", np.median), ("_ever", np.max))
        },
    }


def _largest(velocity: Array) -> float:
    return float(np.sqrt(np.square(velocity, dtype=np.float32).sum(-1).max()))


def main() -> None:
    """Reconstruct what is not there, and write the table."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.accuracy.drift", description="A long run by its parts.")
    parser.add_argument("out", type=Path)
    parser.add_argument("scene", type=Path, help="folder with truth.npz and its pictures")
    parser.add_argument("--runs", nargs="+", default=["balanced:detail=0", "balanced"])
    parser.add_argument("--frames", type=int, default=500)
    options = parser.parse_args()
    known = baked_scene(options.scene, options.frames)
    if known.truth is None:
        parser.error(f"{options.scene}: has no truth.npz")
    rows: list[dict[str, Any]] = []
    for run in options.runs:
        folder = options.out / "runs" / known.name / run
        reconstructed(known, run, folder)
        for part in parts_of(known, PARTS):
            rows.append(score(watched(part), run, folder) | course(part, known.truth, folder))
            print(markdown(rows[-1:], COLUMNS).splitlines()[-1], flush=True)
    (options.out / "drift.md").write_text(markdown(rows, COLUMNS) + "\n")


if __name__ == "__main__":
    main()
