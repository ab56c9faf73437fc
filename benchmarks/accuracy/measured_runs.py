"""Speed and errors of measured runs, from the figures that benchmarks/accuracy writes."""

import csv
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from benchmarks.tables import sizes_of

ERRORS = {
    "view_error": "error of new views (RMS of sRGB values, white is 1)",
    "patches": "patches of the orbit, distance from the truth's",
}

DEFAULT = "balanced"
"""The quality that a run has unless another is asked for."""

_CHOSEN = "resolution=auto"
"""Says in a run's name that its grid was chosen by the clip, as it is where a user says nothing."""

_SAID = ("machine", "date")

_REFERENCE = "reference"
"""Method of what is measured to check the measurement, such as the truth rendered by us; it is not drawn."""


@dataclass(frozen=True)
class Run:
    """One way to reconstruct, or a baseline: means over the scenes that all runs share.

    Attributes
    ----------
    name
        A quality, "paper" or a baseline, and after a colon what was changed: "fine:resolution=32x32x48".
    resolution
        "64x64x96"; empty for a baseline that has none.
    seconds
        Of the processor a frame; None for a baseline that nothing was computed for.
    errors
        By the names of `ERRORS`; what was not measured is missing.
    """

    name: str
    resolution: str
    seconds: float | None
    errors: dict[str, float]

    @property
    def series(self) -> str:
        """What it is called without the changes; runs of one series share a color."""
        return self.name.partition(":")[0]

    @property
    def changes(self) -> dict[str, str]:
        """What was changed besides the resolution, and to what: "coarsening" to "0" by "velocity.coarsening=0"."""
        said = (change.partition("=") for change in self._said if change)
        return {key.rpartition(".")[2]: value for key, _, value in said if key != "resolution"}

    @property
    def chosen(self) -> bool:
        """Whether its grid was chosen by each clip, which is all that was said about it."""
        return self._said == [_CHOSEN]

    @property
    def label(self) -> str:
        """What tells it from the others of its series: its changes, its name, or the voxels along its longest side."""
        if self.changes:
            return ", ".join(f"{key} {value}" for key, value in self.changes.items())
        if self.chosen or not self.resolution:
            return self.series
        return str(max(sizes_of(self.resolution)[0]))

    @property
    def _said(self) -> list[str]:
        return self.name.partition(":")[2].split(",")


@dataclass(frozen=True)
class Runs:
    """What a chart shows.

    Attributes
    ----------
    runs
        In the file's order.
    caption
        Scenes, frames, machine and date.
    """

    runs: tuple[Run, ...]
    caption: str

    @property
    def default(self) -> Run | None:
        """What a user gets who says nothing but the clip, else the default quality on a given grid."""
        by_name = {run.name: run for run in self.runs}
        return by_name.get(f"{DEFAULT}:{_CHOSEN}", by_name.get(DEFAULT))


def read_runs(path: Path) -> Runs:
    """Read the figures that `python -m benchmarks.accuracy` wrote.

    Raises
    ------
    ValueError
        If there is no scene that all runs share.
    """
    with path.open(newline="", encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    by_run: dict[str, dict[str, dict[str, str]]] = {}
    for row in (row for row in rows if row["method"] != _REFERENCE):
        by_run.setdefault(row["run"], {})[row["scene"]] = row
    shared = sorted(set.intersection(*(set(scenes) for scenes in by_run.values())))
    if not shared:
        raise ValueError(f"{path}: there is no scene that all runs share; measure all of them on the same scenes.")
    runs = tuple(_mean(name, [scenes[scene] for scene in shared]) for name, scenes in by_run.items())
    return Runs(runs, _caption([scenes[scene] for scenes in by_run.values() for scene in shared], shared))


def _mean(name: str, rows: list[dict[str, str]]) -> Run:
    def mean(column: str) -> float | None:
        values = [float(row[column]) for row in rows if row.get(column)]
        return float(np.mean(values)) if len(values) == len(rows) and np.isfinite(values).all() else None

    decibels = mean("psnr_new")
    errors = {"view_error": None if decibels is None else 10 ** (-decibels / 20), "patches": mean("patches")}
    known = {key: value for key, value in errors.items() if value}
    return Run(name, rows[0].get("resolution") or "", mean("seconds") or None, known)


def _caption(rows: list[dict[str, str]], scenes: Sequence[str]) -> str:
    frames = sorted({row["frames"] for row in rows}, key=lambda text: (len(text), text))
    machines, dates = (", ".join(sorted({row[name] for row in rows if row[name]})) for name in _SAID)
    return f"{', '.join(scenes)}; {' or '.join(frames)} frames; {machines}; {dates}"
