"""Slices of velocities beside the truth's, as in the paper's figure 5.

    python -m benchmarks.accuracy OUT SCENE... --runs balanced:detail=0
    python -m benchmarks.velocity.slices docs/velocity_slices.png OUT/runs SCENE...

Each scene has a row, front and side: the truth, the estimate from true densities after a chain of frames, and the
velocity of the whole run, which knows the front video alone. Shown is the component in which the smoke moves most, of
one moment, in the slices with most of the true smoke.
"""

import argparse
from pathlib import Path

import numpy as np

from benchmarks.velocity.accuracy import CHAIN, estimates
from benchmarks.velocity.pairs import near_smoke
from smokelift.evaluation.truth import Truth, resampled

RUN = "balanced:detail=0"


def draw(out: Path, runs: Path, scenes: list[Path]) -> None:
    """Write the picture of some scenes, whose runs from the first frame on are in folders of their names."""
    from matplotlib import pyplot

    figure, axes = pyplot.subplots(len(scenes), 6, figsize=(13, 3.3 * len(scenes)), squeeze=False)
    frame = CHAIN[-1]
    for row, scene in zip(axes, scenes, strict=True):
        truth = Truth.load(scene / "truth.npz")
        *_, (_, chained) = estimates(truth)
        with np.load(runs / scene.name / RUN / f"{frame + 2:04d}.npz") as file:  # what arrives there, from 1
            of_run = file["velocity"].astype(np.float32)
        fields = {
            "truth": truth.velocity(frame).centres(),
            "from true densities": chained.centres(),
            "from the front video": resampled(of_run, truth.shape),
        }
        density = truth.density(frame + 1)
        smoke = near_smoke(density)
        true = fields["truth"][smoke]
        component = int(np.abs(true.mean(axis=0)).argmax())
        limit = float(np.abs(true[:, component]).max())
        for first, axis, side in ((0, 1, "front"), (3, 0, "side")):
            heaviest = int(density.sum(axis=tuple(d for d in range(3) if d != axis)).argmax())
            for plot, (what, velocity) in zip(row[first:], fields.items(), strict=False):
                shown = np.where(smoke, velocity[..., component], np.nan).take(heaviest, axis)
                plot.imshow(shown.T, origin="lower", cmap="RdBu_r", vmin=-limit, vmax=limit)
                plot.set_title(f"{scene.name}, {'xyz'[component]}, {side}: {what}", fontsize=7)
                plot.axis("off")
    figure.tight_layout()
    figure.savefig(out, dpi=70)


def main() -> None:
    """Draw what the command line names."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("out", type=Path, metavar="PNG")
    parser.add_argument("runs", type=Path)
    parser.add_argument("scenes", nargs="+", type=Path, metavar="SCENE")
    options = parser.parse_args()
    draw(options.out, options.runs, options.scenes)


if __name__ == "__main__":
    main()
