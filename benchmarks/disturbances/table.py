"""Every disturbance: what it is called, its strengths, and what it does."""

from collections.abc import Callable
from dataclasses import dataclass

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
    undisturbed: float = 0.0
    common: tuple[float, ...] = ()
    logarithmic: bool = False
    labels: tuple[str, ...] = ()


def run(make: Callable[[Known, float], Take]) -> Measure:
    """Return what measures whole runs of takes."""
    return lambda known, strength, method: whole_run(make(known, strength), method)


FLICKER = (0, 0.05, 0.1, 0.2, 0.4)
COSINES = (-0.9, -0.5, 0, 0.5, 0.9)

DISTURBANCES: dict[str, Disturbance] = {
    "noise": Disturbance(
        "Noise", "fraction of the 8-bit range", run(spoiled.noise), (0, 0.02, 0.05, 0.1, 0.2), common=(0.05,)
    ),
    "crf": Disturbance(
        "H.264", "crf (none at -5)", run(spoiled.compression), (-5, 0, 20, 28, 35, 43, 50), -5, (35,)
    ),
    "light": Disturbance(
        "Wrong light", "degrees", run(spoiled.wrong_light), (0, 15, 30, 60, 90, 180), common=(30,)
    ),
    "extinction": Disturbance(
        "Wrong extinction", "factor", run(spoiled.wrong_extinction), (0.1, 0.5, 1, 2, 10), 1, (0.5, 2), True
    ),
    "flicker": Disturbance(
        "Exposure flickers, black behind", "fraction", run(spoiled.flicker), FLICKER, common=(0.1,)
    ),
    "flicker-gray": Disturbance(
        "Exposure flickers, gray behind", "fraction", run(spoiled.flicker_before_gray), FLICKER, common=(0.1,)
    ),
    "missing": Disturbance(
        "Frames missing", "fraction", run(spoiled.missing), (0, 1 / 6, 1 / 4, 1 / 3, 1 / 2), common=(1 / 3,)
    ),
    "doubled": Disturbance("Frames doubled", "fraction", run(spoiled.doubled), (0, 1 / 6, 1 / 3, 1 / 2, 1)),
    "cut": Disturbance("A cut", "frames jumped", run(spoiled.cut), (0, 2, 5, 10, 14)),
    "blur": Disturbance("Blur", "voxels", run(spoiled.blur), (0, 0.5, 1, 2, 4)),
    "saturated": Disturbance(
        "White pixels", "fraction of the smoke's", run(spoiled.saturation), (0, 0.02, 0.1, 0.3, 0.6)
    ),
    "crushed": Disturbance("Crushed black", "sRGB level", run(spoiled.crushing), (0, 0.02, 0.05, 0.1, 0.2, 0.4)),
    "background": Disturbance(
        "Bright background", "radiance beside the smoke's", run(spoiled.bright_background), (0, 0.25, 0.5, 1, 2)
    ),
    "optical-depth": Disturbance(
        "Optical depth", "of the thickest column", run(smoke.optical_depth), (0.001, 0.01, 0.1, 1, 5, 20, 100), 1,
        logarithmic=True,
    ),
    "albedo": Disturbance("Albedo, gray behind", "", run(smoke.albedo), (0, 0.25, 0.5, 0.75, 1), 0.75),
    "anisotropy": Disturbance("Anisotropy", "mean cosine", run(smoke.anisotropy), COSINES),
    "event": Disturbance(
        "What the smoke does", "", run(smoke.event), tuple(float(k) for k in range(len(smoke.EVENTS))),
        labels=tuple(smoke.EVENTS),
    ),
    "length": Disturbance(
        "Length of the clip", "frames", run(spoiled.clip_length), (1, 2, 3, 6, 12, 20), 6, logarithmic=True
    ),
    "grid": Disturbance(
        "Boxes and grids", "", run(spoiled.grid), tuple(float(k) for k in range(len(spoiled.GRIDS))),
        float(list(spoiled.GRIDS).index("36 high")), labels=tuple(spoiled.GRIDS),
    ),
    "wrong-albedo": Disturbance("Wrong albedo", "factor", run(spoiled.wrong_albedo), (0.25, 0.5, 1, 1.25), 1),
    "wrong-anisotropy": Disturbance("Wrong anisotropy", "mean cosine", run(spoiled.wrong_anisotropy), COSINES),
    "start": Disturbance(
        "Start of a fit wrong", "factor to the true density", calls.wrong_start, (0.01, 0.1, 0.5, 1, 2, 10, 100), 1,
        logarithmic=True,
    ),
    "motion": Disturbance(
        "Motion", "voxels per frame", calls.motion, (0.01, 0.1, 0.5, 1, 2, 5, 10, 20), 1, logarithmic=True
    ),
    "scale": Disturbance(
        "Density scaled", "factor", calls.scaled_density, (1e-6, 1e-3, 0.1, 1, 10, 1e3, 1e6), 1, logarithmic=True
    ),
}  # fmt: skip
"""Disturbances by the names that the command takes, those first whose strengths people meet."""
