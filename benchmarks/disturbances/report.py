"""What was measured: the CSV that grows row by row, the strengths from which accuracy is lost, charts and table."""

import csv
import math
from collections.abc import Sequence
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks import charts, tables
from benchmarks.disturbances.measure import Figures
from benchmarks.disturbances.table import DISTURBANCES
from smokelift.checks.array_types import Doubles
from smokelift.setup.settings import METHODS

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
HIGHEST = 4.0
"""Largest error that a chart shows."""


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

    def values(self, name: str, strength: float, method: str, figure: str) -> Doubles:
        """Return a figure of every scene."""
        return np.array([self.value((name, strength, scene, method), figure) for scene in self.scenes(name, method)])

    def changes(self, name: str, strength: float, method: str) -> Doubles:
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


def mean(values: Doubles) -> float:
    """Return the mean over the scenes on which something was measured; NaN without any."""
    measured = values[~np.isnan(values)]
    return float(measured.mean()) if measured.size else math.nan


def curves(results: Results, name: str, method: str, figure: str) -> Doubles:
    """Return a disturbance's curves (scenes, strengths): of ``psnr_new`` the changes, else the figure; NaN for none."""
    each = [
        results.changes(name, strength, method)
        if figure == "psnr_new"
        else results.values(name, strength, method, figure)
        for strength in DISTURBANCES[name].strengths
    ]
    return np.stack(each, axis=1)


def draw(results: Results, figure: str, label: str, path: Path) -> None:
    """Draw a chart a disturbance that has the figure: thin lines for scenes, thick ones where all of them have it.

    Nothing is drawn where none has it: a scene counts once the default is measured on it undisturbed.
    """
    shown: dict[str, dict[str, Doubles]] = {}
    for name in DISTURBANCES:
        found: dict[str, Doubles] = {method: curves(results, name, method, figure) for method in METHODS}
        if measured := {method: lines for method, lines in found.items() if not np.isnan(lines).all()}:
            shown[name] = measured
    if not shown:
        return
    from matplotlib.figure import Figure

    rows = -(-len(shown) // COLUMNS)
    sheet = Figure(figsize=(3.1 * COLUMNS, 2.5 * rows), layout="constrained")
    axes = sheet.subplots(rows, COLUMNS, squeeze=False).ravel()
    for plot in axes[len(shown) :]:
        plot.axis("off")
    for (name, lines), plot in zip(shown.items(), axes, strict=False):
        _panel(plot, results, name, lines, figure)
    for plot in axes[::COLUMNS]:
        plot.set_ylabel(label, fontsize=7)
    handles = [axes[0].plot([], [], color=COLOURS[method], label=NAMES[method])[0] for method in METHODS]
    axes[0].legend(handles=handles, fontsize=7)
    charts.save(sheet, path, dpi=75)


def _panel(plot: Any, results: Results, name: str, lines: dict[str, Doubles], figure: str) -> None:
    """Draw one disturbance."""
    disturbance = DISTURBANCES[name]
    at = np.arange(len(disturbance.strengths)) if disturbance.labels else np.array(disturbance.strengths)
    for method, each in lines.items():
        colour = COLOURS[method]
        for line in each:
            there = ~np.isnan(line)
            plot.plot(at[there], line[there], color=colour, marker=".", markersize=4, linewidth=0.7)
        whole = each.mean(axis=0)
        there = ~np.isnan(whole)
        plot.plot(at[there], whole[there], color=colour, linewidth=2.2)
        refused = [x for x, s in zip(at, disturbance.strengths, strict=True) if _refused(results, name, s, method)]
        plot.plot(refused, [0.03] * len(refused), "x", color=colour, transform=plot.get_xaxis_transform())
    if disturbance.logarithmic:
        plot.set_xscale("log")
        plot.minorticks_off()
    if disturbance.logarithmic or disturbance.labels:
        names = disturbance.labels or [f"{strength:g}" for strength in disturbance.strengths]
        plot.set_xticks(at, names, rotation=40 if disturbance.labels else 0)
    for strength in disturbance.common:
        plot.axvline(strength, color="0.85", linewidth=5, zorder=0)
    if figure == "psnr_new":
        plot.axhline(-LOSS, color="tab:red", linewidth=0.7, linestyle=":")
        for strength in _lost(results, name):
            plot.axvline(strength, color="tab:red", linewidth=0.8)
    else:
        plot.set_ylim(0, min(1.05 * plot.get_ylim()[1], HIGHEST))
    scenes = " / ".join(str(len(each)) for each in lines.values())
    plot.set_title(f"{disturbance.title} ({scenes} scene{'' if scenes == '1' else 's'})", fontsize=8)
    plot.set_xlabel(disturbance.unit, fontsize=7)
    plot.tick_params(labelsize=7)


def _lost(results: Results, name: str) -> list[float]:
    """Return the strengths from which the default loses a `LOSS`, on the mean of the scenes measured at each."""
    disturbance = DISTURBANCES[name]
    if disturbance.labels:
        return []
    ours = [mean(values) for values in curves(results, name, METHODS[0], "psnr_new").T]
    known = [(x, change) for x, change in zip(disturbance.strengths, ours, strict=True) if not math.isnan(change)]
    if not known:
        return []
    strengths, changes = zip(*known, strict=True)
    return losing(strengths, changes, disturbance.undisturbed, disturbance.logarithmic)


def _refused(results: Results, name: str, strength: float, method: str) -> bool:
    return any(results.refusal((name, strength, scene, method)) for scene in results.scenes(name, method))


def table(results: Results) -> str:
    """Return the page's table: a line a disturbance, with the strengths from which accuracy is lost."""
    lines = []
    for name, disturbance in DISTURBANCES.items():
        ours = curves(results, name, METHODS[0], "psnr_new")
        if disturbance.labels or np.isnan(ours).all():
            continue
        measured = [x for x, each in zip(disturbance.strengths, ours.T, strict=True) if not np.isnan(each).all()]
        lost = " and ".join(f"{strength:.2g}" for strength in _lost(results, name)) or "nowhere"
        known = [f"{disturbance.title}, {disturbance.unit}", f"{min(measured):.3g} to {max(measured):.3g}", lost]
        for strength in disturbance.common or (None,):
            line = [*known, "" if strength is None else f"{strength:.2g}"]
            for method in METHODS:
                line += ["", ""] if strength is None else _mean_and_worst(results.changes(name, strength, method))
            lines.append(line)
    head = [
        "disturbance",
        "measured",
        "1 dB lost from",
        "people meet",
        "there: mean (dB)",
        "worst (dB)",
        "the paper's method: mean (dB)",
        "worst (dB)",
    ]
    return tables.markdown(head, lines)


def _mean_and_worst(changes: Doubles) -> list[str]:
    return ["", ""] if math.isnan(mean(changes)) else [f"{mean(changes):+.1f}", f"{np.nanmin(changes):+.1f}"]
