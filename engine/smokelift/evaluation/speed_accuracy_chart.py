"""Speed against accuracy: seconds a frame against four errors, from the figures of `python -m benchmarks.accuracy`."""

from __future__ import annotations

import csv
import math
from collections.abc import Sequence as Many
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from smokelift.output.atomic import atomic_path

ERRORS = {
    "input_error": "error of the input view (RMS of sRGB values, white is 1)",
    "view_error": "error of new views (RMS of sRGB values, white is 1)",
    "density_error": "error of the density (relative L2)",
    "velocity_error": "error of the velocity in smoke (relative L2)",
}

_NEEDED = ("scene", "run", "method", "frames", "seconds", "psnr_new", "density_error", "velocity_error")
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
    method
        "default", "paper" or "baseline".
    resolution
        "64x64x96"; empty for a baseline that has none.
    seconds
        A frame; None for a baseline that nothing was computed for.
    errors
        By the names of `ERRORS`; what was not measured is missing.
    """

    name: str
    method: str
    resolution: str
    seconds: float | None
    errors: dict[str, float]

    @property
    def series(self) -> str:
        """What it is called without the changes; runs of one series share a colour."""
        return self.name.partition(":")[0]

    @property
    def changes(self) -> str:
        """What was changed besides the resolution, "coarsening=0" for "velocity.coarsening=0"."""
        changes = self.name.partition(":")[2].split(",")
        return ", ".join(
            change.rpartition(".")[2] for change in changes if change and not change.startswith("resolution=")
        )


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


def read_runs(path: Path) -> Runs:
    """Read the figures that `python -m benchmarks.accuracy` wrote.

    Raises
    ------
    ValueError
        If the file is missing or damaged, lacks a column, or its runs share no scene.
    """
    try:
        with path.open(newline="", encoding="utf-8") as file:
            reader = csv.DictReader(file)
            rows = list(reader)
            columns = reader.fieldnames or ()
            missing = [name for name in (*_NEEDED, *_SAID) if name not in columns]
    except FileNotFoundError:
        raise ValueError(f"{path}: no such file.") from None
    except (OSError, UnicodeDecodeError, csv.Error) as error:
        raise ValueError(f"{path}: cannot be read as CSV: {error}.") from error
    if missing:
        raise ValueError(f"{path}: has no column {missing[0]!r}; give the CSV of python -m benchmarks.accuracy.")
    by_run: dict[str, dict[str, dict[str, str]]] = {}
    for row in (row for row in rows if row["method"] != _REFERENCE):
        by_run.setdefault(row["run"], {})[row["scene"]] = row
    if not by_run:
        raise ValueError(f"{path}: holds no runs.")
    shared = sorted(set.intersection(*(set(scenes) for scenes in by_run.values())))
    if not shared:
        raise ValueError(f"{path}: there is no scene that all runs share; measure all of them on the same scenes.")
    decibels = {"view_error": "psnr_new"}
    if (first := next(name for name in columns if name.startswith("psnr_"))) != "psnr_new":
        decibels = {"input_error": first, **decibels}
    runs = tuple(_mean(path, name, [scenes[scene] for scene in shared], decibels) for name, scenes in by_run.items())
    return Runs(runs, _caption([scenes[scene] for scenes in by_run.values() for scene in shared], shared))


def _mean(path: Path, name: str, rows: list[dict[str, str]], decibels: dict[str, str]) -> Run:
    def mean(column: str) -> float | None:
        try:
            values = [float(row[column]) for row in rows if row[column] != ""]
        except (TypeError, ValueError):
            raise ValueError(f"{path}: {column} of {name} must be a number.") from None
        return float(np.mean(values)) if len(values) == len(rows) and np.isfinite(values).all() else None

    errors = {"density_error": mean("density_error"), "velocity_error": mean("velocity_error")}
    for key, column in decibels.items():
        if (value := mean(column)) is not None:
            errors[key] = 10 ** (-value / 20)
    known = {key: value for key, value in errors.items() if value is not None and value > 0}
    seconds = mean("seconds")
    if seconds is not None and seconds <= 0:
        seconds = None
    return Run(name, rows[0]["method"], rows[0].get("resolution") or "", seconds, known)


def _caption(rows: list[dict[str, str]], scenes: Many[str]) -> str:
    frames = sorted({row["frames"] for row in rows}, key=lambda text: (len(text), text))
    machines, dates = (", ".join(sorted({row[name] for row in rows if row[name]})) for name in _SAID)
    return f"{', '.join(scenes)}; {' or '.join(frames)} frames; {machines}; {dates}"


def pareto_front(points: Many[tuple[float, float]]) -> list[int]:
    """Indices of the points that no other one beats in both coordinates, by the first coordinate."""
    front: list[int] = []
    for index in sorted(range(len(points)), key=lambda i: points[i]):
        if not front or points[index][1] < points[front[-1]][1]:
            front.append(index)
    return front


def draw(runs: Runs, path: Path) -> None:
    """Write the chart as a PNG: a panel for each error, log axes, the Pareto front marked.

    Raises
    ------
    ValueError
        If matplotlib is not installed, the suffix is another, or no run has both a time and an error.
    """
    if path.suffix.lower() != ".png":
        raise ValueError(f"{path}: the chart is written as .png.")
    shown = [key for key in ERRORS if any(run.seconds is not None and key in run.errors for run in runs.runs)]
    if not shown:
        raise ValueError("No run has both a time and an error; there is nothing to draw.")
    try:
        from matplotlib.figure import Figure
    except ImportError:
        raise ValueError("smokelift chart needs matplotlib: pip install matplotlib.") from None
    across = min(len(shown), 2)
    down = -(-len(shown) // across)
    figure = Figure(figsize=(6.5 * across, 5.2 * down), layout="constrained")
    series = dict.fromkeys(run.series for run in runs.runs)
    colours = {name: f"C{index}" for index, name in enumerate(series)}
    panels = np.atleast_1d(figure.subplots(down, across)).ravel()
    for axes, key in zip(panels, shown, strict=False):
        _panel(axes, [run for run in runs.runs if key in run.errors], key, colours)
    for axes in panels[len(shown) :]:
        axes.set_axis_off()
    handles = {name: handle for axes in panels for handle, name in zip(*axes.get_legend_handles_labels(), strict=True)}
    figure.legend(handles.values(), handles, loc="outside upper center", ncols=len(handles), fontsize=9, frameon=False)
    figure.supxlabel(runs.caption, fontsize=7)
    with atomic_path(path) as aside:
        figure.savefig(aside, dpi=130, format="png")


def _panel(axes: Any, runs: list[Run], key: str, colours: dict[str, str]) -> None:
    timed = [(run, run.seconds, run.errors[key]) for run in runs if run.seconds is not None]
    front = pareto_front([(seconds, error) for _, seconds, error in timed])
    axes.plot(
        [timed[i][1] for i in front],
        [timed[i][2] for i in front],
        color="black", linewidth=1, marker="o", markersize=11, fillstyle="none", label="Pareto front",
    )  # fmt: skip
    for name in dict.fromkeys(run.series for run, _, _ in timed):
        plain = sorted((seconds, error) for run, seconds, error in timed if run.series == name and not run.changes)
        changed = [(seconds, error) for run, seconds, error in timed if run.series == name and run.changes]
        if plain:
            axes.plot(*zip(*plain, strict=True), color=colours[name], marker="o", linewidth=0.8, label=name)
        if changed:
            axes.plot(*zip(*changed, strict=True), color=colours[name], marker="D", fillstyle="none", linestyle="none")
    times = [seconds for _, seconds, _ in timed]
    late = min(times) ** (1 / 3) * max(times) ** (2 / 3)
    for text, seconds, error in _labels(timed):
        aside, side = ((-7, 5), "right") if seconds > late else ((7, 5), "left")
        axes.annotate(text, (seconds, error), aside, textcoords="offset points", fontsize=7, ha=side)
    for run in runs:
        if run.seconds is None:
            axes.axhline(run.errors[key], color=colours[run.series], linestyle="--", linewidth=1)
            whole_width = axes.get_yaxis_transform()
            axes.text(0.99, run.errors[key], run.name, fontsize=8, ha="right", va="bottom", transform=whole_width)
    axes.set(xscale="log", yscale="log", xlabel="seconds a frame", title=ERRORS[key])
    axes.title.set_fontsize(9)
    _readable(axes.xaxis, times, room=1.5)
    _readable(axes.yaxis, [run.errors[key] for run in runs], room=1.3)
    axes.grid(alpha=0.3, which="both")


def _labels(timed: list[tuple[Run, float, float]]) -> list[tuple[str, float, float]]:
    """What is written beside which point: every change, and every resolution of a method once, at its slowest run."""
    labels = [(run.changes, seconds, error) for run, seconds, error in timed if run.changes]
    slowest: dict[tuple[str, str], tuple[str, float, float]] = {}
    for run, seconds, error in timed:
        beside = (run.method, run.resolution)
        if not run.changes and (beside not in slowest or seconds > slowest[beside][1]):
            slowest[beside] = (run.resolution, seconds, error)
    return [*labels, *slowest.values()]


def _readable(axis: Any, values: list[float], room: float) -> None:
    """Plain numbers on a logarithmic axis, closer where it is short; so much room above the values."""
    low, high = min(values) / 1.3, max(values) * room
    steps = (1, 2, 5) if high / low > 8 else (1, 1.5, 2, 3, 4, 5, 6, 7, 8, 9)
    powers = range(math.floor(math.log10(low)), math.ceil(math.log10(high)) + 1)
    ticks = [step * 10.0**power for power in powers for step in steps if low <= step * 10.0**power <= high]
    axis.set_ticks(ticks, [f"{tick:g}" for tick in ticks])
    axis.set_ticks([], minor=True)
    (axis.axes.set_xlim if axis.axis_name == "x" else axis.axes.set_ylim)(low, high)
