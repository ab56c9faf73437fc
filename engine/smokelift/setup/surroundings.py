"""Light from everywhere that casts shadows, for smoke in unknown light before something bright.

Thick smoke has a lit side and a shaded one. Where nothing is known of the light, smoke without shadows stands for it,
as bright as its darkest part where it darkens what is behind it; then its lit side has to be thin. What is behind the
smoke is known, though, and it is a light as well. If as much comes from all sides, thin smoke is as bright as its
background, and the thicker it is the darker by its own shadow. No side is preferred, since one picture does not tell
the direction of a light (docs/experiments/light-direction.md).

It is taken where it is clearly nearer to the clip. It is no richer model than smoke without shadows, so errors are
compared as a ratio. Dark smoke before a bright sky stays dark. Figures: docs/experiments/surroundings.md.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from smokelift.density import DensitySettings
from smokelift.footage.matte import matte
from smokelift.scene import DirectionalLight
from smokelift.setup.choice import Choice
from smokelift.setup.coarse import CoarseFrame
from smokelift.setup.scattering import NEARER, WORDS, HeldOut, held_out
from smokelift.setup.smoke_colour import FAINTEST

SIDES = ((1.0, 0.0, 0.0), (-1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, -1.0, 0.0), (0.0, 0.0, 1.0), (0.0, 0.0, -1.0))
"""Directions of travel that stand for all: 14 find no other density (docs/experiments/surroundings.md)."""

STRENGTHS = (1.0, 0.7, 0.5)
"""Of the light, in multiples of what is behind the smoke. None is known: the first is kept unless a weaker one is
nearer by more than the tolerance."""


def light_around(radiance: NDArray[np.float64]) -> tuple[DirectionalLight, ...]:
    """Light from everywhere of a radiance (3,), in W/m^2/sr."""
    red, green, blue = (float(value) for value in 4 * np.pi * radiance / len(SIDES))
    return tuple(DirectionalLight(side, (red, green, blue)) for side in SIDES)


def choose_surroundings(
    frames: Sequence[CoarseFrame], scattered: Choice[str], settings: DensitySettings
) -> tuple[tuple[DirectionalLight, ...], Choice[str]] | None:
    """Light from everywhere, as bright as what is behind the smoke, where it explains the clip clearly better.

    Parameters
    ----------
    frames
        At least one.
    scattered
        The model that was chosen without shadows, with its error.
    settings
        How to fit.

    Returns
    -------
    lights, choice
        None where the light stays as it is.
    """
    error, tolerance = scattered.measured[f"error_{scattered.chosen}"], scattered.tolerance or 0.0
    behind = _behind(frames)
    if error <= tolerance or behind.max() < FAINTEST:
        return None
    whole = behind / max(frames[0].scene.medium.albedos)

    def left(radiance: NDArray[np.float64]) -> HeldOut:
        lights = light_around(radiance)
        lit = [frame.in_light_of(replace(frame.scene, lights=lights)) for frame in frames]
        return held_out(lit, "single", "single", settings)

    found, chosen = np.inf, whole
    for radiance in (strength * whole for strength in STRENGTHS):
        # as bright, but of the colour that the clip asks for
        asked = np.maximum(radiance * left(radiance).colour, 0)
        coloured = asked * radiance.mean() / max(asked.mean(), 1e-30)
        if (own := left(coloured).error) < found - tolerance:
            found, chosen = own, coloured
    if not found < min(NEARER * error, error - tolerance):
        return None
    reason = (
        f"Scattering: {WORDS['single']}, in light from everywhere, for want of a known one; with "
        f"{WORDS[scattered.chosen]} held-out pixels differ by {error:.1%} of the smoke's contrast instead of "
        f"{found:.1%}."
    )
    measured = {**scattered.measured, "error_single": found}
    return light_around(chosen), Choice("scattering", "single", reason, measured, tolerance)


def _behind(frames: Sequence[CoarseFrame]) -> NDArray[np.float64]:
    """Mean radiance (3,) of what is behind the smoke."""
    smoke = [matte(frame.picture, frame.plate).mask for frame in frames]
    shown = [frame.plate.image[mask] for frame, mask in zip(frames, smoke, strict=True)]
    return np.asarray(np.concatenate(shown).mean(0), np.float64)
