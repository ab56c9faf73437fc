"""The pipeline's results as a table for a terminal, beside the paper's times."""

from typing import Any

from rich.table import Table

from benchmarks.machine import provenance_text
from benchmarks.tables import printed, size_text

WIDTH = 110

PAPER = {(64, 64, 96): (0.08, 6.13), (128, 128, 192): (0.12, 8.75), (256, 256, 288): (0.78, 21.31)}
"""Seconds a frame in the paper's table 2 by size, rendering and whole frame, on an RTX 2080 Ti."""


def text(results: dict[str, Any]) -> str:
    """Return the table and how to read it."""
    table = Table(title=f"{results['clip']} clip, {results['quality']}", title_justify="left")
    table.add_column("voxels, method")
    for heading in ("density s", "velocity s", "frame s", "solves", "MiB", "front dB", "paper's s"):
        table.add_column(heading, justify="right")
    for run in results["runs"]:
        table.add_row(f"{size_text(run['size'])}, {run['method']}", *_cells(run))
    failures = [
        f"{size_text(run['size'])}, {run['method']}: {run['failure']}" for run in results["runs"] if run["failure"]
    ]
    legend = (
        "Medians over the frames, from decoding the clip to OpenVDB files on disk. solves: the frame in Poisson solves "
        "(scipy's cosine transforms) of the same grid, timed between the frames. MiB: peak of memory. front: PSNR of "
        "the working picture, linear. paper's: rendering / whole frame in its table 2, on an RTX 2080 Ti."
    )
    return printed(WIDTH, [provenance_text(results), table, *failures, legend])


def _cells(run: dict[str, Any]) -> list[str]:
    if run["failure"]:
        return ["see below"]
    memory = "?" if run["memory_mib"] is None else f"{run['memory_mib']:.0f}"
    paper = PAPER.get(tuple(run["size"]))
    return [
        f"{run['seconds_density']:.2f}",
        f"{run['seconds_velocity']:.2f}",
        f"{run['seconds']:.2f}",
        f"{run['solves']:.0f}",
        memory,
        f"{run['psnr']:.1f}",
        "" if paper is None else f"{paper[0]} / {paper[1]}",
    ]
