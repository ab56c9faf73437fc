"""Find the background of clips whose background is known, or reconstruct them.

    python -m benchmarks.background SCENES/plume-1 SCENES/jet-2 ... [--only wall black] [--runs | --colors]

A scene is a folder that `benchmarks.truth.picture` filled. Without --runs only the background is looked for. With it
each clip whose volume is known is reconstructed, `balanced` without detail on 24 x 24 x 36 voxels, its camera, box,
medium and light given, and compared with the clean one. With --colors the smoke's own color is looked for.
"""

import argparse
import tempfile
import time
from collections.abc import Sequence
from dataclasses import replace
from functools import lru_cache, partial
from pathlib import Path

import numpy as np

from benchmarks.background.cases import CASES, SMOKES, VOLUMES, Case
from benchmarks.background.colors import print_colors
from benchmarks.baked import Baked
from benchmarks.disturbances.known import GRID, SIZE
from benchmarks.measure import Figures, optical_mass, reconstructed, view_figures
from benchmarks.plates import BRIGHT
from benchmarks.tables import line, markdown
from smokelift import Background, Clip, Domain, Frame, Settings
from smokelift.extraction.find_background import find_background
from smokelift.extraction.matte import matte
from smokelift.extraction.plate import Plate, known_plate, without_noise_light
from smokelift.footage.images import Picture, linear_to_srgb
from smokelift.output.images import write_image
from smokelift.scene import CompleteScene

FIGURES = ("plate", "lost", "missed", "false", "unknown")

SCORED = range(4, 40, 5)
"""Frames of a clip that is reconstructed in which it is scored."""


VISIBLE, CLEAR = 6.0, 0.5
"""8 bit codes of contrast from which smoke should be found, and up to which a pixel is clear."""

LOOKED_AT = 8
"""Frames of a clip."""


def plate_score(clip: Clip, plate: Plate, background: Picture, clean: Picture) -> dict[str, float]:
    """Judge the plate that was found for a clip.

    Parameters
    ----------
    clip, plate
        What was filmed, at its plate's exposure, and what was found behind it.
    background : (rows, columns, 3)
        The true background, linear.
    clean : (frames, rows, columns, 3)
        The true pictures, linear.

    Returns
    -------
    ``plate``: 95th percentile of the error where smoke passes (8 bit codes); ``lost``: fraction of the smoke's light
    that the plate holds; ``missed``: visible smoke outside the matte; ``false``: clear pixels inside it; ``unknown``:
    fraction of the picture.
    """
    truth = linear_to_srgb(background)
    missed, false, errors, lost, smoke = [], [], [], 0.0, 0.0
    touched = np.zeros(clean.shape[1:3], np.bool_)
    unknown = 0.0
    for number in clip.spread(LOOKED_AT):
        behind = plate.at(number)
        contrast = np.abs(linear_to_srgb(clean[number]) - truth).max(-1) * 255
        found = matte(clip.frame(number), behind).mask
        visible = contrast > VISIBLE
        touched |= visible
        if visible.any():
            missed.append(float((visible & ~found).sum() / visible.sum()))
        false.append(float(found[contrast < CLEAR].mean()) if (contrast < CLEAR).any() else 0.0)
        lost += float(np.abs(behind.image - background)[visible].sum())
        smoke += float(np.abs(clean[number] - background)[visible].sum())
        errors.append(np.abs(linear_to_srgb(behind.image) - truth).max(-1) * 255)
        unknown = float((behind.confidence < 0.5).mean())
    return {
        "plate": float(np.percentile(np.stack(errors)[:, touched], 95)),
        "lost": lost / smoke,
        "missed": float(np.mean(missed)),
        "false": float(np.mean(false)),
        "unknown": unknown,
    }


def plate_row(case: Case, scenes: Sequence[Baked]) -> list[str]:
    """Return the cells of a case: the mean over scenes of the plate's figures, and the worst."""
    rows, seconds = [], 0.0
    for baked in scenes:
        seen = SMOKES[case.smoke](baked.front)
        clip, background = case.clip(seen), case.background(seen)
        began = time.process_time()
        if case.given:
            plate, _ = known_plate(background, clip)
            clip = without_noise_light(clip, plate.noise).exposed(plate.gain)
        else:
            found = find_background(clip, None, None)
            plate, clip = found.plate, found.clip
        seconds += time.process_time() - began
        rows.append(plate_score(clip, plate, background, case.clean(seen)))
    figures = {name: [row[name] for row in rows] for name in FIGURES}
    cells = [f"{np.mean(figures['plate']):.1f} ({np.max(figures['plate']):.1f})"]
    cells += [f"{np.mean(figures[name]):.1%} ({np.max(figures[name]):.1%})" for name in FIGURES[1:]]
    return [*cells, f"{seconds / len(rows):.1f}"]


