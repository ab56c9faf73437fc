"""Where in depth the smoke stands, from what one camera sees of it.

One picture of smoke in parallel light looks the same whether the smoke is near and small or far and large, so its place
in depth has to come from something else: known inlets, or the place where smoke that rises from the floor meets it.
Elsewhere the axis of the domain is the best estimate, because a box is put around its smoke.
docs/experiments/density-axis.md has what the cues are worth, and the posterior that was no better.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from smokelift.density.axis import AxisEstimate, SmokeAxis
from smokelift.density.axis_from_floor import axis_from_floor
from smokelift.density.axis_from_inlets import axis_from_inlets
from smokelift.density.screen import reach_along, upright_screen, view_frame
from smokelift.density.smoke_rows import SmokeRows
from smokelift.scene import Camera, Domain, Inlet

USUAL = 0.165
"""Standard deviation, in reaches (half the domain's depth), of the smoke's mean about the middle of its box."""

USUAL_COUNT = 2.0
"""How many boxes that counts as, beside the one at hand, which shows how far off the middle its smoke is across the
picture."""


def estimate_axis(
    amounts: Sequence[NDArray[np.float32]], camera: Camera, domain: Domain, inlets: Sequence[Inlet] = ()
) -> AxisEstimate:
    """The axis of the smoke in some frames of a clip.

    Parameters
    ----------
    amounts : sequence of (rows, columns)
        Optical depths, 0 where there is no smoke.
    camera
        A camera that stands still.
    domain
        The box.
    inlets
        Where smoke is known to enter; else its contact with the floor is searched for.

    Returns
    -------
    AxisEstimate
        The domain's axis where nothing else is known: no smoke that stands on the domain's floor in most frames, or a
        camera that does not look down on the floor.
    """
    screens = [
        screen for screen in (upright_screen(amount, camera, domain) for amount in amounts) if screen.values.any()
    ]
    if not screens:
        reach = reach_along(domain, view_frame(camera)[1])
        return AxisEstimate(SmokeAxis.upright(), "box", 0.0, USUAL * reach)
    smoke = SmokeRows(tuple(screen.rows() for screen in screens), camera, domain)
    usual = USUAL_COUNT * (USUAL * smoke.reach) ** 2
    unknown = float(np.sqrt((usual + smoke.mean(smoke.middle) ** 2) / (USUAL_COUNT + 1)))
    if inlets:
        axis, drift = axis_from_inlets(inlets, screens, smoke)
        return AxisEstimate(axis, "inlets", smoke.mean(axis.depths), min(unknown, drift))
    found = axis_from_floor(smoke, len(amounts))
    if found is None:
        return AxisEstimate(SmokeAxis.upright(), "box", 0.0, unknown)
    axis, contact = found
    mean = smoke.mean(axis.depths)
    # as if that share of the distance were the box's and the contact's, weighted by their variances
    believed = np.clip(mean / contact, 0, 1) if contact else 0.0
    return AxisEstimate(axis, "floor contact", mean, unknown * float(np.sqrt(1 - believed)))
