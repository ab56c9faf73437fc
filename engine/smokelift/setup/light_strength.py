"""How strong the given lights are, where the clip shows smoke that they cannot make as bright.

Lights that are too strong are met by thinner smoke, and no picture tells. Lights that are too weak are met by thicker
smoke only until it hides what is behind it: then the densities that fit best are too dark, and stronger light comes
nearer to the clip.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from smokelift.density import DensitySettings
from smokelift.scene import CompleteScene
from smokelift.setup.choice import Choice
from smokelift.setup.coarse import CoarseFrame
from smokelift.setup.scattering import held_out_error

STEP = 1.25
"""Ratio of one strength to the next that is tried: smoke nearly as bright as its light allows differs by as much in
optical depth."""

MOST = 8.0
"""Largest strength that is tried. Light given in other units than the picture's is a mistake, not a measurement."""


def choose_strength(
    frames: Sequence[CoarseFrame], settings: DensitySettings, tolerance: float
) -> tuple[float, float, tuple[Choice[str], ...]]:
    """Choose the strength of the lights as a multiple of what is given.

    Parameters
    ----------
    frames
        At least one; their scenes have the given lights, and scatter light any number of times.
    settings
        How to fit.
    tolerance
        Error, as a share of what the smoke changes in the picture, that stronger light has to take away.

    Returns
    -------
    factor
        1 where the clip does not contradict the given lights.
    error
        What multiple scattering in light of that strength leaves (`held_out_error`).
    choices
        One where it does, else none.
    """

    def error(factor: float) -> float:
        lit = [frame.in_light_of(scaled(frame.scene, factor)) for frame in frames]
        return held_out_error(lit, "multiple", "multiple", settings)

    errors = {1.0: error(1.0)}
    factor = STEP
    while factor <= MOST:
        errors[factor] = error(factor)
        if errors[factor] > min(errors.values()):
            break
        factor *= STEP
    # the weakest of those that are nearly as good as the best
    chosen = next(factor for factor, tried in errors.items() if tried <= min(errors.values()) + tolerance)
    if chosen == 1.0:
        return 1.0, errors[1.0], ()
    reason = (
        f"Light: {chosen:.2f} times as strong as given, since the smoke is brighter than the given light can make it; "
        f"held-out pixels differ by {errors[chosen]:.1%} of the smoke's contrast instead of {errors[1.0]:.1%}."
    )
    measured = {"factor": chosen, "error": errors[chosen], "error_as_given": errors[1.0]}
    return chosen, errors[chosen], (Choice("light strength", f"{chosen:.3g}", reason, measured, tolerance),)


def scaled(scene: CompleteScene, factor: float) -> CompleteScene:
    """The scene with lights ``factor`` times as strong."""
    return scene if factor == 1.0 else replace(scene, lights=tuple(light.scaled(factor) for light in scene.lights))
