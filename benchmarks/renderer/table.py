"""The renderer's results as a table for a terminal."""

from __future__ import annotations

from typing import Any

from rich.table import Table

from benchmarks.machine import provenance_text
from benchmarks.renderer.peers import OURS, PEERS
from benchmarks.renderer.run import EXACT
from benchmarks.tables import number, printed

WIDTH = 150


def text(results: dict[str, Any]) -> str:
    """Return the table, how to read it, the failures, and the times of Smokelift alone."""
    table = Table(title=_title(results), title_justify="left")
    table.add_column("peer")
    for heading in ("ms", "from .. to", "x ours", "x floor", "MiB", "volumes", "set-up s", "image", "gradient"):
        table.add_column(heading, justify="right")
    table.add_column("")
    block = None
    for row in results["rows"]:
        if block != (row["size"], row["scene"]):
            block = row["size"], row["scene"]
            table.add_section()
            floor = results["floor_ms"][str(row["size"])]
            table.add_row(f"[bold]{row['size']}^3, smoke in {100 * row['share']:.0f} %", f"({floor:.3g})")
        table.add_row(*_cells(row))
    legend = (
        "ms: median of an iteration, image and gradient; in brackets the floor, a copy of ten volumes. x ours: "
        "relative to Smokelift just before and after. MiB, volumes: peak of memory beyond imports, density and "
        "compiler. set-up: compiler, tables and warm-up. image, gradient: "
        f"relative L2 error against float64; above {EXACT:g} a peer is not exact."
    )
    return printed(WIDTH, [table, legend, *_failures(results), *_ours_alone(results)])


def _title(results: dict[str, Any]) -> str:
    return provenance_text(results, "" if results["device"] == "cpu" else f", ours on the {results['device'].upper()}")


def _cells(row: dict[str, Any]) -> list[str]:
    name = PEERS[row["peer"]].title
    if row["failure"]:
        return [name, *[""] * 9, "see below"]
    times = row["milliseconds"]
    return [
        name,
        number(row["median"]),
        f"{number(min(times))} .. {number(max(times))}",
        "" if row["peer"] == OURS else number(row["ratio"]),
        number(row["floors"]),
        number(row["peak_mib"]),
        number(row["peak_volumes"]),
        number(row["compile_seconds"] + row["setup_seconds"]),
        f"{row['image_error']:.0e}",
        f"{row['gradient_error']:.0e}",
        "" if row["exact"] else "not exact",
    ]


def _failures(results: dict[str, Any]) -> list[str]:
    """Return every peer and its reason once, with the sizes."""
    sizes: dict[tuple[str, str], list[str]] = {}
    for row in results["rows"]:
        if row["failure"]:
            sizes.setdefault((PEERS[row["peer"]].title, row["failure"]), []).append(f"{row['size']}^3")
    return [f"{title}, {', '.join(dict.fromkeys(where))}: {why}" for (title, why), where in sizes.items()]


def _ours_alone(results: dict[str, Any]) -> list[str]:
    lines = []
    shares = [row for row in results["shares"] if row["median"]]
    if shares:
        times = ", ".join(f"{100 * row['share']:.0f} %: {number(row['median'])}" for row in shares)
        lines.append(f"Ours at {shares[0]['size']}^3 by share of voxels that can hold smoke, ms: {times}.")
    lights = {row["lights"]: row["median"] for row in results["lights"] if row["median"]}
    if len(lights) > 1:
        few, many = min(lights), max(lights)
        lines.append(
            f"Ours with {many} directional lights: {number(lights[many])} ms, "
            f"{number(lights[many] / lights[few])} times that of one."
        )
    return lines
