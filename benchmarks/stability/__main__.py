"""The campaign: so many cases of every class, and a table of how they ended."""

from __future__ import annotations

import argparse
import shutil
import sys
from collections import Counter
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from benchmarks.stability.cases import CLASSES
from benchmarks.stability.forked import Limits, run
from benchmarks.stability.judge import files_of, verdict
from benchmarks.stability.shot import TinyShot, tiny_shot
from smokelift.app import cli


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
    prepare, out = CLASSES[name]
    statuses: Counter[int] = Counter()
    failed = []
    for number in range(first, first + cases):
        place = folder / f"{name.replace(' ', '-')}-{number}" / "case"
        place.parent.mkdir(parents=True)
        words = prepare(shot, place, np.random.default_rng([sorted(CLASSES).index(name), number]))
        before = files_of(place)
        ended = run(cli.main, words, place, Limits())
        statuses[ended.status] += 1
        if wrong := verdict(ended, before, files_of(place), out):
            failed.append(f"{name} {number}: {wrong}: {(ended.errors.strip().splitlines() or [''])[-1][:150]}")
        else:
            shutil.rmtree(place.parent)
    return statuses, failed


def check(shot: TinyShot, names: Sequence[str], folder: Path) -> None:
    """Refuse to go on if a command does not end well with files that are sound."""
    for name in names:
        prepare, _ = CLASSES[name]
        place = folder / f"{name.replace(' ', '-')}-sound" / "case"
        place.parent.mkdir(parents=True)
        ended = run(cli.main, prepare(shot, place, None), place, Limits())
        if ended.status:
            raise SystemExit(f"{name}: does not work with sound files: {ended.errors}")
        shutil.rmtree(place.parent)


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the campaign; the status is 1 if any case fails."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.stability", description=__doc__)
    parser.add_argument("folder", type=Path, help="an empty folder; cases that fail stay there")
    parser.add_argument("--cases", type=int, default=750, help="of every class")
    parser.add_argument("--classes", nargs="+", choices=CLASSES, default=list(CLASSES), metavar="CLASS")
    options = parser.parse_args(arguments)
    folder = options.folder.resolve()  # commands are run from elsewhere
    shot = tiny_shot(folder / "shot")
    check(shot, options.classes, folder)
    print("| class | cases | done | refused | failed |\n|---|---|---|---|---|")
    all_failed = []
    for name in options.classes:
        statuses, failed = failures(shot, name, options.cases, folder)
        refused = sum(count for status, count in statuses.items() if status in (2, 3))
        print(f"| {name} | {options.cases} | {statuses[0]} | {refused} | {len(failed)} |", flush=True)
        all_failed += failed
    print("\n".join(["", *all_failed]))
    return bool(all_failed)


if __name__ == "__main__":
    sys.exit(main())
