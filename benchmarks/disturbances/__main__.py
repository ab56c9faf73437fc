"""Measure what is not measured yet, and draw it.

    python -m benchmarks.disturbances OUT SCENES/plume-3 SCENES/jet-3 ... [--only noise crf] [--methods default]

OUT/stability.csv gets a row per disturbance, strength, scene and method; rows that are there stay. Those that
people meet come first. OUT gets stability_views.png, stability_velocity.png and stability.md, with the table.
"""

import argparse
from collections.abc import Sequence
from functools import lru_cache
from pathlib import Path

from benchmarks.disturbances.known import Known
from benchmarks.disturbances.report import Results, draw, table
from benchmarks.disturbances.spoiled import MOMENTS
from benchmarks.disturbances.table import DISTURBANCES
from smokelift.render import device
from smokelift.setup.settings import METHODS


def main(arguments: Sequence[str] | None = None) -> None:
    """Measure and draw."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.disturbances", description=__doc__)
    parser.add_argument("out", type=Path)
    parser.add_argument("scenes", type=Path, nargs="*", help="folders that benchmarks.truth.picture filled")
    parser.add_argument("--only", nargs="+", choices=DISTURBANCES, default=list(DISTURBANCES), metavar="DISTURBANCE")
    parser.add_argument("--methods", nargs="+", choices=METHODS, default=list(METHODS))
    options = parser.parse_args(arguments)
    import matplotlib  # noqa: F401  (missing, it is missed now, not after hours)

    device.start("cpu")
    results = Results(options.out / "stability.csv")
    asked = [
        (strength not in (disturbance.undisturbed, *disturbance.common), name, strength, folder, method)
        for folder in options.scenes
        for name, disturbance in DISTURBANCES.items()
        if name in options.only
        for method in options.methods
        for strength in disturbance.strengths
    ]
    known = lru_cache(maxsize=1)(Known.read)
    for _, name, strength, folder, method in sorted(asked, key=lambda row: row[0]):
        key = results.key(name, strength, folder.name, method)
        if results.find(key) is None:
            results.add(key, DISTURBANCES[name].measure(known(folder, MOMENTS), strength, method))
    (options.out / "stability.md").write_text(table(results) + "\n")
    draw(results, "psnr_new", "new views, dB beside undisturbed", options.out / "stability_views.png")
    draw(results, "velocity_error", "velocity error", options.out / "stability_velocity.png")


if __name__ == "__main__":
    main()
