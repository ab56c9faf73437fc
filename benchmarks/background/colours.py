"""Find the smoke's own colour in clips of baked smoke, coloured and grey, in white and coloured light.

    python -m benchmarks.background.colours SCENES/plume-1 SCENES/jet-2 ...

A scene is a folder that `benchmarks.truth.picture` filled. Its radiance is multiplied by the colours of light and
smoke, as single scattering does.
"""

from __future__ import annotations

import argparse
import math
from pathlib import Path

import numpy as np
import numpy.typing as npt

from benchmarks.background.clips import Smoke, backdrop, exposed, filmed, sky, wall
from smokelift.footage.images import Picture
from smokelift.footage.plate import known_plate
from smokelift.setup.choice import UNDETERMINED
from smokelift.setup.smoke import sample_smoke
from smokelift.setup.smoke_colour import smoke_colour

Array = npt.NDArray[np.float64]

LIGHTS = {"white": (1.0, 1.0, 1.0), "4 degrees warm": (1.0, 0.93, 0.84), "10 degrees warm": (1.0, 0.82, 0.64)}
COLOURS = {
    "grey": (1.0, 1.0, 1.0),
    "pale dust": (1.0, 0.87, 0.7),
    "sepia dust": (1.0, 0.75, 0.48),
    "orange": (1.0, 0.5, 0.1),
    "red": (1.0, 0.2, 0.15),
    "violet": (0.6, 0.25, 1.0),
    "green": (0.3, 1.0, 0.35),
}


def main() -> None:
    """Print how often a colour was found, and how far it is from the smoke's."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("scenes", nargs="+", type=Path)
    smokes = [Smoke.load(folder) for folder in parser.parse_args().scenes]
    shape = (smokes[0].radiance.shape[1], smokes[0].radiance.shape[2])
    plates = {
        "black": backdrop(shape, 0),
        "brick wall": wall(shape),
        "sky": sky(shape),
        "blue sky": backdrop(shape, (0.25, 0.45, 0.9)),
        "lawn": wall(shape) * np.array([0.6, 1.4, 0.4], np.float32),
    }
    print("| light | smoke | " + " | ".join(plates) + " |")
    print("| --- " * (2 + len(plates)) + "|")
    for light, tint in LIGHTS.items():
        for name, colour in COLOURS.items():
            cells = [_cell(smokes, np.array(tint), np.array(colour), plate) for plate in plates.values()]
            print(f"| {light} | {name} | {' | '.join(cells)} |", flush=True)


def _cell(smokes: list[Smoke], light: Array, colour: Array, plate: Picture) -> str:
    """Scenes where a colour was found, and the mean angle between it and the smoke's in degrees."""
    angles = []
    for smoke in smokes:
        behind: Picture = (plate * light).astype(np.float32)
        pictures = smoke.radiance[..., None] * (colour * light) + smoke.transmittance[..., None] * behind
        clip = filmed(np.clip(exposed(pictures.astype(np.float32), np.ones(len(pictures))), 0, 1), "baked")
        found = smoke_colour(sample_smoke(clip, known_plate(behind, clip)), np.ones(3))
        if found.choice.chosen != UNDETERMINED:
            own = np.array(found.color)
            cosine = float(own @ colour / (np.linalg.norm(own) * np.linalg.norm(colour)))
            angles.append(math.degrees(math.acos(min(cosine, 1.0))))
    return f"{len(angles)} of {len(smokes)}" + (f", {np.mean(angles):.0f}" if angles else "")


if __name__ == "__main__":
    main()
