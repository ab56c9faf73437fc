"""Find how thick baked smoke is by the texture behind it.

    python -m benchmarks.background.thickness SCENES/plume-1 SCENES/jet-2 ... [--every 2]

A scene is a folder that `benchmarks.truth.picture` filled. Thin smoke is the same with 0.3 of its optical depth.
"""

from __future__ import annotations

import argparse
from pathlib import Path

import numpy as np

from benchmarks.background.clips import Smoke, backdrop, exposed, filmed, sky, wall
from smokelift.footage.images import Picture
from smokelift.footage.plate import known_plate
from smokelift.scene import Medium
from smokelift.setup.background import find_plates
from smokelift.setup.light import ambient_sun
from smokelift.setup.smoke import sample_smoke
from smokelift.setup.thickness import smoke_thickness

THIN = 0.3


def main() -> None:
    """Print the source radiance over the true one: as the texture tells it, as it is taken, and as it was without."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("scenes", nargs="+", type=Path)
    parser.add_argument("--every", type=int, default=1, help="take every so many frames")
    options = parser.parse_args()
    print("| scene | smoke | behind | found | taken | without |")
    print("| --- " * 6 + "|")
    for folder in options.scenes:
        baked = Smoke.load(folder)
        baked = Smoke(baked.radiance[:: options.every], baked.transmittance[:: options.every])
        shape = (baked.radiance.shape[1], baked.radiance.shape[2])
        for kind, share in (("as baked", 1.0), ("thin", THIN)):
            smoke = baked.thinned(share)
            for behind, plate in (("brick wall", wall(shape)), ("sky", sky(shape)), ("black", backdrop(shape, 0))):
                print(f"| {folder.name} | {kind} | {behind} | {_row(smoke, plate, True)} |", flush=True)
            print(f"| {folder.name} | {kind} | brick wall, estimated | {_row(smoke, wall(shape), False)} |", flush=True)


def _row(smoke: Smoke, plate: Picture, given: bool) -> str:
    """Source radiance over the true one, three times."""
    true = float(smoke.radiance.sum() / (1 - smoke.transmittance).sum())
    clip = filmed(exposed(smoke.before(plate), np.ones(len(smoke.radiance))), "baked")
    plates = known_plate(plate, clip) if given else find_plates(clip, None, None).plates
    samples, medium = sample_smoke(clip, plates), Medium(albedo=1.0)
    measured = smoke_thickness(samples.textures).source
    taken, without = (
        float(np.mean(ambient_sun(samples, medium, source).irradiance)) / (4 * np.pi) / true
        for source in (measured, None)
    )
    said = "undetermined" if measured is None else f"{measured.mean() / true:.2f}"
    return f"{said} | {taken:.2f} | {without:.2f}"


if __name__ == "__main__":
    main()
