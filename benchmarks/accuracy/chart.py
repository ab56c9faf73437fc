"""Speed against accuracy: time, errors and patches, from the figures of `python -m benchmarks.accuracy`.

python -m benchmarks.accuracy.chart OUT/accuracy.csv docs/accuracy_chart.png
"""

import math
import sys
from collections.abc import Sequence
from itertools import product
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.accuracy.measured_runs import ERRORS, Run, Runs, read_runs

SECONDS = "seconds"

PANELS = ((SECONDS, "view_error"), ("view_error", "patches"))
"""Across and up in each: speed against accuracy, and how right new views are against how like smoke they look."""

NAMES = {SECONDS: "processor seconds per frame", **ERRORS}

DIRECTIONS = [(round(np.cos(turn), 3), round(np.sin(turn), 3)) for turn in np.pi * np.arange(16) / 8]
DISTANCES = (10, 16, 26, 40, 60, 90, 130)
"""Where the label of a point is tried: directions from it, and how far away its corner lies (pixels)."""

MARKER = 12.0
"""Size of a point, which no label hides (pixels)."""

EDGE = 40.0
"""Pixels from the right edge at which a level that has no time gets its label."""

DPI = 130


def pareto_front(points: Sequence[tuple[float, float]]) -> list[int]:
    """Indices of the points that no other one beats in both coordinates, by the first coordinate."""
    front: list[int] = []
    for index in sorted(range(len(points)), key=lambda i: points[i]):
        if not front or points[index][1] < points[front[-1]][1]:
            front.append(index)
    return front


def chart(runs: Runs) -> Any:
    """Return the chart as a matplotlib figure: log axes, the Pareto fronts, the default, and the curve of the detail.

    Raises
    ------
    ValueError
        If no run has both a time and an error.
    """
    shown = [panel for panel in PANELS if any(_at(run, panel) is not None for run in runs.runs)]
    if not any(across == SECONDS for across, _ in shown):
        raise ValueError("No run has both a time and an error; there is nothing to draw.")
    from matplotlib.figure import Figure

    figure = Figure(figsize=(6.5 * len(shown), 5.2), dpi=DPI, layout="constrained")
    colors = {name: f"C{index}" for index, name in enumerate(dict.fromkeys(run.series for run in runs.runs))}
    panels = figure.subplots(1, len(shown), squeeze=False)[0]
    for axes, panel in zip(panels, shown, strict=True):
        _panel(axes, runs, panel, colors)
    handles = {name: handle for axes in panels for handle, name in zip(*axes.get_legend_handles_labels(), strict=True)}
    figure.legend(handles.values(), handles, loc="outside upper center", ncols=len(handles), fontsize=9, frameon=False)
    figure.supxlabel(runs.caption, fontsize=7)
    figure.draw_without_rendering()
    figure.set_layout_engine("none")  # places in pixels hold from here on
    for axes, panel in zip(panels, shown, strict=True):
        _label(axes, runs, panel)
    return figure


def _at(run: Run, panel: tuple[str, str]) -> tuple[float, float] | None:
    """Where a run stands in a panel; None if one of the two was not measured."""
    across, up = (run.seconds if key == SECONDS else run.errors.get(key) for key in panel)
    return None if across is None or up is None else (across, up)


def _panel(axes: Any, runs: Runs, panel: tuple[str, str], colors: dict[str, str]) -> None:
    """Draw one panel: the Pareto front, every series in its color, the default, and runs without a time as levels."""
    placed = [(run, at) for run in runs.runs if (at := _at(run, panel)) is not None]
    points = [at for _, at in placed]
    front = [points[index] for index in pareto_front(points)]
    axes.plot(
        *zip(*front, strict=True),
        color="black", linewidth=1, marker="o", markersize=12, fillstyle="none", label="Pareto front",
    )  # fmt: skip
    for name in dict.fromkeys(run.series for run, _ in placed):
        _series(axes, name, [(run, at) for run, at in placed if run.series == name], colors[name])
    if runs.default is not None and (at := _at(runs.default, panel)) is not None:
        axes.plot(*at, color="gold", marker="*", markersize=17, markeredgecolor="black", linestyle="none",
                  zorder=1, label="default")  # fmt: skip
    across, up = panel
    levels = [(run, run.errors[up]) for run in runs.runs if up in run.errors and _at(run, panel) is None]
    for run, level in levels:
        axes.axhline(level, color=colors[run.series], linestyle="--", linewidth=1)
    axes.set(xscale="log", yscale="log", xlabel=NAMES[across], ylabel=NAMES[up])
    axes.xaxis.label.set_fontsize(9)
    axes.yaxis.label.set_fontsize(9)
    _readable(axes.xaxis, [x for x, _ in points], room=1.5)
    _readable(axes.yaxis, [*(y for _, y in points), *(level for _, level in levels)], room=1.3)
    axes.grid(alpha=0.3, which="both")


