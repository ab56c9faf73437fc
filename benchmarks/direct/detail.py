"""The detail of continued smoke beside that of its clip, in column densities from the front and from 90 degrees.

    python -m benchmarks.direct.detail CONTINUED ...

References are every fourth of the clip's last twelve frames, from the front. Patches and texture: `PatchStatistics`.
Edges: mean gradient over that of the clip. Lines: how much of the detail finer than four voxels runs in one direction
over four voxels, as sheets and threads do (coherence of the structure tensor). Octaves: energy of the detail from 0 to
1, 1 to 2 and 2 to 4 voxels over the clip's, in dB. Rise of the center of mass in m/s.
"""

import argparse
from itertools import pairwise
from pathlib import Path

import numpy as np
from scipy import ndimage

from benchmarks.tables import markdown
from smokelift.checks import Doubles
from smokelift.evaluation.metrics import PatchStatistics, mean_gradient
from smokelift.output.sequence import Sequence
from smokelift.transport import Array

COMPARED = ["patches", "texture", "edges", "lines", "0 to 1", "1 to 2", "2 to 4", "mass", "rise"]
BACK = 12
"""Frames of the clip that are compared, every fourth of them, and over which it rises."""
AFTER = 12, 24
WIDTH = 4.0
"""Standard deviations in voxels of the blurs that take the detail out, and over which its direction is averaged."""


def views(density: Array) -> dict[str, Doubles]:
    """Return the column densities (rows, columns) from the front and from the side."""
    return {name: density.sum(axis, dtype=np.float64).T[::-1] for name, axis in (("front", 1), ("side", 0))}


def octaves(picture: Doubles) -> Doubles:
    """Return the energy (3,) of a picture's detail over that of the picture."""
    blurred = [picture, *(ndimage.gaussian_filter(picture, width) for width in (1, 2, 4))]
    return np.array([np.square(a - b).sum() / np.square(picture).sum() for a, b in pairwise(blurred)])


def lines(picture: Doubles) -> float:
    """Return how much of a picture's detail runs in one direction, from 0 to 1."""
    down, right = np.gradient(picture - ndimage.gaussian_filter(picture, WIDTH))
    a, b, c = (ndimage.gaussian_filter(each, WIDTH) for each in (down**2, down * right, right**2))
    return float(np.hypot(a - c, 2 * b).sum() / (a + c).sum())


def rows(directory: Path) -> list[list[str]]:
    """Return the rows of a continued sequence, those of its clip first."""
    sequence = Sequence.open(directory)
    seam = max(number for number in sequence.frames if sequence.figures(number)["origin"] == "clip")
    clip = {number: sequence.density(number) for number in range(seam - BACK, seam + 1, 4) if number in sequence.frames}
    references = [views(density)["front"] for density in clip.values()]
    statistics = [PatchStatistics.of(picture) for picture in references]
    sharp = np.mean([mean_gradient(picture) for picture in references])
    energy = np.mean([octaves(picture) for picture in references], axis=0)
    speed = sequence.fps * sequence.scene.domain.voxel_size
    found = []
    for number in (seam, *(seam + after for after in AFTER)):
        density, since = sequence.density(number), min(clip) if number == seam else seam
        low, high = (ndimage.center_of_mass(each)[2] for each in (clip[since], density))
        rise = (high - low) * speed / (number - since)
        mass = density.sum(dtype=np.float64) / clip[seam].sum(dtype=np.float64)
        for name, picture in views(density).items():
            own = PatchStatistics.of(picture)
            patches = np.mean([own.distance(each) for each in statistics])
            texture = np.mean([own.texture_distance(each) for each in statistics])
            decibels = 10 * np.log10(octaves(picture) / energy)
            figures = [patches, texture, mean_gradient(picture) / sharp, lines(picture)]
            found.append([directory.name, f"+{number - seam}", name, *(f"{each:.2f}" for each in figures)])
            found[-1] += [*(f"{each:.1f}" for each in decibels), f"{mass:.2f}", f"{rise:.2f}"]
    return found


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("sequences", nargs="+", type=Path, metavar="CONTINUED")
    found = [row for directory in parser.parse_args().sequences for row in rows(directory)]
    print(markdown(["sequence", "frame", "view", *COMPARED], found))


if __name__ == "__main__":
    main()
