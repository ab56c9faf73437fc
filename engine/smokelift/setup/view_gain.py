"""How bright a further camera shows the smoke: cameras have exposures and white balances of their own.

Two pictures of one smoke bind each other: every slice across both cameras holds as much smoke in one as in the other.
So a density is fitted to both, on coarse frames and for several gains of the further one; the gain with which both are
fitted best is the camera's. Figures: docs/experiments/view-gain.md.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from smokelift.density import DensitySettings
from smokelift.scene import CompleteScene
from smokelift.setup.coarse import CoarseClip
from smokelift.setup.estimate import Estimate, measured
from smokelift.setup.held_out import HeldOut, held_out
from smokelift.setup.shot import ShotView

STEP = 1.2
"""Ratio of one gain to the next that is tried; between them it is where a parabola has its lowest point."""

MAX_GAIN = 8.0
"""Largest gain that is tried, and the inverse of the smallest: three stops."""

RATIO, RATIO_UNLIT = 1.2, 1.35
"""Ratio of brightness from which on it is the cameras', where light is known and where it is taken to come from
everywhere. Cameras that are exposed alike are found to differ by up to 1.15 and 1.30 (docs/experiments/view-gain.md):
coarse voxels cast other shadows, and light from one side is brighter there."""

COLOUR_RATIO = 1.05
"""Ratio of two colours from which on it is the cameras'; light and shadow do not change it."""

Gain = NDArray[np.float32]


def balanced(
    number: int,
    front: ShotView,
    view: ShotView,
    scene: CompleteScene,
    lit: bool,
    smoky: Sequence[int],
    settings: DensitySettings,
    tolerance: float,
) -> tuple[ShotView, tuple[Estimate[str], ...]]:
    """Bring a further view to the exposure of the input.

    Parameters
    ----------
    number
        Of the view, from 1.
    front, view
        The input and the further view; neither moves.
    scene
        With its lights and its model of scattering.
    lit
        Whether its lights are given, and not estimated.
    smoky
        Frames that are compared.
    settings
        How to fit.
    tolerance
        Error, as a share of what the smoke changes in the pictures, that a gain has to take away.

    Returns
    -------
    view
        The same one where its gain is no better than none.
    estimates
        One where it is, else none.
    """
    frames = CoarseClip((front, view), scene).smoky(smoky).values()
    if not frames or scene.scattering == "absorption":
        return view, ()

    def tried(gain: Gain) -> HeldOut:
        evened = [replace(frame, views=(frame.views[0], frame.views[1].over(gain))) for frame in frames]
        return held_out(evened, scene.scattering, scene.scattering, settings)

    as_it_is = tried(np.ones(3, np.float32)).error
    scalar = _best(lambda factor: tried(np.full(3, factor, np.float32)).error, as_it_is)
    own, other = np.maximum(tried(np.full(3, scalar, np.float32)).colours, 1e-6)
    ratio = other / own
    colour = ratio / np.exp(np.mean(np.log(ratio)))
    if max(scalar, 1 / scalar) < (RATIO if lit else RATIO_UNLIT):
        scalar = 1.0
    if colour.max() / colour.min() < COLOUR_RATIO:
        colour = np.ones(3)
    gain = (scalar * colour).astype(np.float32)
    if (gain == 1).all():
        return view, ()
    error = tried(gain).error
    if error >= as_it_is - tolerance:
        return view, ()
    named = ", ".join(f"{value:.2f}" for value in gain)
    figures = {"view": number, "error": error, "error_as_it_is": as_it_is}
    estimate = measured("gain of a view", named, figures, what=f"gain of view {number}", tolerance=tolerance)
    return _over(view, gain), (estimate,)


def _best(error_of: Callable[[float], float], at_one: float) -> float:
    """The gain of the least error, from 1 on downhill."""
    errors = {0: at_one}
    last = int(math.log(MAX_GAIN) / math.log(STEP))

    def error(step: int) -> float:
        if step not in errors:
            errors[step] = error_of(STEP**step)
        return errors[step]

    best = 0
    way = -1 if error(-1) < error(1) else 1
    while abs(best) < last and error(best + way) < error(best):
        best += way
    below, lowest, above = (error(step) for step in (best - 1, best, best + 1))
    bend = below - 2 * lowest + above
    return float(STEP ** (best + (0.5 * (below - above) / bend if bend > 0 else 0.0)))


def _over(view: ShotView, gain: Gain) -> ShotView:
    """The view with its pictures and backgrounds over a gain."""
    clip = view.clip.changed(lambda _, picture: picture / gain)
    return replace(view, clip=clip, plates=view.plates.through(lambda part: part / gain if part.ndim == 3 else part))
