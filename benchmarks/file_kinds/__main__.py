"""All files: made, given to the command line, read; a table of how that went."""

from __future__ import annotations

import argparse
import pickle
import shutil
import sys
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from benchmarks.file_kinds.judge import Kind, misread, verdict
from benchmarks.file_kinds.kinds import Make, kinds
from benchmarks.stability.forked import Limits, run
from smokelift.app import cli

SMALL = ("--quality", "draft", "--resolution", "12,12,16", "--device", "cpu")
INSPECT = ("inspect", *SMALL)
RECONSTRUCT = ("reconstruct", *SMALL, "--npz", "--out", "out")

LIMITS = Limits(processor_seconds=60, memory=12 * 2**30)


@dataclass(frozen=True)
class Result:
    """How a file went: whether the command did its work, its error in steps of 8 bits, and what was wrong."""

    done: bool
    error: float
    wrong: str


def tried(make: Make, folder: Path) -> Result:
    """Make a file in an empty folder, give it to the command, and read it; each in a fork: FFmpeg's threads do not."""
    (folder / "files").mkdir(parents=True)
    kept = folder / "kind"

    def made(_words: Sequence[str]) -> int:
        kept.write_bytes(pickle.dumps(make(folder / "files")))
        return 0

    def read(_words: Sequence[str]) -> int:
        print(*misread(kind), sep="\n")
        return 0

    making = run(made, (), folder, LIMITS)
    if making.status:
        raise RuntimeError(f"{folder}: cannot be made: {making.errors}")
    kind: Kind = pickle.loads(kept.read_bytes())
    command = RECONSTRUCT if kind.shown is None else INSPECT  # what is sound has no other way through the rest
    ended = run(cli.main, (*command, "--", str(kind.path)), folder, LIMITS)
    wrong = verdict(kind, ended, folder / "out")
    if wrong or ended.status:
        return Result(False, 0.0, wrong)
    reading = run(read, (), folder, LIMITS)
    if reading.status:
        return Result(True, 0.0, reading.errors.strip().splitlines()[-1])
    error, wrong = reading.output.splitlines() if reading.output.count("\n") > 1 else (reading.output, "")
    return Result(True, float(error), wrong)


def main(arguments: Sequence[str] | None = None) -> int:
    """Run all, or some groups; the status is 1 if any file fails."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.file_kinds", description=__doc__)
    parser.add_argument("folder", type=Path, help="an empty folder; files that fail stay there")
    parser.add_argument("--groups", nargs="+", choices=kinds(), default=list(kinds()), metavar="GROUP")
    parser.add_argument("--damaged", type=int, default=4, help="files with random damage of each container")
    options = parser.parse_args(arguments)
    print("| group | files | done | refused | largest error | failed |\n|---|---|---|---|---|---|")
    failed = []
    for group in options.groups:
        files = kinds(options.damaged)[group]
        results = {}
        for number, (name, make) in enumerate(files.items()):
            folder = options.folder.resolve() / f"{group.replace(' ', '-')}-{number}" / "case"
            results[name] = tried(make, folder)
            if results[name].wrong:
                failed.append(f"{group}, {name} ({folder.parent.name}): {results[name].wrong}")
            else:
                shutil.rmtree(folder.parent)
        done = [result for result in results.values() if result.done]
        wrong = sum(bool(result.wrong) for result in results.values())
        error = max((result.error for result in done), default=0.0)
        refused = len(files) - len(done) - sum(bool(r.wrong) and not r.done for r in results.values())
        print(f"| {group} | {len(files)} | {len(done)} | {refused} | {error:.1f} | {wrong} |", flush=True)
    print("\n".join(["", *failed]))
    return bool(failed)


if __name__ == "__main__":
    sys.exit(main())
