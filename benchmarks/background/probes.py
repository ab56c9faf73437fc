"""What is found of baked smoke whose colour and source radiance are known, before several backgrounds.

    python -m benchmarks.background.probes colour | source SCENES/plume-1 SCENES/jet-2 ... [--every 2]

A scene is a folder that `benchmarks.truth.picture` filled. Its radiance is multiplied by the colours of light and
smoke, as single scattering does. *Colour*: scenes where the smoke's own colour was found, and the mean angle between it
and the true one in degrees. *Source*: source radiance over the true one, as the extraction finds it, and as the smoke's
brightness alone would show it; thin smoke has 0.3 of its optical depth.
"""

import argparse
import math
from collections.abc import Iterator, Mapping
from pathlib import Path

import numpy as np

from benchmarks.background.clips import Smoke, backdrop, exposed, filmed, sky, wall
from smokelift.checks import UNDETERMINED
from smokelift.checks.array_types import Doubles
from smokelift.footage.backdrop import Backdrop, find_backdrop
from smokelift.footage.clip import Clip
from smokelift.footage.images import Picture
from smokelift.footage.plate import known_plate
from smokelift.setup.first_estimate import sample_smoke, with_source
from smokelift.setup.medium import smoke_colour, source_radiance

Plates = Mapping[str, Picture]

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

THIN = 0.3
"""Share of the optical depth that thin smoke has."""


def main() -> None:
    """Print the table of a probe, row by row."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("probe", choices=PROBES)
    parser.add_argument("scenes", nargs="+", type=Path)
    parser.add_argument("--every", type=int, default=1, help="take every so many frames")
    options = parser.parse_args()
    smokes = {folder.name: Smoke.load(folder) for folder in options.scenes}
    smokes = {
        name: Smoke(smoke.radiance[:: options.every], smoke.transmittance[:: options.every])
        for name, smoke in smokes.items()
    }
    _, rows, columns = next(iter(smokes.values())).radiance.shape
    shape = (rows, columns)
    plates = {"black": backdrop(shape, 0), "brick wall": wall(shape), "sky": sky(shape)}
    for number, row in enumerate(PROBES[options.probe](smokes, plates)):
        print(f"| {' | '.join(row)} |", flush=True)
        if number == 0:
            print("| --- " * len(row) + "|")


def _colour(smokes: Mapping[str, Smoke], plates: Plates) -> Iterator[list[str]]:
    rows, columns, _ = plates["black"].shape
    shape = (rows, columns)
    plates = {
        **plates,
        "blue sky": backdrop(shape, (0.25, 0.45, 0.9)),
        "lawn": wall(shape) * np.array([0.6, 1.4, 0.4], np.float32),
    }
    yield ["light", "smoke", *plates]
    for light, tint in LIGHTS.items():
        for name, colour in COLOURS.items():
            yield [
                light,
                name,
                *(_angles(smokes, np.array(tint), np.array(colour), plate) for plate in plates.values()),
            ]


def _angles(smokes: Mapping[str, Smoke], light: Doubles, colour: Doubles, plate: Picture) -> str:
    angles = []
    behind: Picture = (plate * light).astype(np.float32)
    for smoke in smokes.values():
        clip = _filmed(smoke, colour * light, behind)
        color, estimate = smoke_colour(sample_smoke(clip, known_plate(behind, clip)), np.ones(3))
        if estimate.value != UNDETERMINED:
            own = np.array(color)
            cosine = float(own @ colour / (np.linalg.norm(own) * np.linalg.norm(colour)))
            angles.append(math.degrees(math.acos(min(cosine, 1.0))))
    return f"{len(angles)} of {len(smokes)}" + (f", {np.mean(angles):.0f}" if angles else "")


def _filmed(smoke: Smoke, colour: Doubles, plate: Picture) -> Clip:
    """The clip of smoke of a colour before a plate."""
    pictures = (smoke.radiance[..., None] * colour + smoke.transmittance[..., None] * plate).astype(np.float32)
    return filmed(np.clip(exposed(pictures, np.ones(len(pictures))), 0, 1), "baked")


def _source(smokes: Mapping[str, Smoke], plates: Plates) -> Iterator[list[str]]:
    yield ["scene", "smoke", "behind", "extracted", "by brightness"]
    for name, baked in smokes.items():
        for kind, share in (("as baked", 1.0), ("thin", THIN)):
            smoke = baked.thinned(share)
            for behind, plate in plates.items():
                yield [name, kind, behind, *_sources(smoke, plate, True)]
            yield [name, kind, "brick wall, estimated", *_sources(smoke, plates["brick wall"], False)]


def _sources(smoke: Smoke, plate: Picture, given: bool) -> list[str]:
    """Source radiance over the true one, as it is found in two ways."""
    true = float(smoke.radiance.sum() / (1 - smoke.transmittance).sum())
    clip = filmed(exposed(smoke.before(plate), np.ones(len(smoke.radiance))), "baked")
    plates = known_plate(plate, clip) if given else find_backdrop(clip, None, None).plates
    samples = sample_smoke(clip, plates)
    _, source = with_source(Backdrop("given", clip, plates), clip, samples.smoky)
    bright = source_radiance(samples)
    return ["undetermined" if source is None else f"{source.mean() / true:.2f}", f"{bright.mean() / true:.2f}"]


PROBES = {"colour": _colour, "source": _source}

if __name__ == "__main__":
    main()
