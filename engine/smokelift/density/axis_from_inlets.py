"""The axis of smoke that rises from known inlets.

Where several columns rise from known places, each has an axis of its own, and the picture shows whose smoke stands
where (docs/experiments/density-columns.md).
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from smokelift.density.axis import Column, SmokeAxis, likelihood
from smokelift.density.screen import Screen, view_frame
from smokelift.density.smoke_rows import SmokeRows
from smokelift.scene import Camera, Domain, Inlet

WIDENING = 0.15
"""Growth of a column's radius per metre on its way up, by the air that it takes in."""

INERTIA = 0.5
"""Weight of a column's place in the row below, in shares of its smoke: other smoke there may not be its own."""


def axis_from_inlets(inlets: Sequence[Inlet], screens: Sequence[Screen], smoke: SmokeRows) -> tuple[SmokeAxis, float]:
    """The axis of smoke that enters at inlets, one at least, and the standard deviation (m) of its mean depth's error.

    Parameters
    ----------
    inlets
        Where smoke is known to enter.
    screens
        What the frames show.
    smoke
        The same by height.
    """
    depth, across, spread = _through(inlets, smoke.heights, smoke.camera, smoke.domain)
    columns = _columns(inlets, screens, smoke.camera, smoke.domain) if len(inlets) > 1 else ()
    # as much in depth as across the picture; a disc's standard deviation is half its radius
    radius = np.mean([inlet.radius for inlet in inlets])
    drift = float(np.hypot(np.sqrt(smoke.mean((smoke.middle - across) ** 2)), radius / 2))
    return SmokeAxis(smoke.heights, smoke.risen(depth, across), spread, columns), drift


def _through(
    inlets: Sequence[Inlet], heights: NDArray[np.float64], camera: Camera, domain: Domain
) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
    """Mean depth, mean lateral position and spread in depth (m), at some heights, of the inlets below."""
    lateral, along, height = view_frame(camera)
    places = np.array([inlet.centre for inlet in inlets]) - np.array(domain.centre)
    places = places[np.argsort(places @ height)]
    counts = np.arange(1, len(places) + 1)
    depths = places @ along
    means = np.cumsum(depths) / counts
    variances = np.cumsum(depths**2) / counts - means**2
    quantities = means, np.cumsum(places @ lateral) / counts, np.sqrt(np.maximum(variances, 0))
    depth, across, spread = (np.interp(heights, places @ height, quantity) for quantity in quantities)
    return depth, across, spread


def _columns(inlets: Sequence[Inlet], screens: Sequence[Screen], camera: Camera, domain: Domain) -> tuple[Column, ...]:
    """The columns above several inlets, followed upwards in the mean picture.

    In every row the smoke is shared out among the columns that have begun (a mixture of Gaussians, by expectation
    maximisation), each expected where it was in the row below and as wide as a rising column becomes; were the widths
    free, one column would swallow the others.
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
    drift = (middles - starts[:, None]) / np.maximum(np.abs(depths), domain.voxel_size)[:, None]
    trusted = depths[:, None] / (1 + drift**2)
    return tuple(Column(float(begins[k]), middles[k], widths[k], trusted[k]) for k in range(len(inlets)))
