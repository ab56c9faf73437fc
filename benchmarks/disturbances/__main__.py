"""Measure what is not measured yet, and draw it.

    python -m benchmarks.disturbances OUT SCENES/plume-3 SCENES/jet-3 ... [--only noise crf] [--methods default]

OUT/stability.csv gets a row a disturbance, strength, scene and method; rows that are there stay as they are. Those that
people meet come first. OUT gets stability_views.png, stability_velocity.png and stability.md, with the table.
"""

import argparse
from collections.abc import Sequence
from functools import lru_cache
from pathlib import Path

from benchmarks import charts
from benchmarks.disturbances.known import Known
from benchmarks.disturbances.report import Results, draw, table
from benchmarks.disturbances.spoiled import MOMENTS
from benchmarks.disturbances.table import DISTURBANCES
from smokelift.render import device
from smokelift.setup.settings import METHODS, MethodName


def main(arguments: Sequence[str] | None = None) -> None:
    """Measure and draw."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.disturbances", description=__doc__)
    parser.add_argument("out", type=Path)
    parser.add_argument("scenes", type=Path, nargs="*", help="folders that benchmarks.truth.picture filled")
    parser.add_argument("--only", nargs="+", choices=DISTURBANCES, default=list(DISTURBANCES), metavar="DISTURBANCE")
    parser.add_argument("--methods", nargs="+", choices=METHODS, default=list(METHODS))
    options = parser.parse_args(arguments)
    charts.require_matplotlib()
    options.out.mkdir(parents=True, exist_ok=True)
    device.start("cpu")
    results = Results(options.out / "stability.csv")
    asked = [
        (name, strength, folder.name, method)
        for folder in options.scenes
        for name in options.only
        for method in options.methods
        for strength in DISTURBANCES[name].strengths
    ]
    folders = {folder.name: folder for folder in options.scenes}
    known = lru_cache(maxsize=1)(lambda scene: Known.load(folders[scene], MOMENTS))
    for key in sorted(asked, key=_rank):
        if key not in results:
            name, strength, scene, method = key
            results.add(key, DISTURBANCES[name].measure(known(scene), strength, method))
    (options.out / "stability.md").write_text(table(results) + "\n")
    draw(results, "psnr_new", "new views, dB beside undisturbed", options.out / "stability_views.png")
    draw(results, "velocity_error", "velocity error", options.out / "stability_velocity.png")


def _rank(key: tuple[str, float, str, MethodName]) -> bool:
    """What is measured first: the strengths that people meet, and what they are compared with."""
    disturbance = DISTURBANCES[key[0]]
    return key[1] not in (disturbance.undisturbed, *disturbance.common)


if __name__ == "__main__":
    main()
