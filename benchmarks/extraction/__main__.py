"""Put baked smoke before plates, reconstruct the clips, and compare elements, volumes and new views with the truth.

    python -m benchmarks.extraction OUT SCENE... --plates planks sky --known given frame unknown --black
    python -m benchmarks.extraction OUT SCENE... --plates wall.jpg --known --crf 30 --noise 2 --drift

A SCENE is a folder with truth.npz and what `benchmarks.truth.picture` makes of it. A plate is one of `plates.PAINTED`
or `plates.PHOTOGRAPHS` (which are files of scikit-image), or the path of a picture. Of the plate a scene file knows the
picture (given), a frame of the clip without smoke (frame), or nothing (unknown); without any of them the clips
are only composed. Camera, box, medium and lights are given. With --black the same smoke before black follows, from
which nothing has to be separated.

OUT/SCENE-PLATE gets what `compose.compose` writes, and a sequence for each that is known. Rows are printed and added to
OUT/rows.csv; what is there already is neither composed, reconstructed nor scored again, so each state of the code has
an OUT of its own. `score.py` says what the figures mean: T rms, imprint, mass, mass up to optical depth 3, the fraction
of the faint tail that is kept, PSNR inside the smoke at the clip's pixels, PSNR of new views at 20, 45 and 90 degrees.
"""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

from benchmarks.extraction.compose import CRF, GIVEN, KNOWN, BakedSmoke, Filming, compose, folder_name
from benchmarks.extraction.plates import BLACK, PAINTED, PHOTOGRAPHS, plate_name
from benchmarks.extraction.rows import HEADER, Row, Rows, cells
from benchmarks.extraction.score import score_densities
from benchmarks.process import run_module, why_it_ended
from benchmarks.tables import markdown
from smokelift import Sequence as SmokeSequence
from smokelift.scene import completed
from smokelift.setup.settings import QUALITIES

RESOLUTION = "48,48,72"
"""Voxels of the reconstructions: three quarters of the baked scenes', so that no voxel of theirs is one of ours."""


def main(arguments: Sequence[str] | None = None) -> None:
    """Compose, reconstruct and score what is not there, and print a row for each."""
    parser = argparse.ArgumentParser(
        prog="python -m benchmarks.extraction",
        description="Score how well smoke is separated from what stands behind it.",
    )
    parser.add_argument("out", type=Path)
    parser.add_argument("scenes", type=Path, nargs="+", help="folders with truth.npz and its pictures")
    named = ", ".join([*PAINTED, *PHOTOGRAPHS])
    parser.add_argument("--plates", nargs="*", default=["planks", "sky"], help=f"{named}, or pictures")
    parser.add_argument("--known", nargs="*", choices=KNOWN, default=list(KNOWN), help="of the plate")
    parser.add_argument("--black", action="store_true", help="the same smoke before black, too")
    parser.add_argument("--frames", type=int, default=28, help="of every scene, from its first")
    parser.add_argument("--quality", choices=QUALITIES, default="balanced")
    parser.add_argument("--resolution", default=RESOLUTION, help="voxels X,Y,Z of the reconstructions, or auto")
    parser.add_argument("--crf", type=int, default=CRF, help="of H.264")
    parser.add_argument("--noise", type=float, default=0.0, help="per cent of the range of sRGB values")
    parser.add_argument("--drift", action="store_true", help="exposure and white balance drift")
    options = parser.parse_args(arguments)
    filming = Filming(options.crf, options.noise / 100, options.drift)
    rows = Rows.read(options.out / "rows.csv")
    wanted = [(plate, known) for plate in options.plates for known in options.known]
    if options.black and (BLACK, GIVEN) not in wanted:
        wanted.append((BLACK, GIVEN))
    print(markdown(HEADER, []), flush=True)
    for scene in options.scenes:
        smoke = BakedSmoke.load(scene, options.frames)
        for plate in options.plates:
            compose(smoke, plate, filming, options.out / folder_name(smoke.name, plate, filming))
        for plate, known in wanted:
            row = Row(smoke.name, plate_name(plate) + filming.name, known, options.quality, options.resolution)
            if (found := rows.find(row)) is None:
                folder = options.out / folder_name(smoke.name, plate, filming)
                found = measured(row, smoke, plate, filming, folder)
                rows.add(found)
            print(f"| {' | '.join(cells(found))} |", flush=True)


def measured(row: Row, smoke: BakedSmoke, plate: str, filming: Filming, folder: Path) -> Row:
    """Return a row with its figures, or with the sentence in which the engine refused."""
    composed = compose(smoke, plate, filming, folder)
    resolution = row.resolution.replace(",", "x")
    refused = reconstruct(folder / f"{row.known}.toml", folder / f"{row.known}-{row.quality}-{resolution}", row)
    if refused is not None:
        return replace(row, refused=refused)
    sequence = SmokeSequence.open(folder / f"{row.known}-{row.quality}-{resolution}")
    scene = completed(sequence.scene)
    figures = score_densities(scene, lambda frame: sequence.density(frame + 1), smoke, composed)
    return replace(row, figures=figures)


def reconstruct(scene: Path, out: Path, row: Row) -> str | None:
    """Reconstruct a scene file by the command line, unless that is done; returns the sentence of a refusal."""
    if (out / "sequence.json").exists() and SmokeSequence.open(out).complete:
        return None
    words = [str(scene), "--out", str(out), "--npz", "--quality", row.quality, "--resolution", row.resolution]
    resume = ["--resume"] if (out / "sequence.json").exists() else []
    ended = run_module("smokelift", "reconstruct", *words, *resume)
    return None if ended.returncode == 0 else why_it_ended(ended)


if __name__ == "__main__":
    main()
