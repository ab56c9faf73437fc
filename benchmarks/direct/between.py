"""Frames between two moments, and the seams of loops, carried and merely faded.

    python -m benchmarks.direct.between SCENES/plume-3 ... [--picture FILE.png]

Retiming: of the true densities and velocities every second frame is left out, and made of its neighbours. Looping:
frames 8 to 31 become a loop whose ends share `--overlap` frames. Detail is the gradient's root mean square over that of
the clip's own frames; a step is the change from one frame to the next over the later frame, both in the seam.
"""

from __future__ import annotations

import argparse
from itertools import pairwise
from pathlib import Path

import numpy as np

from benchmarks.accuracy.scenes import baked_scene
from benchmarks.direct.clips import density_error, true_moment
from benchmarks.direct.continuation import tile
from benchmarks.tables import markdown
from smokelift.direct.interpolation import interpolate
from smokelift.direct.looping import seam
from smokelift.evaluation.truth import Truth
from smokelift.output.sheet import write_sheet
from smokelift.transport import Array

PART = range(8, 32)
"""Frames of the loop: the plumes have risen, and fill neither the box nor the frames' end."""


def retimed(truth: Truth) -> list[float]:
    """Return mean errors of the frames left out: the frame before held, both neighbours faded, both carried."""
    errors = []
    for frame in range(2, truth.frames - 1, 4):
        before, after = true_moment(truth, frame - 1), true_moment(truth, frame + 1)
        found = interpolate(before, after, after.velocity, 2 * truth.dt, 0.5).density
        faded = (before.density + after.density) / 2
        errors.append([density_error(d, truth.density(frame)) for d in (before.density, faded, found)])
    return [float(value) for value in np.mean(errors, axis=0)]


def detail(density: Array) -> float:
    """Return the root of the sum of squared differences between neighbours."""
    return float(np.sqrt(sum(np.square(np.diff(density, axis=axis), dtype=np.float64).sum() for axis in range(3))))


def step(before: Array, after: Array) -> float:
    """Return the change from one density to the next."""
    return float(np.linalg.norm(after - before) / np.linalg.norm(after))


def looped(truth: Truth, overlap: int) -> dict[str, list[Array]]:
    """Return the densities of a seam, from the frame before it to the one after, faded and carried."""
    length = len(PART) - overlap
    ends = [PART[0] + length - 1, PART[0] + overlap]
    seams: dict[str, list[Array]] = {"faded": [truth.density(ends[0])], "carried": [truth.density(ends[0])]}
    for index in range(overlap):
        share = (index + 1) / (overlap + 1)
        start, end = true_moment(truth, PART[0] + index), true_moment(truth, PART[0] + index + length)
        seams["faded"].append((1 - share) * end.density + share * start.density)
        seams["carried"].append(seam(end, start, share, truth.dt * (overlap + 1)).density)
    return {how: [*densities, truth.density(ends[1])] for how, densities in seams.items()}


def main() -> None:
    """Print the tables."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("scenes", nargs="+", type=Path, metavar="SCENE")
    parser.add_argument("--overlap", type=int, default=len(PART) // 2)
    parser.add_argument("--picture", type=Path, help="of the first scene's seam")
    options = parser.parse_args()
    between_rows, seam_rows = [], []
    for scene in options.scenes:
        truth = baked_scene(scene, 10**6).truth
        if truth is None:
            parser.error(f"{scene}: has no truth.npz")
        between_rows.append([scene.name, *(f"{error:.3f}" for error in retimed(truth))])
        own = float(np.mean([detail(truth.density(frame)) for frame in PART]))
        usual = float(np.mean([step(truth.density(frame - 1), truth.density(frame)) for frame in PART[1:]]))
        seams = looped(truth, options.overlap)
        cells = [f"{usual:.2f}"]
        for densities in seams.values():
            least = min(detail(density) for density in densities[1:-1]) / own
            largest = max(step(*pair) for pair in pairwise(densities))
            cells += [f"{least:.2f}", f"{largest:.2f}"]
        seam_rows.append([scene.name, *cells])
        if options.picture and scene is options.scenes[0]:
            shown = range(1, options.overlap + 1, max(1, options.overlap // 4))
            white = float(max(truth.density(frame).mean(axis=1).max() for frame in PART))
            tiles = [[tile(densities[i], white) for densities in seams.values()] for i in shown]
            write_sheet(options.picture, tiles, tuple(seams), [f"{i} of {options.overlap}" for i in shown])
    print(markdown(["scene", "frame before", "faded", "carried"], between_rows), end="\n\n")
    header = ["scene", "usual step", "faded: least detail", "largest step", "carried: least detail", "largest step"]
    print(markdown(header, seam_rows))


if __name__ == "__main__":
    main()
