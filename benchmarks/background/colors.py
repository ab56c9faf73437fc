"""Whether the smoke's own color is found, of baked smoke before several backgrounds.

Its radiance is multiplied by the colors of light and smoke, as single scattering does. A cell has the scenes where the
smoke's own color was found, and the mean angle between it and the true one in degrees.
"""

import math
from collections.abc import Sequence

import numpy as np

from benchmarks.baked import Baked, Seen
from benchmarks.filming import exposed, filmed
from benchmarks.plates import PAINTED, of_one_color
from benchmarks.tables import line, markdown
from smokelift.checks import UNDETERMINED, Doubles
from smokelift.extraction.plate import known_plate
from smokelift.footage.images import Picture
from smokelift.setup.first_estimate import sample_smoke
from smokelift.setup.illumination import smoke_color

LIGHTS = {"white": (1.0, 1.0, 1.0), "4 degrees warm": (1.0, 0.93, 0.84), "10 degrees warm": (1.0, 0.82, 0.64)}
COLORS = {
    "gray": (1.0, 1.0, 1.0),
    "pale dust": (1.0, 0.87, 0.7),
    "sepia dust": (1.0, 0.75, 0.48),
    "orange": (1.0, 0.5, 0.1),
    "red": (1.0, 0.2, 0.15),
    "violet": (0.6, 0.25, 1.0),
    "green": (0.3, 1.0, 0.35),
}


def print_colors(scenes: Sequence[Baked]) -> None:
    """Print the table row by row."""
    smokes = [baked.front for baked in scenes]
    shape = smokes[0].shape
    wall = PAINTED["wall"](*shape)
    plates = {
        "black": of_one_color(*shape, 0),
        "brick wall": wall,
        "sky": PAINTED["clouds"](*shape),
        "blue sky": of_one_color(*shape, (0.25, 0.45, 0.9)),
        "lawn": wall * np.array([0.6, 1.4, 0.4], np.float32),
    }
    print(markdown(["light", "smoke", *plates]), flush=True)
    for light, tint in LIGHTS.items():
        for name, color in COLORS.items():
            cells = [_angles(smokes, np.array(tint), np.array(color), plate) for plate in plates.values()]
            print(line([light, name, *cells]), flush=True)


def _angles(smokes: Sequence[Seen], light: Doubles, color: Doubles, plate: Picture) -> str:
    angles = []
    behind: Picture = (plate * light).astype(np.float32)
    for smoke in smokes:
        clip = filmed(np.clip(exposed(smoke.before(behind, tuple(color * light))), 0, 1))
        known, shown = known_plate(behind, clip)
        found, estimate = smoke_color(sample_smoke(shown, known), np.ones(3))
        if estimate.value != UNDETERMINED:
            own = np.array(found)
            cosine = float(own @ color / (np.linalg.norm(own) * np.linalg.norm(color)))
            angles.append(math.degrees(math.acos(min(cosine, 1.0))))
    return f"{len(angles)} of {len(smokes)}" + (f", {np.mean(angles):.0f}" if angles else "")
