"""The velocity's results as charts: distance from the optimum and error of the motion, against time."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from benchmarks import charts
from benchmarks.tables import size_text
from benchmarks.velocity.table import estimate_name

COLOURS = ("#0b6e99", "#d1652a", "#6a9a1f", "#8a4fa0", "#5c5c5c")

SOLVERS = {"projected-cg": ("-", "o", "projected CG"), "primal-dual": ("--", "s", "primal-dual")}

CURVES = {"iterations": ("-", "o", "iterations"), "primal_dual_iterations": ("--", "s", "steps of primal-dual")}

MARKERS = {"linearisations": "^", "levels": "D", "method": "X"}


def draw(results: dict[str, Any], path: Path) -> None:
    """Write a PNG with the charts of the results of `benchmarks.velocity.run.run`."""
    from matplotlib.lines import Line2D

    figure = charts.new_figure(results, 13, 6.6)
    left, right = figure.subplots(1, 2)
    sizes: Sequence[Mapping[str, Any]] = results["sizes"]
    for index, row in enumerate(sizes):
        colour = COLOURS[index % len(COLOURS)]
        _steps(left, row, colour)
        _estimates(right, row, colour)
    left.set(ylabel="relative distance to the optimum", title="One linear problem, the same for both solvers")
    right.set(ylabel="relative error of the motion", title="Whole estimates against known motion")
    for axes in (left, right):
        axes.set(xscale="log", yscale="log", xlabel="time in Poisson solves of the same size")
        axes.grid(alpha=0.3, which="both")
        _plain(axes.xaxis)
        _plain(axes.yaxis)

    def key(style: Any, marker: str, name: str, colour: str = "black", **more: Any) -> Any:
        return Line2D([], [], linestyle=style, marker=marker, color=colour, label=name, markersize=5, **more)

    colours = [
        key("-", "", f"{size_text(row['size'])}, {row['scene']}", COLOURS[index % len(COLOURS)], linewidth=3)
        for index, row in enumerate(sizes)
    ]
    solvers = [key(*solver) for solver in SOLVERS.values()]
    there = {estimate["setting"] for row in sizes for estimate in row["estimates"]}
    shown = [key(*curve) for name, curve in CURVES.items() if name in there]
    shown += [key("", marker, name) for name, marker in MARKERS.items() if name in there]
    shown.append(key("", "o", "default settings", markerfacecolor="none", markeredgewidth=1.5))
    shown[-1].set_markersize(11)
    for axes, handles in ((left, [*colours, *solvers]), (right, shown)):
        axes.legend(handles=handles, fontsize=8, frameon=False, ncols=3, loc="upper center", bbox_to_anchor=(0.5, -0.1))
    charts.save(figure, path)


def _steps(axes: Any, row: Mapping[str, Any], colour: str) -> None:
    for solver, (style, marker, _) in SOLVERS.items():
        mine = [step for step in row["steps"] if step["solver"] == solver]
        _curve(axes, mine, "distance", style, marker, colour)


def _estimates(axes: Any, row: Mapping[str, Any], colour: str) -> None:
    for name, (style, marker, _) in CURVES.items():
        mine = [estimate for estimate in row["estimates"] if estimate["setting"] == name]
        _curve(axes, mine, "error", style, marker, colour)
    for estimate in row["estimates"]:
        place = estimate["solves"], estimate["error"]
        if estimate["default"]:
            axes.plot(*place, marker="o", markersize=11, fillstyle="none", markeredgewidth=1.5, color=colour)
        if estimate["setting"] in MARKERS:
            axes.plot(*place, marker=MARKERS[estimate["setting"]], markersize=6, color=colour)
            name = estimate_name(estimate).removeprefix("method ")
            axes.annotate(name, place, (6, 4), textcoords="offset points", fontsize=7, color=colour)


def _curve(axes: Any, points: Sequence[Mapping[str, Any]], value: str, style: str, marker: str, colour: str) -> None:
    """Draw a line over time, each point with its number of iterations."""
    axes.plot(
        [point["solves"] for point in points],
        [point[value] for point in points],
        linestyle=style,
        marker=marker,
        markersize=4,
        color=colour,
    )
    for point in points:
        count = point["iterations"] if "iterations" in point else point["value"]
        axes.annotate(
            str(count), (point["solves"], point[value]), (3, 3), textcoords="offset points", fontsize=6, color=colour
        )


def _plain(axis: Any) -> None:
    """Write numbers instead of powers of ten."""
    from matplotlib.ticker import FuncFormatter, LogLocator

    axis.set_major_locator(LogLocator(subs=(1, 2, 5)))
    axis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
    axis.set_minor_formatter(FuncFormatter(lambda *_: ""))
