"""The smoke as a medium: as the scene gives it, or the usual one in the colour that the clip shows."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

from smokelift.scene import Camera, Domain, Light, Medium
from smokelift.setup.choice import Choice
from smokelift.setup.fire import fire_choice
from smokelift.setup.first_look import FirstLook
from smokelift.setup.light import light_colour
from smokelift.setup.smoke_colour import smoke_colour

OPTICAL_DEPTH_AT_ONE = 5.0
"""Optical depth of smoke of density 1 across the domain when the medium is not given: thick, not solid."""


@dataclass(frozen=True)
class FoundMedium:
    """The medium of a shot.

    Attributes
    ----------
    medium
        With the colour of its flame, where fire burns.
    choices
        What was measured for it.
    notes
        What was assumed, a sentence each.
    """

    medium: Medium
    choices: tuple[Choice[Any], ...] = ()
    notes: tuple[str, ...] = ()


def find_medium(
    given: Medium | None, look: FirstLook, lights: tuple[Light, ...], camera: Camera, domain: Domain
) -> FoundMedium:
    """Complete the medium.

    Parameters
    ----------
    given
        What the scene says.
    look
        What the clip shows.
    lights
        Those that the scene gives; smoke has their colour times its own.
    camera, domain
        Where the light is looked at.
    """
    found = _usual(look, lights, camera, domain) if given is None else FoundMedium(given)
    if look.fire is None:
        return found
    colour = found.medium.flame_color
    medium = replace(found.medium, flame_color=colour or look.fire.color)
    return FoundMedium(medium, (*found.choices, fire_choice(look.fire, colour)), found.notes)


def _usual(look: FirstLook, lights: tuple[Light, ...], camera: Camera, domain: Domain) -> FoundMedium:
    """The medium of a scene that gives none."""
    width = min(high - low for low, high in zip(domain.min, domain.max, strict=True))
    grey = Medium(extinction=OPTICAL_DEPTH_AT_ONE / width)
    colour = smoke_colour(look.samples, light_colour(lights, camera, domain, grey))
    medium = replace(grey, color=colour.color)
    note = (
        f"Medium not given: extinction {medium.extinction:.3g} 1/m (density 1 is thick smoke), "
        f"albedo {medium.albedo:g}, isotropic."
    )
    return FoundMedium(medium, (colour.choice,), (note,))
