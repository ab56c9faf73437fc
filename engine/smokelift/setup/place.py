"""Where in depth the smoke of a shot stands, in words, with how well it is known."""

from __future__ import annotations

from dataclasses import replace

from smokelift.density import AxisEstimate, clip_axis
from smokelift.setup.choice import UNDETERMINED, Choice
from smokelift.setup.shot import Shot

BETTER = "If you know better, say it by --axis-depth, an [[inlet]] or a second view."
"""What gives the depth where the clip leaves it open."""


def placed(shot: Shot) -> Shot:
    """The shot with the place of its smoke, unless that is given or the method needs none."""
    if shot.settings.method != "default" or shot.settings.axis_depth is not None:
        return shot
    place = clip_axis(shot)
    return shot if place is None else replace(shot, place=place, choices=(*shot.choices, place_choice(place)))


def place_choice(place: AxisEstimate) -> Choice[str]:
    """The place of the smoke as a choice among the cues, with its reason."""
    about = f"give or take {place.deviation:.2g} m"
    side = "behind" if place.depth >= 0 else "before"
    where = f"{abs(place.depth):.2g} m {side} the middle of the box"
    if abs(place.depth) < 0.05 * place.deviation:  # so small a number would look exact
        where = "in the middle of the box"
    reason = {
        "box": f"Where the smoke stands in depth is undetermined: it is taken to be {where}, {about}. {BETTER}",
        "floor contact": f"By its contact with the floor of the box the smoke stands {where}, {about}. {BETTER}",
        "inlets": f"By the marked inlets the smoke stands {where}, {about}.",
    }[place.cue]
    chosen = UNDETERMINED if place.cue == "box" else place.cue
    return Choice("axis depth", chosen, reason, {"depth": place.depth, "deviation": place.deviation})
