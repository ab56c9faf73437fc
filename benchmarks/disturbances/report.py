"""What was measured: the CSV that grows row by row, the strengths from which accuracy is lost, charts and table."""

from __future__ import annotations

import csv
import math
from collections.abc import Sequence
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from benchmarks import charts, tables
from benchmarks.disturbances.measure import Figures
from benchmarks.disturbances.table import DISTURBANCES, Disturbance
from smokelift.setup.settings import METHODS

Floats = npt.NDArray[np.float64]
Key = tuple[str, float, str, str]
"""Disturbance, strength, scene, method."""

KEYS = ("disturbance", "strength", "scene", "method")
FIGURES = (
    "psnr_0", "psnr_20", "psnr_45", "psnr_90", "psnr_new", "density_error", "mass_ratio", "velocity_error", "refused",
)  # fmt: skip

LOSS = 1.0
"""dB in new views from which accuracy counts as lost."""

COLOURS = {"default": "tab:blue", "paper": "tab:orange"}
NAMES = {"default": "Smokelift", "paper": "the paper's method"}
COLUMNS = 4
HIGHEST = 3.0
"""Of errors on a chart, at most."""


class Results:
    """Figures by their keys, on disk after every one.

    Parameters
    ----------
    path
        A CSV that these results have written, or none yet.
    """

    def __init__(self, path: Path) -> None:
        self._path = path
        self._rows: dict[Key, dict[str, str]] = {}
        if not path.exists():
            with path.open("w", newline="") as file:
                csv.writer(file).writerow((*KEYS, *FIGURES))
        with path.open(newline="") as file:
            for row in csv.DictReader(file):
                self._rows[row["disturbance"], float(row["strength"]), row["scene"], row["method"]] = row

    def __contains__(self, key: Key) -> bool:
        return _stored(key) in self._rows

    def add(self, key: Key, figures: Figures) -> None:
        """Write the figures of a key."""
        values = {name: figures.get(name) for name in FIGURES}
        cells = {name: f"{value:.5g}" if isinstance(value, float) else value or "" for name, value in values.items()}
        with self._path.open("a", newline="") as file:
            csv.writer(file).writerow([*_stored(key), *cells.values()])
        self._rows[_stored(key)] = cells

    def refusal(self, key: Key) -> str:
        """Return the sentence that a run ended with; empty if it did not."""
        return self._rows.get(_stored(key), {}).get("refused", "")

    def scenes(self, name: str, method: str) -> list[str]:
        """Return the scenes on which a method was measured under a disturbance, and the default undisturbed."""
        rest = DISTURBANCES[name].undisturbed
        measured = dict.fromkeys(scene for n, _, scene, m in self._rows if (n, m) == (name, method))
        return [scene for scene in measured if (name, rest, scene, METHODS[0]) in self]

    def value(self, key: Key, figure: str) -> float:
        """Return a figure; NaN if it was not measured."""
        return float(self._rows.get(_stored(key), {}).get(figure) or math.nan)

    def values(self, name: str, strength: float, method: str, figure: str) -> Floats:
        """Return a figure of every scene."""
        return np.array([self.value((name, strength, scene, method), figure) for scene in self.scenes(name, method)])

    def changes(self, name: str, strength: float, method: str) -> Floats:
        """Return the new views' PSNR of every scene less that of the default undisturbed (dB)."""
        rest = DISTURBANCES[name].undisturbed
        undisturbed = [self.value((name, rest, scene, METHODS[0]), "psnr_new") for scene in self.scenes(name, method)]
        return np.subtract(self.values(name, strength, method, "psnr_new"), undisturbed)


def _stored(key: Key) -> Key:
    """Return a key with the strength as it is in a file."""
    return key[0], float(f"{key[1]:.6g}"), *key[2:]


def losing(strengths: Sequence[float], changes: Sequence[float], undisturbed: float, logarithmic: bool) -> list[float]:
    """Return where a curve falls below -`LOSS` first, on either side of the undisturbed strength.

    Parameters
    ----------
    strengths
        In rising order.
    changes
        In new views (dB); NaN where there is none. Between strengths they are interpolated.
    undisturbed
        One of the strengths.
    logarithmic
        Whether to interpolate by the strengths' logarithms.
    """
    middle = list(strengths).index(undisturbed)
    found = []
    for order in (range(middle, -1, -1), range(middle, len(strengths))):
        for near, far in pairwise(order):
            if changes[far] < -LOSS <= changes[near]:
                share = (changes[near] + LOSS) / (changes[near] - changes[far])
                a, b = ((math.log(x) if logarithmic else x) for x in (strengths[near], strengths[far]))
                at = a + share * (b - a)
                found.append(math.exp(at) if logarithmic else at)
                break
    return found


def mean(values: Floats) -> float:
    """Return the mean; NaN without any value, or if one was not measured: other scenes are other smoke."""
    return float(values.mean()) if values.size else math.nan


