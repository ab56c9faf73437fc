"""Where in depth the smoke stands, in words, with how well it is known."""

from __future__ import annotations

from dataclasses import replace

from smokelift.density import AxisEstimate, clip_axis
from smokelift.setup.choice import UNDETERMINED, Choice
from smokelift.setup.shot import Shot

TELL = "If you know better, say it by --axis-depth, an [[inlet]] or a second view."


def placed(shot: Shot) -> Shot:
    """The shot with the place of its smoke, unless it is given or the method needs none."""
    if shot.settings.method != "default" or shot.settings.axis_depth is not None:
        return shot
    place = clip_axis(shot)
    return shot if place is None else replace(shot, place=place, choices=(*shot.choices, place_choice(place)))


def place_choice(place: AxisEstimate) -> Choice[str]:
    """What a user is told about the place of the smoke."""
    about = f"give or take {place.deviation:.2g} m"
    side = "behind" if place.depth >= 0 else "before"
    where = f"{abs(place.depth):.2g} m {side} the middle of the box"
    if abs(place.depth) < 0.05 * place.deviation:  # so small a number would look exact
        where = "in the middle of the box"
    reason = {
        "box": f"Where the smoke stands in depth is undetermined: the middle of the box is taken, {about}. {TELL}",
        "floor contact": f"By its contact with the floor of the box the smoke stands {where}, {about}. {TELL}",
        "inlets": f"By the marked inlets the smoke stands {where}, {about}.",
        "lamps": f"By the colours of the lamps the smoke stands {where}, {about}.",
    }[place.cue]
    chosen = UNDETERMINED if place.cue == "box" else place.cue
    return Choice("axis depth", chosen, reason, {"depth": place.depth, "deviation": place.deviation})