def _series(axes: Any, name: str, placed: list[tuple[Run, tuple[float, float]]], color: str) -> None:
    """Draw runs of one series: grids that were given as a line, the amount of detail as a dashed one, others alone."""
    given = sorted(at for run, at in placed if not run.changes and not run.chosen)
    detail = sorted((float(run.changes["detail"]), at) for run, at in placed if [*run.changes] == ["detail"])
    curve = [at for _, at in detail] + [at for run, at in placed if run.name == name and detail]
    for line, style in ((given, {"marker": "o"}), (curve, {"linestyle": "--"})):
        if line:
            axes.plot(*zip(*line, strict=True), color=color, linewidth=0.8, **style)
    for run, at in placed:
        if run.changes or run.chosen:
            axes.plot(*at, color=color, marker="s" if run.chosen else "D", fillstyle="none")
    axes.plot([], [], color=color, marker="o", label=name)


def _label(axes: Any, runs: Runs, panel: tuple[str, str]) -> None:
    """Write beside every point what it is, at the nearest place where it lies over no other label."""
    from matplotlib.transforms import Bbox

    window = axes.get_window_extent()
    placed = []
    for run in runs.runs:
        if (at := _at(run, panel)) is not None:
            placed.append((run.label, axes.transData.transform(at)))
        elif panel[1] in run.errors:  # its level is a line
            placed.append((run.label, (window.x1 - EDGE, axes.transData.transform((1, run.errors[panel[1]]))[1])))
    taken = [Bbox.from_bounds(x - MARKER / 2, y - MARKER / 2, MARKER, MARKER) for _, (x, y) in placed]
    for label, point in placed:
        text = axes.text(0, 0, label, fontsize=8, transform=None)
        for distance, (x, y) in product(DISTANCES, DIRECTIONS):
            corner = np.add(point, (distance * x, distance * y))
            text.set(position=corner, ha="left" if x > 0 else "right", va="bottom" if y > 0 else "top")
            box = text.get_window_extent().padded(2)
            inside = window.x0 < box.x0 and box.x1 < window.x1 and window.y0 < box.y0 and box.y1 < window.y1
            if inside and not any(box.overlaps(other) for other in taken):
                break
        taken.append(box)
        if distance > DISTANCES[1]:
            axes.plot(*zip(point, corner, strict=True), color="black", linewidth=0.4, transform=None)


def _readable(axis: Any, values: list[float], room: float) -> None:
    """Plain numbers on a logarithmic axis, closer where it is short; so much room above the values."""
    low, high = min(values) / 1.3, max(values) * room
    steps = (1, 2, 5) if high / low > 8 else (1, 1.5, 2, 3, 4, 5, 6, 7, 8, 9)
    powers = range(math.floor(math.log10(low)), math.ceil(math.log10(high)) + 1)
    ticks = [step * 10.0**power for power in powers for step in steps if low <= step * 10.0**power <= high]
    axis.set_ticks(ticks, [f"{tick:g}" for tick in ticks])
    axis.set_ticks([], minor=True)
    (axis.axes.set_xlim if axis.axis_name == "x" else axis.axes.set_ylim)(low, high)


if __name__ == "__main__":
    chart(read_runs(Path(sys.argv[1]))).savefig(sys.argv[2], format="png")