def curve(results: Results, name: str, method: str, figure: str) -> list[float]:
    """Return a disturbance's means over the scenes, a strength each: of ``psnr_new`` the changes, else the figure."""
    each = DISTURBANCES[name].strengths
    if figure == "psnr_new":
        return [mean(results.changes(name, strength, method)) for strength in each]
    return [mean(results.values(name, strength, method, figure)) for strength in each]


def draw(results: Results, figure: str, label: str, path: Path) -> None:
    """Draw a chart a disturbance that has the figure, with both methods."""
    from matplotlib.figure import Figure

    curves: dict[str, dict[str, list[float]]] = {
        name: {m: c for m in METHODS if not all(map(math.isnan, c := curve(results, name, m, figure)))}
        for name in DISTURBANCES
    }
    names = [name for name in DISTURBANCES if curves[name]]
    rows = -(-len(names) // COLUMNS)
    sheet = Figure(figsize=(3.1 * COLUMNS, 2.5 * rows), layout="constrained")
    axes = sheet.subplots(rows, COLUMNS, squeeze=False).ravel()
    for plot in axes[len(names) :]:
        plot.axis("off")
    for name, plot in zip(names, axes, strict=False):
        _panel(plot, results, name, curves[name], figure)
    for plot in axes[::COLUMNS]:
        plot.set_ylabel(label, fontsize=7)
    axes[0].legend(fontsize=7)
    charts.save(sheet, path, dpi=75)


def _panel(plot: Any, results: Results, name: str, curves: dict[str, list[float]], figure: str) -> None:
    """Draw one disturbance."""
    disturbance = DISTURBANCES[name]
    at = range(len(disturbance.strengths)) if disturbance.labels else disturbance.strengths
    for method, values in curves.items():
        style = {"color": COLOURS[method], "marker": "o", "markersize": 3}
        points = [(x, value) for x, value in zip(at, values, strict=True) if not math.isnan(value)]
        plot.plot(*zip(*points, strict=True), "" if disturbance.labels else "-", label=NAMES[method], **style)
        refused = [x for x, s in zip(at, disturbance.strengths, strict=True) if _refused(results, name, s, method)]
        plot.plot(refused, [0.03] * len(refused), "x", color=COLOURS[method], transform=plot.get_xaxis_transform())
    if disturbance.logarithmic:
        plot.set_xscale("log")
    if disturbance.labels:
        plot.set_xticks(at, disturbance.labels, rotation=40, ha="right")
    for strength in disturbance.met:
        plot.axvline(strength, color="0.8", linewidth=5, zorder=0)
    if figure == "psnr_new":
        plot.axhline(-LOSS, color="tab:red", linewidth=0.7, linestyle=":")
        if not disturbance.labels and METHODS[0] in curves:
            for strength in losing(
                disturbance.strengths, curves[METHODS[0]], disturbance.undisturbed, disturbance.logarithmic
            ):
                plot.axvline(strength, color="tab:red", linewidth=0.8)
    else:
        plot.set_ylim(0, min(plot.get_ylim()[1], HIGHEST))
    scenes = " / ".join(str(len(results.scenes(name, method))) for method in curves)
    plot.set_title(f"{disturbance.title} ({scenes} scenes)", fontsize=8)
    plot.set_xlabel(disturbance.unit, fontsize=7)
    plot.tick_params(labelsize=7)


def _refused(results: Results, name: str, strength: float, method: str) -> bool:
    return any(results.refusal((name, strength, scene, method)) for scene in results.scenes(name, method))


def table(results: Results) -> str:
    """Return the page's table: a line a disturbance."""
    lines = []
    for name, disturbance in DISTURBANCES.items():
        ours = curve(results, name, METHODS[0], "psnr_new")
        if disturbance.labels or all(map(math.isnan, ours)):
            continue
        losses = losing(disturbance.strengths, ours, disturbance.undisturbed, disturbance.logarithmic)
        lost = ", ".join(f"{strength:.2g}" for strength in losses) or "nowhere"
        line = [f"{disturbance.title}, {disturbance.unit}", _span(disturbance), lost]
        for method in METHODS:
            met = [results.changes(name, strength, method) for strength in disturbance.met]
            line.append("; ".join(f"{mean(c):+.1f} ({c.min():+.1f})" for c in met if not math.isnan(mean(c))))
        lines.append(line)
    head = ["disturbance", "strengths", "1 dB lost from", "where people meet it", "the paper's method there"]
    return tables.markdown(head, lines)


def _span(disturbance: Disturbance) -> str:
    met = f"; met: {', '.join(f'{x:.2g}' for x in disturbance.met)}" if disturbance.met else ""
    return f"{min(disturbance.strengths):.2g} to {max(disturbance.strengths):.2g}{met}"
