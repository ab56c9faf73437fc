"""Find the background of clips whose background is known.

    python -m benchmarks.background SCENES/plume-1 SCENES/jet-2 ... [--only wall black]

A scene is a folder that `benchmarks.truth.picture` filled.
"""

import argparse
import time
from dataclasses import replace
from pathlib import Path

import numpy as np

from benchmarks.background.clips import Smoke, cases
from benchmarks.background.score import score
from smokelift.footage.backdrop import find_backdrop
from smokelift.footage.plate import Plates, known_plate, without_noise_light

FIGURES = ("plate", "lost", "missed", "false", "unknown")


def main() -> None:
    """Print a table of the mean over the scenes, and of the worst."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("scenes", nargs="+", type=Path)
    parser.add_argument("--only", nargs="*", help="cases whose names begin so")
    options = parser.parse_args()
    smokes = [Smoke.load(folder) for folder in options.scenes]
    print("| case | plate error (codes) | smoke's light lost | smoke missed | clear pixels masked | unknown | s |")
    print("| --- | --- | --- | --- | --- | --- | --- |")
    for name in cases(smokes[0]):
        if options.only and not any(name.startswith(start) for start in options.only):
            continue
        rows = []
        seconds = 0.0
        for smoke in smokes:
            case = cases(smoke)[name]()
            began = time.process_time()
            if case.given:
                plates: Plates = known_plate(case.plate, case.clip)
                clip = without_noise_light(case.clip, plates.noise)
            else:
                found = find_backdrop(case.clip, None, None)
                plates, clip = found.plates, found.clip
            seconds += time.process_time() - began
            rows.append(score(replace(case, clip=clip), plates))
        figures = {key: [row[key] for row in rows] for key in FIGURES}
        cells = [f"{np.mean(figures['plate']):.1f} ({np.max(figures['plate']):.1f})"]
        cells += [f"{np.mean(figures[key]):.1%} ({np.max(figures[key]):.1%})" for key in FIGURES[1:]]
        print(f"| {name} | {' | '.join(cells)} | {seconds / len(rows):.1f} |", flush=True)


if __name__ == "__main__":
    main()
