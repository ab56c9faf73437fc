"""Where in depth the smoke of a shot stands, with how well it is known."""

from __future__ import annotations

from dataclasses import replace

from smokelift.density import AxisEstimate, clip_axis
from smokelift.setup.estimate import UNDETERMINED, Estimate
from smokelift.setup.shot import Shot

EXACT = 0.05
"""Distance from the middle of the box, in standard deviations, below which a figure would look exact."""


def placed(shot: Shot) -> Shot:
    """The shot with the place of its smoke, unless that is given or the method needs none."""
    if shot.settings.method != "default" or shot.settings.axis_depth is not None:
        return shot
    place = clip_axis(shot)
    return shot if place is None else replace(shot, place=place, estimates=(*shot.estimates, place_estimate(place)))


def place_estimate(place: AxisEstimate) -> Estimate[str]:
    """The place of the smoke as an estimate by one of the cues."""
    middle = abs(place.depth) < EXACT * place.deviation
    where = "in the middle" if middle else "behind the middle" if place.depth >= 0 else "before the middle"
    return Estimate(
        f"axis depth {where} by {place.cue}",
        {"depth": place.depth},
        what="axis depth",
        value=UNDETERMINED if place.cue == "box" else place.cue,
        source="assumed" if place.cue == "box" else "measured",
        spread=place.deviation,
    )
