"""How strong the given lights are, where the clip shows smoke that they cannot make as bright.

Given lights are measured or tracked, and a picture hardly contradicts them: stronger light with thinner smoke meets it
as well or better, since thin smoke is the simpler one to fit. So the error alone would take light for too weak that is
right, and lose half of the smoke with it. Lights are too weak where even the densities that fit best are too dark:
more smoke would only hide what is behind it. Then the weakest light that leaves nothing dark is taken.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from smokelift.density import DensitySettings
from smokelift.scene import CompleteScene
from smokelift.setup.choice import Choice
from smokelift.setup.coarse import CoarseFrame
from smokelift.setup.scattering import HeldOut, held_out

STEP = 1.25
"""Ratio of one strength to the next that is tried: smoke nearly as bright as its light allows differs by as much in
optical depth."""

MOST = 8.0
"""Largest strength that is tried. Light given in other units than the picture's is a mistake, not a measurement."""

MISSING = 0.05
"""Light that may be missing before the given one is contradicted: blocks of multiple scattering are themselves up to as
much too dark (docs/experiments/multiple-scattering.md)."""


def choose_strength(
    frames: Sequence[CoarseFrame], settings: DensitySettings
) -> tuple[float, float, tuple[Choice[str], ...]]:
    """Choose the strength of the lights as a multiple of what is given.

    Parameters
    ----------
    frames
        At least one; their scenes have the given lights, and scatter light any number of times.
    settings
        How to fit.

    Returns
    -------
    factor
        1 where the clip does not contradict the given lights.
    error
        What multiple scattering in light of that strength leaves (`HeldOut.error`).
    choices
        One where it does, else none.
    """

    def measured(factor: float) -> HeldOut:
        lit = [frame.in_light_of(scaled(frame.scene, factor)) for frame in frames]
        return held_out(lit, "multiple", "multiple", settings)

    chosen, found = 1.0, measured(1.0)
    given = found
    while found.light > 1 + MISSING and chosen * STEP <= MOST:
        stronger = measured(chosen * STEP)
        if stronger.error >= found.error:
            break
        chosen, found = chosen * STEP, stronger
    if chosen == 1.0:
        return 1.0, given.error, ()
    reason = (
        f"Light: {chosen:.2f} times as strong as given, since the smoke is brighter than the given light can make it: "
        f"the densities that come nearest ask for {given.light:.2f} times as much, and now for {found.light:.2f}."
    )
    figures = {"factor": chosen, "asked_for": found.light, "asked_for_as_given": given.light, "error": found.error}
    return chosen, found.error, (Choice("light strength", f"{chosen:.3g}", reason, figures, 1 + MISSING),)


def scaled(scene: CompleteScene, factor: float) -> CompleteScene:
    """The scene with lights ``factor`` times as strong."""
    return scene if factor == 1.0 else replace(scene, lights=tuple(light.scaled(factor) for light in scene.lights))
