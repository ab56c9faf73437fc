"""How near reconstructions from the front video alone come to the truth: volumes, motion, and views from elsewhere.

    python -m benchmarks.accuracy OUT SCENE... [--runs balanced paper billboard ...] [--frames 24]
    python -m benchmarks.accuracy OUT --real FOLDER [--runs balanced billboard ...]

A SCENE is a folder with a truth.npz and what `benchmarks.truth.picture` makes of it. A run is a reconstruction, as
`benchmarks.accuracy.runs` reads its name, or one of four references: `billboard` (the front picture, unshifted, in
every view), `blurred` (the same, blurred), `truth` (the true density in Smokelift's renderer), `black`. Each
reconstruction has a process of its own; one that is in OUT already is not repeated.

The FOLDER of the ScalarFlow capture has scene.toml and any number of cameraNN.toml. Every tenth frame of 10 to 110 is
compared at 270 x 480, as the cameras are calibrated and registered (the recordings moved as FluidNexus moves them), and
each also with one gain per camera.

OUT gets accuracy.md, accuracy.csv and accuracy.png (real.* with --real).
"""

import argparse
from datetime import date
from pathlib import Path

from benchmarks.accuracy.report import contact_sheet, markdown, table_columns, write
from benchmarks.accuracy.runs import SMEAR
from benchmarks.accuracy.scenes import KnownScene, baked_scene, captured_scene
from benchmarks.accuracy.score import score
from benchmarks.machine import processor

PLAUSIBLE_AND_SMOOTH = ("balanced", "balanced:detail=0")
"""The default, whose detail in depth is made up, and the answer without it, which is the nearer one in PSNR."""

SHOWN = ("balanced:detail=0", "billboard", "paper")
"""Runs on the contact sheet, behind the truth and the first run, unless others are asked for."""


def main() -> None:
    """Reconstruct what is not there, score everything, write table, CSV and sheet."""
    parser = argparse.ArgumentParser(
        prog="python -m benchmarks.accuracy", description="Score reconstructions beside the truth."
    )
    parser.add_argument("out", type=Path)
    parser.add_argument("scenes", type=Path, nargs="*", help="folders with truth.npz and its pictures")
    parser.add_argument("--real", type=Path, metavar="FOLDER", help="the ScalarFlow capture instead of scenes")
    parser.add_argument("--runs", nargs="+", help="qualities, paper, changes of them, baselines")
    parser.add_argument("--show", nargs="+", metavar="RUN", help="runs on the contact sheet")
    parser.add_argument("--frames", type=int, default=24, help="of every scene, from its first")
    options = parser.parse_args()
    if (options.real is None) == (not options.scenes):
        parser.error("give folders of scenes, or --real FOLDER")
    if options.real is not None:
        scenes, name = [captured_scene(options.real, registered=moved) for moved in (False, True)], "real"
        runs = options.runs or [*PLAUSIBLE_AND_SMOOTH, "billboard", "blurred", "black"]
    else:
        scenes, name = [baked_scene(folder, options.frames) for folder in options.scenes], "accuracy"
        runs = options.runs or [*PLAUSIBLE_AND_SMOOTH, "paper", SMEAR, "billboard", "truth"]
    out: Path = options.out
    out.mkdir(parents=True, exist_ok=True)

    def folder(known: KnownScene, run: str) -> Path:
        return out / "runs" / known.scene_path.parent.name / run

    where = {"machine": processor(), "date": date.today().isoformat()}
    rows = []
    for done, known in enumerate(scenes, 1):  # written after every scene: the next may take an hour
        for run in runs:
            rows.append(score(known, run, folder(known, run)) | where)
            for columns in table_columns(known):
                print(markdown(rows[-1:], columns).splitlines()[-1], flush=True)
        write(out, name, rows, scenes[:done])
        shown = options.show or [run for run in dict.fromkeys([runs[0], *SHOWN]) if run in runs]
        contact_sheet(scenes[:done], shown, folder, out / f"{name}.png")


if __name__ == "__main__":
    main()
