"""Columns of smoke above several known inlets, followed upwards (docs/experiments/density-columns.md)."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from smokelift.density.axis import Column, likelihood
from smokelift.density.screen import Screen, view_frame
from smokelift.scene import Camera, Domain, Inlet

WIDENING = 0.15
"""Growth of a column's radius per metre on its way up: it takes in air (docs/experiments/density-columns.md)."""

INERTIA = 0.5
"""Share of its smoke by which a column stays where it was a row below, because what else is there may not be its own
(docs/experiments/density-columns.md)."""


def follow_columns(
    inlets: Sequence[Inlet], screens: Sequence[Screen], camera: Camera, domain: Domain, deviation: float
) -> tuple[Column, ...]:
    """The columns above several inlets, followed upwards in the mean picture.

    In every row the smoke is shared out among the columns that have begun (a mixture of Gaussians, by expectation
    maximisation), each expected where it was in the row below and as wide as a rising column becomes; were the widths
    free, one column would swallow the others.

    Parameters
    ----------
    deviation
        Standard deviation (m) of the smoke's depth where nothing is known of it.
    """
    lateral, along, up = view_frame(camera)
    places = np.array([inlet.centre for inlet in inlets]) - np.array(domain.centre)
    radii = np.array([inlet.radius for inlet in inlets])
    starts, depths, begins = places @ lateral, places @ along, places @ up - radii
    heights, across = screens[0].heights, screens[0].laterals
    # a disc's standard deviation is half its radius
    widths = (radii[:, None] + WIDENING * np.maximum(heights - begins[:, None], 0)) / 2
    picture = np.sum([screen.values for screen in screens], 0)
    picture /= np.maximum(picture.sum(1, keepdims=True), 1e-30)
    middles = np.empty_like(widths)
    now = starts.copy()
    for row, smoke in enumerate(picture):
        begun = heights[row] >= begins
        for _ in range(3):
            share = likelihood(across, now[begun, None], widths[begun, row, None])
            part = smoke * share / np.maximum(share.sum(0), 1e-30)
            now[begun] = (INERTIA * now[begun] + part @ across) / (INERTIA + part.sum(1))
        middles[:, row] = now
    believed = depths[:, None] * still_there(middles - starts[:, None], deviation)
    return tuple(Column(float(begins[k]), middles[k], widths[k], believed[k]) for k in range(len(inlets)))


def still_there(drift: NDArray[np.float64], deviation: float) -> NDArray[np.float64]:
    """Share of the depth below that is expected of smoke which drifted (m) across the picture.

    It drifts as far in depth, nobody knows to which side: the mean of a normal prior about the middle of the domain and
    of a measurement with that deviation.
    """
    return np.asarray(1 / (1 + (drift / deviation) ** 2))
