"""The velocity's results as tables for a terminal, two for each size."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

from rich.console import RenderableType
from rich.table import Table

from benchmarks.machine import provenance_text
from benchmarks.tables import number, printed, size_text

WIDTH = 110

SOLVERS = {"projected-cg": "projected conjugate gradients", "primal-dual": "primal-dual splitting"}

GOALS = (0.1, 0.05, 0.02)
"""Distances from the optimum at which the solvers are compared."""


def text(results: dict[str, Any]) -> str:
    """Return the tables of each size, linear problem and estimates, and how to read them."""
    parts: list[RenderableType] = [provenance_text(results)]
    for row in results["sizes"]:
        parts.append(
            f"\n{size_text(row['size'])}, {row['scene']}: {row['voxels_a_frame']:.2g} voxels a frame on average; "
            f"a Poisson solve takes {row['poisson_ms']:.3g} ms"
        )
        parts += [_linear(row), _comparison(row), _estimates(row)]
    parts.append(
        "\nsolves: time in Poisson solves (scipy's cosine transforms) of the same grid just before and after. "
        "distance: from the linear problem's optimum, relative L2 in the smoke. error: of the motion of a frame, "
        "relative L2 in the smoke and two voxels around it, without the inlet; estimates have no prediction and do not "
        "know the inlet. * default settings."
    )
    return printed(WIDTH, parts)


def estimate_name(estimate: Mapping[str, Any]) -> str:
    """Return the name of an estimate: how it differs from the default."""
    setting, value = estimate["setting"], estimate["value"]
    plain = {"iterations": "iterations", "primal_dual_iterations": "primal-dual steps"}
    if setting in plain:
        return f"{value} {plain[setting]}"
    if setting == "method":
        return f"method {value}"
    return f"{value} {setting if value != 1 else setting.removesuffix('s')}"


def solves_to_reach(row: Mapping[str, Any], solver: str, goal: float) -> float | None:
    """Return the Poisson solves after which a solver reaches a distance, interpolated; None if it does not."""
    before = None
    for step in (step for step in row["steps"] if step["solver"] == solver):
        if step["distance"] <= goal:
            if before is None:
                return float(step["solves"])
            share = math.log(before["distance"] / goal) / math.log(before["distance"] / step["distance"])
            return float(before["solves"] ** (1 - share) * step["solves"] ** share)
        before = step
    return None


def _linear(row: Mapping[str, Any]) -> Table:
    table = _table("one linear problem", "iterations", "distance", "solves", "ms")
    table.add_row("where both begin", "0", _percent(row["start"]), "", "")
    for step in row["steps"]:
        name, count, distance = SOLVERS[step["solver"]], str(step["iterations"]), _percent(step["distance"])
        table.add_row(name, count, distance, *_times(step))
    return table


def _estimates(row: Mapping[str, Any]) -> Table:
    table = _table("whole estimates", "error", "solves", "ms")
    for estimate in row["estimates"]:
        name = estimate_name(estimate) + (" *" if estimate["default"] else "")
        table.add_row(name, f"{estimate['error']:.3f}", *_times(estimate))
    return table


def _table(first: str, *others: str) -> Table:
    table = Table()
    table.add_column(first, min_width=29)
    for heading in others:
        table.add_column(heading, justify="right", min_width=8)
    return table


def _times(row: Mapping[str, Any]) -> tuple[str, str]:
    return number(row["solves"]), number(1e3 * row["seconds"])


def _comparison(row: Mapping[str, Any]) -> str:
    def reached(solver: str, goal: float) -> str:
        solves = solves_to_reach(row, solver, goal)
        return "not reached" if solves is None else number(solves)

    goals = "; ".join(
        f"{100 * goal:g} %: {reached('projected-cg', goal)} against {reached('primal-dual', goal)}" for goal in GOALS
    )
    return f"Solves to a distance, conjugate gradients against primal-dual: {goals}."


def _percent(share: float) -> str:
    return f"{100 * share:.2g} %"