def run_figures(case: Case, baked: Baked) -> Figures:
    """Reconstruct a case in this process.

    Returns
    -------
    ``psnr_new`` of the scored frames, before black, or before a bright sky if the smoke is dark; and ``mass``, the
    extinction times volume beside the truth's.
    """
    smoke = VOLUMES[case.smoke](baked)
    assert smoke.scene.domain is not None
    with tempfile.TemporaryDirectory() as folder:
        background = None
        if case.given:
            path = Path(folder) / "plate.exr"
            write_image(path, case.background(smoke.front), half=False)
            background = Background(image=path)
        scene = replace(
            smoke.scene,
            domain=Domain(smoke.scene.domain.min, smoke.scene.domain.max, GRID),
            medium=smoke.scene.medium if case.medium else None,
            background=background,
        )
        settings = replace(Settings.preset(), detail=0.0)
        return reconstructed(case.clip(smoke.front), scene, settings, partial(_run_score, case, smoke))


def _run_score(case: Case, smoke: Baked, estimated: CompleteScene, frames: list[Frame]) -> Figures:
    small = smoke.at(SCORED).sized(SIZE)
    behind = np.full(3, BRIGHT if case.smoke == "dark" else 0, np.float32)
    figures = view_figures(
        estimated,
        lambda k: frames[SCORED[k]].density,
        small.cameras,
        lambda view, k: small.views[view].at([k]).before(behind, case.color)[0],
        range(len(SCORED)),
        behind,
    )
    found_mass = optical_mass(estimated, np.stack([frames[number].density for number in SCORED]))
    return figures | {"mass": found_mass / optical_mass(small.scene, small.densities)}


def run_row(clean: Sequence[Figures], spoiled: Sequence[Figures] | None) -> list[str]:
    """Return the cells of a clean clip in all scenes, or of one that is compared with it."""
    if any("refused" in figures for figures in (*clean, *(spoiled or ()))):
        return ["refused", "refused"]
    views, mass = (np.array([float(each[name] or np.nan) for each in clean]) for name in ("psnr_new", "mass"))
    if spoiled is None:
        return [f"{views.mean():.1f}", f"{mass.mean():.2f}"]
    views = np.array([float(each["psnr_new"] or np.nan) for each in spoiled]) - views
    mass = np.array([float(each["mass"] or np.nan) for each in spoiled]) / mass - 1
    worst = mass[np.abs(mass).argmax()]
    return [f"{views.mean():+.1f} ({views.min():+.1f})", f"{mass.mean():+.0%} ({worst:+.0%})"]


def main(arguments: Sequence[str] | None = None) -> None:
    """Print a table row by row."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("scenes", nargs="+", type=Path)
    parser.add_argument("--only", nargs="*", default=[""], help="cases whose names begin so")
    parser.add_argument("--runs", action="store_true", help="new views and mass beside the clean clip")
    parser.add_argument("--colors", action="store_true", help="angles from the smoke's own color")
    options = parser.parse_args(arguments)
    scenes = [Baked.load(folder, views=("0", "20", "45", "90") if options.runs else "0") for folder in options.scenes]
    if options.colors:
        print_colors(scenes)
        return
    cases = {name: case for name, case in CASES.items() if name.startswith(tuple(options.only))}
    if not options.runs:
        header = ("plate error (codes)", "smoke's light lost", "smoke missed", "clear pixels masked", "unknown", "s")
        print(markdown(["case", *header]), flush=True)
        for name, case in cases.items():
            if case.medium:
                print(line([name, *plate_row(case, scenes)]), flush=True)
        return
    measured = lru_cache(maxsize=None)(lambda case: [run_figures(case, baked) for baked in scenes])
    print(markdown(["case", "new views (dB)", "mass"]), flush=True)
    for name, case in cases.items():
        if case.smoke in VOLUMES:
            spoiled = None if case == case.undisturbed else measured(case)
            print(line([name, *run_row(measured(case.undisturbed), spoiled)]), flush=True)


if __name__ == "__main__":
    main()
