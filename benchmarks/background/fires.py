"""Find fire in clips of baked smoke, with and without a flame at its base.

    python -m benchmarks.background.fires SCENES/plume-1 SCENES/jet-2 ...

A scene is a folder that `benchmarks.truth.picture` filled. The flame is light of the colour (1, .4, .08) that the
lowest quarter of the smoke adds, up to 2.5.
"""

from __future__ import annotations

import argparse
from pathlib import Path

import numpy as np

from benchmarks.background.clips import Smoke, backdrop, exposed, filmed, sky, wall
from benchmarks.background.colours import COLOURS, Array
from smokelift.footage.fire import fire_share
from smokelift.footage.images import Picture
from smokelift.footage.plate import known_plate
from smokelift.setup.smoke import sample_smoke

STRENGTHS = (0.1, 0.3, 1.0)
"""Brightness of the smoke that a flame is put into, over that of the scene."""


def main() -> None:
    """Print the share of the smoke's pixels that is taken for fire, a scene each."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("scenes", nargs="+", type=Path)
    smokes = [Smoke.load(folder) for folder in parser.parse_args().scenes]
    shape = (smokes[0].radiance.shape[1], smokes[0].radiance.shape[2])
    plates = {"black": backdrop(shape, 0), "brick wall": wall(shape), "sky": sky(shape)}
    print("| smoke | flame | " + " | ".join(plates) + " |")
    print("| --- " * (2 + len(plates)) + "|")
    cases = [(name, 1.0, np.array(colour), False) for name, colour in COLOURS.items()]
    cases += [(f"grey, {strength:g} as bright", strength, np.ones(3), True) for strength in STRENGTHS]
    for name, strength, colour, burns in cases:
        cells = [_cell(smokes, strength * colour, burns, plate) for plate in plates.values()]
        print(f"| {name} | {'yes' if burns else 'no'} | {' | '.join(cells)} |", flush=True)


def _cell(smokes: list[Smoke], colour: Array, burns: bool, plate: Picture) -> str:
    shares = []
    for smoke in smokes:
        pictures = smoke.radiance[..., None] * colour + smoke.transmittance[..., None] * plate
        pictures = (pictures + flame(smoke) if burns else pictures)[::4].astype(np.float32)
        clip = filmed(np.clip(exposed(pictures, np.ones(len(pictures))), 0, 1), "baked")
        samples = sample_smoke(clip, known_plate(plate, clip))
        shares.append(fire_share(samples.colours, samples.behind))
    return ", ".join(f"{share:.1%}" for share in shares)


def flame(smoke: Smoke) -> Picture:
    """Light (frames, rows, columns, 3) of a fire at the base of the smoke."""
    rows = smoke.radiance.shape[1]
    height = (rows - np.arange(rows)) / rows
    hot = np.exp(-((height / 0.25) ** 2))[:, None] * (1 - smoke.transmittance) ** 2
    return np.asarray(2.5 * hot[..., None] * np.array((1.0, 0.4, 0.08)), np.float32)


if __name__ == "__main__":
    main()
