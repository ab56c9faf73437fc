"""The fire of a clip, distinguished from its smoke before anything is measured on either."""

from __future__ import annotations

from dataclasses import dataclass

from smokelift.footage.clip import Clip
from smokelift.footage.fire import fire_colour, fire_share, firelight, without_fire
from smokelift.footage.plate import Plates
from smokelift.scene.checks import Vector
from smokelift.setup.estimate import Estimate, measured
from smokelift.setup.smoke import SmokeSamples


@dataclass(frozen=True, eq=False)
class Fire:
    """What shines by itself.

    Attributes
    ----------
    share
        Of the smoke's pixels that do.
    light
        The clip of the light that it adds, in the place of smoke.
    color
        Of that light, as the clip shows it.
    doused
        The clip without it.
    """

    share: float
    light: Clip
    color: Vector
    doused: Clip


def find_fire(clip: Clip, plates: Plates, samples: SmokeSamples) -> Fire | None:
    """Find the fire of a clip; None where none burns."""
    share = fire_share(samples.colours, samples.behind)
    if not share:
        return None
    doused = without_fire(clip, plates)
    light = firelight(clip, doused)
    return Fire(share, light, fire_colour(clip, light), doused)


def fire_estimate(fire: Fire, given: Vector | None) -> Estimate[str]:
    """Say what becomes of fire, whose colour the scene may give."""
    red, green, blue = given or fire.color
    figures = {"share": fire.share, "red": red, "green": green, "blue": blue}
    return measured("fire", f"{fire.share:.3f}", figures)
