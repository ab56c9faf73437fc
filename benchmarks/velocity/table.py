"""The velocity's results as tables for a terminal, one for each size."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from rich.console import RenderableType
from rich.table import Table

from benchmarks.machine import provenance_text
from benchmarks.tables import number, printed, size_text

WIDTH = 110


def text(results: dict[str, Any]) -> str:
    """Return the table of each size, and how to read it."""
    parts: list[RenderableType] = [provenance_text(results)]
    for row in results["sizes"]:
        parts.append(
            f"\n{size_text(row['size'])}, {row['scene']}: {row['voxels_a_frame']:.2g} voxels a frame on average; "
            f"a Poisson solve takes {row['poisson_ms']:.3g} ms"
        )
        parts.append(_estimates(row))
    parts.append(
        "\nsolves: time in Poisson solves (scipy's cosine transforms) of the same grid just before and after. "
        "error: of the motion of a frame, relative L2 in the smoke and two voxels around it, without the inlet; "
        "estimates have no prediction and do not know the inlet. * default settings."
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
