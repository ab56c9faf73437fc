"""The campaign: so many cases of every class, and a table of how they ended."""

import argparse
import shutil
import signal
import sys
from collections import Counter
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from benchmarks.stability.cases import CLASSES
from benchmarks.stability.environments import ENVIRONMENTS, lacking
from benchmarks.stability.shot import TinyShot, tiny_shot


def failures(shot: TinyShot, name: str, cases: int, folder: Path, first: int = 0) -> tuple[Counter[int], list[str]]:
    """Run cases of a class.

    Parameters
    ----------
    shot
        What is damaged.
    name
        Of the class.
    cases, first
        How many, and the number of the first; a number always makes the same case.
    folder
        Where they lie; only those that fail stay there.

    Returns
    -------
    statuses
        How often each was returned.
    failed
        A line for every case that ended as none may: its number, the verdict, and the last that it said.
    """
    statuses: Counter[int] = Counter()
    failed = []
    for number in range(first, first + cases):
        place = folder / f"{name.replace(' ', '-')}-{number}" / "case"
        place.parent.mkdir(parents=True)
        ended, wrong = CLASSES[name](shot, place, np.random.default_rng([list(CLASSES).index(name), number]))
        statuses[ended.status] += 1
        if wrong:
            failed.append(f"{name} {number}: {wrong}: {(ended.errors.strip().splitlines() or [''])[-1][:150]}")
        else:
            shutil.rmtree(place.parent)
    return statuses, failed


def check(shot: TinyShot, names: Sequence[str], folder: Path) -> None:
    """Refuse to go on if a command does not end well with files that are sound."""
    for name in names:
        place = folder / f"{name.replace(' ', '-')}-sound" / "case"
        place.parent.mkdir(parents=True)
        ended, wrong = CLASSES[name](shot, place, None)
        if ended.status or wrong:
            raise SystemExit(f"{name}: does not work on a sound system with sound files: {wrong} {ended.errors}")
        shutil.rmtree(place.parent)


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the campaign; the status is 1 if any case fails."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.stability", description=__doc__)
    parser.add_argument("folder", type=Path, help="an empty folder; cases that fail stay there")
    parser.add_argument("--cases", type=int, default=300, help="of every class")
    parser.add_argument("--first", type=int, default=0, help="number of the first case of every class")
    parser.add_argument("--classes", nargs="+", choices=CLASSES, default=list(CLASSES), metavar="CLASS")
    options = parser.parse_args(arguments)
    folder = options.folder.resolve()  # commands are run from elsewhere
    shot = tiny_shot(folder / "shot")
    left_out = {name: reason for name in ENVIRONMENTS if (reason := lacking(name, folder))}
    classes = [name for name in options.classes if name not in left_out]
    check(shot, classes, folder)
    print("| class | cases | done | refused | stopped | failed |\n|---|---|---|---|---|---|")
    all_failed = []
    for name in options.classes:
        if name in left_out:
            print(f"| {name} | left out: {left_out[name]} | | | | |", flush=True)
            continue
        statuses, failed = failures(shot, name, options.cases, folder, options.first)
        refused = sum(count for status, count in statuses.items() if status in (2, 3))
        stopped = statuses[130] + statuses[-signal.SIGKILL]
        print(f"| {name} | {options.cases} | {statuses[0]} | {refused} | {stopped} | {len(failed)} |", flush=True)
        all_failed += failed
    print("\n".join(["", *all_failed]))
    return bool(all_failed)


if __name__ == "__main__":
    sys.exit(main())
