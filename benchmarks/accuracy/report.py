"""The figures of all runs as a Markdown table, as CSV and as a sheet of pictures."""

import csv
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks import tables
from benchmarks.accuracy.scenes import KnownScene
from benchmarks.accuracy.score import images
from smokelift.evaluation.orbit import SHAPES
from smokelift.footage.images import area_average
from smokelift.output.images import eight_bit, write_sheet

Row = dict[str, Any]

Column = tuple[str, list[str], str]
"""Heading, the figures that share the column, and their format."""

_COST: list[Column] = [
    ("processor s per frame", ["seconds"], ".2f"),
    ("solves", ["solves"], ".0f"),
    ("MiB", ["memory_mib"], ".0f"),
]

ORBIT_COLUMNS: list[Column] = [
    ("patches, worst", ["patches", "patches_worst"], ".3f"),
    ("(own)", ["patches_own"], ".3f"),
    ("texture (own)", ["texture", "texture_own"], ".2f"),
    ("edges", ["edges"], ".2f"),
    ("halo", ["halo"], ".1%"),
    ("flicker", ["flicker"], ".2f"),
]

SHAPE_COLUMNS: list[Column] = [(f"{name.replace('_', ' ')} (true)", [name, f"{name}_truth"], ".2f") for name in SHAPES]


def table_columns(known: KnownScene) -> list[list[Column]]:
    """Return the columns of a scene's tables: errors, whether it looks like smoke from all around, and its shapes."""
    views = list(known.cameras)
    return [capture_columns(views) if known.truth is None else error_columns(views), ORBIT_COLUMNS, SHAPE_COLUMNS]


def error_columns(views: list[str]) -> list[Column]:
    """Return the columns of the errors: how near a run is to the truth, and what it costs."""
    return [
        (f"PSNR {' / '.join(views)}", [f"psnr_{view}" for view in views], ".1f"),
        ("SSIM input, new", [f"ssim_{views[0]}", "ssim_new"], ".3f"),
        ("density", ["density_error"], ".2f"),
        ("height mass", ["height_mass_error"], ".2f"),
        ("mass", ["mass_ratio"], ".2f"),
        ("velocity, cosine", ["velocity_error", "velocity_cosine"], ".2f"),
        ("around", ["velocity_error_around", "velocity_cosine_around"], ".2f"),
        ("div (true)", ["divergence", "divergence_truth"], ".0e"),
        ("warp error (true)", ["warp_error", "warp_error_truth"], ".2f"),
        *_COST,
    ]


def capture_columns(views: list[str]) -> list[Column]:
    """Return the columns of the errors where only pictures are known, by cameras that differ in exposure."""
    new = views[1:]
    return [
        ("PSNR input", [f"psnr_{views[0]}"], ".1f"),
        (f"PSNR {' / '.join(new)}", [f"psnr_{view}" for view in new], ".1f"),
        ("mean", ["psnr_new"], ".1f"),
        ("with a gain", [f"gain_psnr_{view}" for view in new], ".1f"),
        ("mean", ["gain_psnr_new"], ".1f"),
        ("gain", [f"gain_{view}" for view in new], ".2f"),
        ("SSIM input", [f"ssim_{views[0]}"], ".3f"),
        ("SSIM new, with a gain", ["ssim_new", "gain_ssim_new"], ".3f"),
        *_COST,
    ]


def markdown(rows: list[Row], shown: list[Column]) -> str:
    """Return a table of some runs."""
    cells = [[row["scene"], row["run"], *(tables.cell(row, names, form) for _, names, form in shown)] for row in rows]
    return tables.markdown(["scene", "run", *(heading for heading, _, _ in shown)], cells)


def write(out: Path, name: str, rows: list[Row], scenes: list[KnownScene]) -> None:
    """Write the table, on one page with the pictures, and every figure as CSV."""
    names = dict.fromkeys(column for row in rows for column in row)
    with (out / f"{name}.csv").open("w", newline="") as file:
        writer = csv.DictWriter(file, names)
        writer.writeheader()
        writer.writerows(rows)
    # a capture is there twice, so its mean would say nothing
    all_rows = rows + _means(rows) if scenes[0].truth is not None else rows
    both = [markdown(all_rows, shown) for shown in table_columns(scenes[0])]
    said = f"{rows[0]['machine']}, {rows[0]['date']}"
    (out / f"{name}.md").write_text("\n\n".join([said, *both, f"![Pictures]({name}.png)"]) + "\n")


def contact_sheet(
    scenes: list[KnownScene], shown: list[str], folder: Callable[[KnownScene, str], Path], path: Path
) -> None:
    """Write a picture of the last scored frames: one row per scene; for every view the truth and some runs."""
    rows = []
    for known in scenes:
        last = known.scored[-1:]
        pictured = {run: next(images(known, run, folder(known, run), last))[1] for run in shown}
        width, height = next(iter(known.cameras.values())).size
        tiles = [
            image
            for view in known.cameras
            for image in (known.seen(view, last[0]), *(pictured[run][view] for run in shown))
        ]
        rows.append([eight_bit(area_average(tile, width // 2, height // 2)) for tile in tiles])
    titles = [f"{view}: {what}" for view in scenes[0].cameras for what in ("truth", *shown)]
    labels = [f"{known.name}, frame {known.scored[-1]}" for known in scenes]
    write_sheet(path, rows, titles, labels)


def _means(rows: list[Row]) -> list[Row]:
    """Return the mean of every run over the scenes, if there are several."""
    if len({row["scene"] for row in rows}) < 2:
        return []
    found = []
    for run in dict.fromkeys(row["run"] for row in rows):
        of_run = [row for row in rows if row["run"] == run]
        mean: Row = {"scene": "**mean**", "run": run}
        for name in of_run[0]:
            values = [value for row in of_run if isinstance(value := row.get(name), int | float)]
            if len(values) == len(of_run):
                mean[name] = float(np.mean(values))
        found.append(mean)
    return found
