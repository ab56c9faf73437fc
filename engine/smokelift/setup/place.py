"""Where in depth the smoke of a shot stands, with how well it is known."""

from __future__ import annotations

from dataclasses import replace

from smokelift.density import AxisEstimate, clip_axis
from smokelift.setup.estimate import Estimate, measured, undetermined
from smokelift.setup.shot import Shot


def placed(shot: Shot) -> Shot:
    """The shot with the place of its smoke, unless the method needs none."""
    if shot.settings.method != "default":
        return shot
    place = clip_axis(shot, shot.settings.distance)
    return shot if place is None else replace(shot, place=place, estimates=(*shot.estimates, place_estimate(place)))


def place_estimate(place: AxisEstimate) -> Estimate[str]:
    """The place of the smoke as an estimate by one of the cues."""
    kind, figures, spread = f"axis depth by {place.cue}", {"depth": place.depth}, place.deviation
    if place.cue == "box":
        return undetermined(kind, "axis depth", figures, spread=spread)
    found = measured(kind, place.cue, figures, what="axis depth", spread=spread)
    return replace(found, source="given") if place.cue == "distance" else found
