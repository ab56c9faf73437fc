"""The smoke as a medium: as the scene gives it, or the usual one in the colour that the clip shows."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from smokelift.render import scene_optics
from smokelift.scene import Background, Camera, CompleteScene, Domain, EnvironmentLight, Light, Medium
from smokelift.setup.choice import Choice
from smokelift.setup.fire import fire_choice
from smokelift.setup.first_estimate import FirstEstimate
from smokelift.setup.source import smoke_colour

OPTICAL_DEPTH_AT_ONE = 5.0
"""Optical depth of smoke of density 1 across the domain when the medium is not given: thick, not solid."""

DIRECTIONS = 8
"""Directions of an environment of which only the colour is needed."""


def find_medium(
    given: Medium | None, estimate: FirstEstimate, lights: tuple[Light, ...], camera: Camera, domain: Domain
) -> tuple[Medium, tuple[Choice[Any], ...], tuple[str, ...]]:
    """Complete the medium.

    Parameters
    ----------
    given
        What the scene says.
    estimate
        What the clip shows.
    lights
        Those that the scene gives; smoke has their colour times its own.
    camera, domain
        The view and the box in whose middle the colour of the light is computed.

    Returns
    -------
    medium
        With the colour of its flame, where fire burns.
    choices
        What was measured for it.
    notes
        What was assumed, a sentence each.
    """
    choices: tuple[Choice[Any], ...] = ()
    notes: tuple[str, ...] = ()
    medium = given
    if medium is None:
        width = min(high - low for low, high in zip(domain.min, domain.max, strict=True))
        grey = Medium(extinction=OPTICAL_DEPTH_AT_ONE / width)
        color, choice = smoke_colour(estimate.samples, _light_colour(lights, camera, domain, grey))
        medium, choices = replace(grey, color=color), (choice,)
        notes = (
            f"Medium not given: extinction {grey.extinction:.3g} 1/m (density 1 is thick smoke), "
            f"albedo {grey.albedo:g}, isotropic.",
        )
    if estimate.fire is not None:
        choices = (*choices, fire_choice(estimate.fire, medium.flame_color))
        medium = replace(medium, flame_color=medium.flame_color or estimate.fire.color)
    return medium, choices, notes


def _light_colour(lights: tuple[Light, ...], camera: Camera, domain: Domain, grey: Medium) -> NDArray[np.float64]:
    """Colour (3,) of the light in the middle of a box, the largest 1; ones where no light is known."""
    few = tuple(replace(each, directions=DIRECTIONS) if isinstance(each, EnvironmentLight) else each for each in lights)
    scene = CompleteScene(camera, domain, grey, few, Background(), "single")
    source = scene_optics(scene).unshadowed_source()
    return source / source.max() if source.max() > 0 else np.ones(3)
