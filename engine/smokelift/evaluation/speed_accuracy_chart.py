"""Speed against accuracy: seconds a frame against four errors, from the figures of `python -m benchmarks.accuracy`."""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from smokelift.evaluation.measured_runs import ERRORS, Run, Runs
from smokelift.output.atomic import atomic_path


def pareto_front(points: Sequence[tuple[float, float]]) -> list[int]:
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
