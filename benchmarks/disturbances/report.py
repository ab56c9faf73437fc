"""What was measured: the strengths from which accuracy is lost, charts and table."""

import math
from collections.abc import Sequence
from functools import partial
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks import tables
from benchmarks.disturbances.table import DISTURBANCES
from smokelift.checks import Doubles
from smokelift.setup.settings import METHODS

LOSS = 1.0
"""dB in new views from which accuracy counts as lost."""

COLORS = {"default": "tab:blue", "paper": "tab:orange"}
NAMES = {"default": "Smokelift", "paper": "the paper's method"}
COLUMNS = 4
HIGHEST = 4.0
"""Largest error that a chart shows."""

HEADER = (
    "disturbance", "measured", "1 dB lost from", "usual", "there: mean (dB)", "worst (dB)",
    "the paper's method: mean (dB)", "worst (dB)",
)  # fmt: skip


class Results(tables.Rows):
    """Figures by disturbance, strength, scene and method.

    Parameters
    ----------
    path
        A CSV that these results have written, or none yet.
    """

    def __init__(self, path: Path) -> None:
        views = ("psnr_0", "psnr_20", "psnr_45", "psnr_90", "psnr_new")
        volumes = ("density_error", "mass_ratio", "velocity_error")
        super().__init__(path, ("disturbance", "strength", "scene", "method"), (*views, *volumes, "refused"))

    @staticmethod
    def key(name: str, strength: float, scene: str, method: str) -> tuple[str, ...]:
        """Return the key of a row, with the strength as it is in a file."""
        return name, str(float(f"{strength:.6g}")), scene, method

    def refused(self, name: str, strength: float, method: str) -> bool:
        """Whether the engine refused any of the scenes."""
        found = (self.find(self.key(name, strength, scene, method)) for scene in self.scenes(name, method))
        return any(row is not None and row["refused"] for row in found)

    def scenes(self, name: str, method: str) -> list[str]:
        """Return the scenes on which a method was measured under a disturbance, and the default undisturbed."""
        rest = DISTURBANCES[name].undisturbed
        measured = dict.fromkeys(scene for n, _, scene, m in self.keys if (n, m) == (name, method))
        return [scene for scene in measured if self.find(self.key(name, rest, scene, METHODS[0])) is not None]

    def values(self, name: str, strength: float, method: str, figure: str, scenes: Sequence[str] = ()) -> Doubles:
        """Return a figure of some scenes, or of every one of a method; NaN where it was not measured."""
        keys = [self.key(name, strength, scene, method) for scene in scenes or self.scenes(name, method)]
        found = [(self.find(key) or {}).get(figure) for key in keys]
        return np.array([math.nan if value is None else value for value in found], np.float64)

    def changes(self, name: str, strength: float, method: str) -> Doubles:
        """Return the new views' PSNR of every scene less that of the default undisturbed (dB)."""
        rest, scenes = DISTURBANCES[name].undisturbed, self.scenes(name, method)
        return self.values(name, strength, method, "psnr_new") - self.values(name, rest, METHODS[0], "psnr_new", scenes)


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
                part = (changes[near] + LOSS) / (changes[near] - changes[far])
                a, b = ((math.log(x) if logarithmic else x) for x in (strengths[near], strengths[far]))
                at = a + part * (b - a)
                found.append(math.exp(at) if logarithmic else at)
                break
    return found


def mean(values: Doubles) -> float:
    """Return the mean over the scenes on which something was measured; NaN without any."""
    measured = values[~np.isnan(values)]
    return float(measured.mean()) if measured.size else math.nan


def curves(results: Results, name: str, method: str, figure: str) -> Doubles:
    """Return a disturbance's curves (scenes, strengths): of ``psnr_new`` the changes, else the figure; NaN for none."""
    read = results.changes if figure == "psnr_new" else partial(results.values, figure=figure)
    return np.stack([read(name, strength, method) for strength in DISTURBANCES[name].strengths], axis=1)


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
    handles = [axes[0].plot([], [], color=COLORS[method], label=NAMES[method])[0] for method in METHODS]
    axes[0].legend(handles=handles, fontsize=7)
    sheet.savefig(path, dpi=75, format="png")


def _panel(plot: Any, results: Results, name: str, lines: dict[str, Doubles], figure: str) -> None:
    """Draw one disturbance."""
    disturbance = DISTURBANCES[name]
    at = np.arange(len(disturbance.strengths)) if disturbance.labels else np.array(disturbance.strengths)
    for method, each in lines.items():
        color = COLORS[method]
        for line in each:
            there = ~np.isnan(line)
            plot.plot(at[there], line[there], color=color, marker=".", markersize=4, linewidth=0.7)
        whole = each.mean(axis=0)
        there = ~np.isnan(whole)
        plot.plot(at[there], whole[there], color=color, linewidth=2.2)
        refused = [x for x, s in zip(at, disturbance.strengths, strict=True) if results.refused(name, s, method)]
        plot.plot(refused, [0.03] * len(refused), "x", color=color, transform=plot.get_xaxis_transform())
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


def table(results: Results) -> str:
    """Return the page's table: a line a disturbance, with the strengths from which accuracy is lost."""
    lines = []
    for key, disturbance in DISTURBANCES.items():
        ours = curves(results, key, METHODS[0], "psnr_new")
        if disturbance.labels or np.isnan(ours).all():
            continue
        measured = [x for x, each in zip(disturbance.strengths, ours.T, strict=True) if not np.isnan(each).all()]
        lost = " and ".join(f"{strength:.2g}" for strength in _lost(results, key)) or "nowhere"
        name = ", ".join(filter(None, (disturbance.title, disturbance.unit)))
        known = [name, f"{min(measured):.3g} to {max(measured):.3g}", lost]
        for strength in disturbance.common or (None,):
            line = [*known, "" if strength is None else f"{strength:.2g}"]
            for method in METHODS:
                line += ["", ""] if strength is None else _mean_and_worst(results.changes(key, strength, method))
            lines.append(line)
    return tables.markdown(HEADER, lines)


def _mean_and_worst(changes: Doubles) -> list[str]:
    return ["", ""] if math.isnan(mean(changes)) else [f"{mean(changes):+.1f}", f"{np.nanmin(changes):+.1f}"]
