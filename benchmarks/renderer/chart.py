"""The renderer's results as charts: time against size, and against the share of voxels with smoke."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from benchmarks import charts
from benchmarks.renderer.peers import OURS, PEERS


def draw(results: dict[str, Any], path: Path) -> None:
    """Write a PNG with the charts of the results of `benchmarks.renderer.run.run`."""
    figure = charts.new_figure(results, 15, 5.2)
    plume, full, shares = figure.subplots(1, 3, width_ratios=(3, 3, 2))
    full.sharey(plume)
    _sizes(plume, results, "plume", "smoke in 18 % of the voxels")
    _sizes(full, results, "full", "smoke everywhere")
    plume.set_ylabel("ms an iteration (image and gradient)")
    handles, labels = plume.get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside lower center", ncols=4, fontsize=8, frameon=False)
    _shares(shares, results)
    charts.save(figure, path)


def _sizes(axes: Any, results: dict[str, Any], scene: str, title: str) -> None:
    rows = [row for row in results["rows"] if row["scene"] == scene and row["median"]]
    for index, (key, peer) in enumerate(PEERS.items()):
        mine = [row for row in rows if row["peer"] == key]
        if not mine:
            continue
        ours = key == OURS
        axes.plot(
            [row["size"] for row in mine],
            [row["median"] for row in mine],
            color="black" if ours else f"C{index - 1}",
            linewidth=2.5 if ours else 1.2,
            linestyle="-" if all(row["exact"] for row in mine) else ":",
            marker="o",
            markersize=4,
            label=peer.title + ("" if all(row["exact"] for row in mine) else " (not exact)"),
        )
    sizes = sorted({row["size"] for row in rows})
    floors = [results["floor_ms"][str(size)] for size in sizes]
    axes.plot(sizes, floors, color="grey", linestyle="--", label="copy of ten volumes")
    axes.set(xscale="log", yscale="log", title=title, xlabel="voxels a side")
    axes.set_xticks(sizes, [str(size) for size in sizes], minor=False)
    axes.set_xticks([], minor=True)
    axes.grid(alpha=0.3)


def _shares(axes: Any, results: dict[str, Any]) -> None:
    rows = [row for row in results["shares"] if row["median"]]
    axes.plot([100 * row["share"] for row in rows], [row["median"] for row in rows], color="black", marker="o")
    axes.set(xlim=(0, 105), ylim=(0, None), xlabel="% of the voxels that can hold smoke", ylabel="ms an iteration")
    axes.set_title(f"Smokelift, {rows[0]['size']}$^3$" if rows else "")
    axes.grid(alpha=0.3)
