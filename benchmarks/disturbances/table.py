"""Every disturbance: what it is called, its strengths, and what it does."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial

from benchmarks.disturbances import calls, smoke, spoiled
from benchmarks.disturbances.known import Known, Take
from benchmarks.disturbances.whole_run import whole_run
from benchmarks.measure import Figures
from smokelift.setup.settings import MethodName

Measure = Callable[[Known, float, MethodName], Figures]


@dataclass(frozen=True)
class Disturbance:
    """A disturbance.

    Attributes
    ----------
    title, unit
        What is disturbed, and what its strength means.
    measure
        Returns the figures of a scene, a strength and a method.
    strengths
        From weak to strong, or along a scale with the undisturbed value inside.
    undisturbed
        One of them, which disturbs nothing.
    common
        Those that people meet.
    logarithmic
        Whether a chart has them on a logarithmic scale.
    labels
        Their names, where they are numbers of cases.
    """

    title: str
    unit: str
    measure: Measure
    strengths: tuple[float, ...]
    undisturbed: float
    common: tuple[float, ...] = ()
    logarithmic: bool = False
    labels: tuple[str, ...] = ()


def _run(make: Callable[[Known, float], Take], known: Known, strength: float, method: MethodName) -> Figures:
    return whole_run(make(known, strength), method)


def _disturbed(
    make: Callable[[Known, float], Take],
    title: str,
    unit: str,
    strengths: tuple[float, ...],
    undisturbed: float = 0.0,
    common: tuple[float, ...] = (),
    logarithmic: bool = False,
    labels: tuple[str, ...] = (),
) -> Disturbance:
    """Return a disturbance of whole runs."""
    return Disturbance(title, unit, partial(_run, make), strengths, undisturbed, common, logarithmic, labels)


DISTURBANCES: dict[str, Disturbance] = {
    "noise": _disturbed(spoiled.noise, "Noise", "fraction of the 8-bit range", (0, 0.02, 0.05, 0.1, 0.2), common=(0.05,)),
    "crf": _disturbed(spoiled.compression, "H.264", "crf (none at -5)", (-5, 0, 20, 28, 35, 43, 50), -5, (35,)),
    "light": _disturbed(spoiled.wrong_light, "Wrong light", "degrees", (0, 15, 30, 60, 90, 180), common=(30,)),
    "extinction": _disturbed(
        spoiled.wrong_extinction, "Wrong extinction", "factor", (0.1, 0.5, 1, 2, 10), 1, (0.5, 2), True
    ),
    "flicker": _disturbed(
        spoiled.flicker, "Exposure flickers, black behind", "fraction", (0, 0.05, 0.1, 0.2, 0.4), common=(0.1,)
    ),
    "flicker-gray": _disturbed(
        spoiled.flicker_before_gray, "Exposure flickers, gray behind", "fraction", (0, 0.05, 0.1, 0.2, 0.4), common=(0.1,)
    ),
    "missing": _disturbed(spoiled.missing, "Frames missing", "fraction", (0, 1 / 6, 1 / 4, 1 / 3, 1 / 2), common=(1 / 3,)),
    "doubled": _disturbed(spoiled.doubled, "Frames doubled", "fraction", (0, 1 / 6, 1 / 3, 1 / 2, 1)),
    "cut": _disturbed(spoiled.cut, "A cut", "frames jumped", (0, 2, 5, 10, 14)),
    "blur": _disturbed(spoiled.blur, "Blur", "voxels", (0, 0.5, 1, 2, 4)),
    "saturated": _disturbed(spoiled.saturation, "White pixels", "fraction of the smoke's", (0, 0.02, 0.1, 0.3, 0.6)),
    "crushed": _disturbed(spoiled.crushing, "Crushed black", "sRGB level", (0, 0.02, 0.05, 0.1, 0.2, 0.4)),
    "background": _disturbed(
        spoiled.bright_background, "Bright background", "radiance beside the smoke's", (0, 0.25, 0.5, 1, 2)
    ),
    "optical-depth": _disturbed(
        smoke.optical_depth, "Optical depth", "of the thickest column", (0.001, 0.01, 0.1, 1, 5, 20, 100), 1,
        logarithmic=True,
    ),
    "albedo": _disturbed(smoke.albedo, "Albedo, gray behind", "", (0, 0.25, 0.5, 0.75, 1), 0.75),
    "anisotropy": _disturbed(smoke.anisotropy, "Anisotropy", "mean cosine", (-0.9, -0.5, 0, 0.5, 0.9)),
    "event": _disturbed(
        smoke.event, "What the smoke does", "", tuple(float(k) for k in range(len(smoke.EVENTS))),
        labels=tuple(smoke.EVENTS),
    ),
    "length": _disturbed(spoiled.clip_length, "Length of the clip", "frames", (1, 2, 3, 6, 12, 20), 6, (), True),
    "grid": _disturbed(
        spoiled.grid, "Boxes and grids", "", tuple(float(k) for k in range(len(spoiled.GRIDS))),
        float(list(spoiled.GRIDS).index("36 high")), labels=tuple(spoiled.GRIDS),
    ),
    "wrong-albedo": _disturbed(spoiled.wrong_albedo, "Wrong albedo", "factor", (0.25, 0.5, 1, 1.25), 1),
    "wrong-anisotropy": _disturbed(
        spoiled.wrong_anisotropy, "Wrong anisotropy", "mean cosine", (-0.9, -0.5, 0, 0.5, 0.9)
    ),
    "start": Disturbance(
        "Start of a fit wrong", "factor to the true density", calls.wrong_start, (0.01, 0.1, 0.5, 1, 2, 10, 100), 1,
        logarithmic=True,
    ),
    "motion": Disturbance(
        "Motion", "voxels a frame", calls.motion, (0.01, 0.1, 0.5, 1, 2, 5, 10, 20), 1, logarithmic=True
    ),
    "scale": Disturbance(
        "Density scaled", "factor", calls.scaled_density, (1e-6, 1e-3, 0.1, 1, 10, 1e3, 1e6), 1, logarithmic=True
    ),
}  # fmt: skip
"""Disturbances by the names that the command takes, those first whose strengths people meet."""
