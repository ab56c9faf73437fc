"""Put baked smoke before plates, reconstruct the clips, and compare elements, volumes and new views with the truth.

    python -m benchmarks.extraction OUT SCENE... --plates planks sky --known given frame unknown --black
    python -m benchmarks.extraction OUT SCENE... --plates wall.jpg --known --crf 30 --noise 2 --drift

A SCENE is a folder with truth.npz and what `benchmarks.truth.picture` makes of it. A plate is one of `plates.PAINTED`
or `plates.PHOTOGRAPHS` (which are files of scikit-image), or the path of a picture. Of the plate a scene file knows the
picture (given), a frame of the clip without smoke (frame), or nothing (unknown); without any of them the clips
are only composed. Camera, box, medium and lights are given; with --relit the latter two are not, and what is found is
shown in the true ones. With --black the same smoke before black follows, from
which nothing has to be separated.

OUT/SCENE-PLATE gets what `compose.compose` writes. Rows are printed and added to OUT/rows.csv; what is there already is
neither composed, reconstructed nor scored again, so each state of the code has an OUT of its own. `score.py` says what
the figures mean: T rms, imprint, mass, mass up to optical depth 3, the fraction of the faint tail that is kept, PSNR
inside the smoke at the clip's pixels, PSNR of new views at 20, 45 and 90 degrees.
"""

import argparse
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from benchmarks.baked import Baked
from benchmarks.extraction.compose import CRF, GIVEN, KNOWN, Composed, Filming, compose, folder_name
from benchmarks.extraction.score import score_densities
from benchmarks.measure import Figures, reconstructed
from benchmarks.plates import PAINTED, PHOTOGRAPHS, plate_name
from benchmarks.tables import Rows, cell, line, markdown, sizes_of
from smokelift import Clip, Frame, Scene, Settings
from smokelift.scene import CompleteScene, completed
from smokelift.setup.settings import QUALITIES

RESOLUTION = "48x48x72"
"""Voxels of the reconstructions: three quarters of the baked scenes', so that no voxel of theirs is one of ours."""

KEYS = ("scene", "plate", "known", "quality", "resolution")

COLUMNS = (
    ("T rms", "transmittance_error", ".3f"), ("imprint", "imprint", ".2f"), ("mass", "mass", ".2f"),
    ("mass, depth < 3", "thin_mass", ".2f"), ("tail kept", "tail", ".2f"), ("PSNR inside", "psnr", ".1f"),
    ("20 / 45 / 90", "psnr_20 psnr_45 psnr_90", ".1f"),
)  # fmt: skip
"""Headings, figures and their format."""

FIGURES = (*(name for _, names, _ in COLUMNS for name in names.split()), "radiance_error")


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
    parser.add_argument("--resolution", default=RESOLUTION, help="voxels of the reconstructions")
    parser.add_argument("--crf", type=int, default=CRF, help="of H.264")
    parser.add_argument("--noise", type=float, default=0.0, help="per cent of the range of sRGB values")
    parser.add_argument("--drift", action="store_true", help="exposure and white balance drift")
    parser.add_argument("--relit", action="store_true", help="give no lights and medium, and score in the true ones")
    options = parser.parse_args(arguments)
    filming = Filming(options.crf, options.noise / 100, options.drift)
    settings = Settings.preset(options.quality, resolution=sizes_of(options.resolution)[0])
    rows = Rows(options.out / "rows.csv", KEYS, FIGURES)
    wanted = [(plate, known) for plate in options.plates for known in options.known]
    if options.black and ("black", GIVEN) not in wanted:
        wanted.append(("black", GIVEN))
    print(markdown(["scene", "plate", "known", *(heading for heading, _, _ in COLUMNS)]), flush=True)
    for scene in options.scenes:
        smoke = Baked.load(scene, options.frames)
        for plate in options.plates:
            compose(smoke, plate, filming, options.out / folder_name(smoke.name, plate, filming))
        for plate, known in wanted:
            about = (smoke.name, plate_name(plate) + filming.name, known + ("-relit" if options.relit else ""))
            key = (*about, options.quality, options.resolution)
            if (figures := rows.find(key)) is None:
                folder = options.out / folder_name(smoke.name, plate, filming)
                figures = measured(
                    smoke, compose(smoke, plate, filming, folder), folder / f"{known}.toml", settings, options.relit
                )
                if "refused" not in figures:  # the next state of the code may not refuse
                    rows.add(key, figures)
                    figures = rows.find(key) or figures  # as rounded as they are when they are read again
            print(line([*about, *cells(figures)]), flush=True)


def measured(smoke: Baked, composed: Composed, path: Path, settings: Settings, relit: bool = False) -> Figures:
    """Reconstruct a scene file, and return its figures, or the sentence in which the engine refuses.

    If it is ``relit`` the file's lights and medium are not used, and the true ones show what is found.
    """
    true = completed(smoke.scene)

    def score(scene: CompleteScene, frames: list[Frame]) -> Figures:
        scale = np.float32(scene.medium.extinction / true.medium.extinction if relit else 1)
        if relit:
            scene = replace(scene, medium=true.medium, lights=true.lights, scattering=true.scattering)
        return score_densities(scene, lambda number: scale * frames[number].density, smoke, composed)

    described = Scene.load(path)
    if relit:
        described = replace(described, lights=(), medium=None, scattering=None)
    assert described.clip is not None
    with Clip.open(described.clip) as clip:
        return reconstructed(clip, described, settings, score)


def cells(figures: Figures) -> list[str]:
    """Return the cells of a row."""
    if "refused" in figures:
        return [f"refused: {figures['refused']}", *[""] * (len(COLUMNS) - 1)]
    return [cell(figures, names.split(), form) or "-" for _, names, form in COLUMNS]


if __name__ == "__main__":
    main()
