"""Fire continued after its clip, beside what really came.

    python -m benchmarks.direct.burning SCENES/plume-3 ...

The fire is that of `benchmarks.background.flames`. Two thirds of a scene are the clip; the rest is continued from the
true densities, velocities and emissions, and compared with the last frame held, and with the last frame carried on by
the simulated velocity without burning.
"""

from __future__ import annotations

import argparse
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np

from benchmarks.accuracy.scenes import baked_scene
from benchmarks.background.flames import reactants
from benchmarks.direct.clips import density_error, true_moment
from benchmarks.tables import markdown
from smokelift.direct import Moment, fit_simulation
from smokelift.direct.continuation import FITTED_MOMENTS
from smokelift.direct.fire import Fire
from smokelift.evaluation.truth import Truth
from smokelift.transport import Array

HEADER = ["scene", "", "mean error", "error, last frame", "emission over the truth's, mean", "last"]


def ways(moments: list[Moment], frames: int, dt: float) -> Iterator[tuple[str, list[Array]]]:
    """Yield every way to continue the fire of moments by so many frames, with its emissions."""
    simulation = fit_simulation(moments[-FITTED_MOMENTS:], dt)
    assert simulation.fire is not None
    kept = replace(simulation, fire=Fire(1.0, np.zeros_like(simulation.fire.feed)))
    held = moments[-1].flame
    assert held is not None
    yield "held", [held] * frames
    for how, each in (("carried", kept), ("fed", simulation)):
        moment, emissions = moments[-1], []
        for step in range(1, frames + 1):
            moment = each.next(moment, step)
            assert moment.flame is not None
            emissions.append(moment.flame)
        yield how, emissions


def table(name: str, truth: Truth) -> Iterator[list[str]]:
    """Yield the rows of a scene."""
    emissions = [np.sqrt(left) for left in reactants(truth)]
    cut = 2 * truth.frames // 3
    moments = [replace(true_moment(truth, n), flame=emissions[n]) for n in range(max(1, cut - FITTED_MOMENTS), cut)]
    true = emissions[cut:]
    for how, found in ways(moments, len(true), truth.dt):
        errors = [density_error(f, t) for f, t in zip(found, true, strict=True)]
        amounts = [float(f.sum(dtype=float) / t.sum(dtype=float)) for f, t in zip(found, true, strict=True)]
        yield [name, how, *(f"{value:.2f}" for value in (np.mean(errors), errors[-1], np.mean(amounts), amounts[-1]))]


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("scenes", nargs="+", type=Path, metavar="SCENE")
    rows: list[list[str]] = []
    for scene in parser.parse_args().scenes:
        truth = baked_scene(scene, 10**6).truth
        assert truth is not None
        rows += table(scene.name, truth)
    print(markdown(HEADER, rows), flush=True)


if __name__ == "__main__":
    main()
