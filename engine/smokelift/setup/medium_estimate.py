"""The smoke as a medium: as the scene gives it, or the usual one in the colour that the clip shows."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from smokelift.checks import Remark
from smokelift.render import scene_optics
from smokelift.scene import Background, Camera, CompleteScene, Domain, EnvironmentLight, Light, Medium
from smokelift.setup.estimate import Estimate
from smokelift.setup.fire_estimate import fire_estimate
from smokelift.setup.first_estimate import FirstEstimate
from smokelift.setup.source import smoke_colour

OPTICAL_DEPTH_AT_ONE = 5.0
"""Optical depth of smoke of density 1 across the domain when the medium is not given: thick, not solid."""

DIRECTIONS = 8
"""Directions of an environment of which only the colour is needed."""


def find_medium(
    given: Medium | None, estimate: FirstEstimate, lights: tuple[Light, ...], camera: Camera, domain: Domain
) -> tuple[Medium, tuple[Estimate[Any], ...], tuple[Remark, ...]]:
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
    estimates
        What was measured for it.
    remarks
        What was assumed.
    """
    estimates: tuple[Estimate[Any], ...] = ()
    remarks: tuple[Remark, ...] = ()
    medium = given
    if medium is None:
        width = min(high - low for low, high in zip(domain.min, domain.max, strict=True))
        grey = Medium(extinction=OPTICAL_DEPTH_AT_ONE / width)
        color, coloured = smoke_colour(estimate.samples, _light_colour(lights, camera, domain, grey))
        medium, estimates = replace(grey, color=color), (coloured,)
        remarks = (Remark("assumed medium", {"extinction": grey.extinction, "albedo": grey.albedo}),)
    if estimate.fire is not None:
        estimates = (*estimates, fire_estimate(estimate.fire, medium.flame_color))
        medium = replace(medium, flame_color=medium.flame_color or estimate.fire.color)
    return medium, estimates, remarks


def _light_colour(lights: tuple[Light, ...], camera: Camera, domain: Domain, grey: Medium) -> NDArray[np.float64]:
    """Colour (3,) of the light in the middle of a box, the largest 1; ones where no light is known."""
    few = tuple(replace(each, directions=DIRECTIONS) if isinstance(each, EnvironmentLight) else each for each in lights)
    scene = CompleteScene(camera, domain, grey, few, Background(), "single")
    source = scene_optics(scene).unshadowed_source()
    return source / source.max() if source.max() > 0 else np.ones(3)
