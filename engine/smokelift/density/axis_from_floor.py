"""The axis of smoke that rises from the domain's floor.

A disc of smoke on the floor begins in the picture where the ray through the floor meets it, within a few rows. So the
contact shows how far away the smoke stands (docs/experiments/density-axis.md).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from smokelift.density.axis import SmokeAxis
from smokelift.density.screen import Upright, reach_along, view_frame
from smokelift.density.smoke_rows import SmokeRows
from smokelift.scene import Camera, Domain

FRAMES = 0.6
"""Share of the frames that have to show a floor contact."""

CONTACT = 0.8
"""Share of the contact's distance from the domain's axis that is trusted: a pixel is many centimetres on the floor."""

BEHIND = 0.3
"""Distance of the contact behind the axis, in reaches, over which that trust falls (standard deviation of a normal
curve). Smoke that begins above the floor shows the same picture as smoke further back on it."""

JOINING = 1.45
"""Growth of the smoke within half its width, in every frame, from which other smoke must have joined it: a column that
only rises gets no thicker, and what piles up at its head moves on."""


@dataclass(frozen=True)
class _FloorContact:
    """Where smoke meets the floor: depth and lateral width (m), and the height (m) at which it shows on the axis."""

    depth: float
    width: float
    height: float


def axis_from_floor(smoke: SmokeRows, frames: int) -> tuple[SmokeAxis, float] | None:
    """The axis of smoke that stands on the floor, and the depth (m) at which it meets it.

    Parameters
    ----------
    smoke
        What the frames show.
    frames
        How many were looked at, those without smoke as well.

    Returns
    -------
    tuple, optional
        None where too few frames show a contact: the smoke floats, or the camera does not look down on the floor.
    """
    found = [contact for contact in (_floor_contact(row, smoke.camera, smoke.domain) for row in smoke.rows) if contact]
    if not found or len(found) < FRAMES * frames:
        return None
    heights = smoke.heights
    deep, width, base = (
        float(np.median(values))
        for values in zip(*((contact.depth, contact.width, contact.height) for contact in found), strict=True)
    )
    across = np.full(heights.shape, np.interp(base + width / 4, heights, smoke.middle))
    behind = max(deep, 0.0) / (BEHIND * smoke.reach)
    depths = smoke.risen(np.full(heights.shape, deep), across)
    depths *= CONTACT * np.exp(-(behind**2) / 2)
    join = _joined(np.array([row.total for row in smoke.rows]), heights, base + width / 2, width)
    if join is not None:
        depths *= np.clip((join + width / 2 - heights) / width, 0, 1)
    return SmokeAxis(heights, depths, np.zeros_like(depths)), deep


def _floor_contact(row: Upright, camera: Camera, domain: Domain) -> _FloorContact | None:
    """The floor contact in one frame, if the lower end of the smoke is one."""
    _, along, height = view_frame(camera)
    matrix = np.array(camera.matrix, np.float64)
    centre = np.array(domain.centre)
    if camera.type != "perspective" or abs(height[2]) < 1 or (matrix[:3, 3] - centre) @ along >= 0:
        return None
    above_floor = matrix[2, 3] - domain.min[2]
    distance = float((centre - matrix[:3, 3]) @ along)
    reach = reach_along(domain, along)
    # depth of the floor that one row of the picture shows
    pixel = distance**2 / (max(above_floor, 1e-9) * camera.fy)
    if pixel > reach / 2:
        return None
    heights, total = row.heights, row.total
    smoky = total > 0.05 * np.percentile(total[total > 0], 75)
    first = int(np.argmax(smoky))
    base = heights[first]
    near = smoky & (heights <= base + 12 * (heights[1] - heights[0]))
    width = float(2 * np.sqrt(3) * np.average(row.spread[near], weights=total[near]))
    level = float(np.median(total[smoky & (heights <= base + width)]))

    def floor_depth(share: float) -> float:
        """Depth at which the floor is seen where the rows first hold so much of their level."""
        after = int(np.argmax(total > share * level))
        if after == 0:
            return -np.inf
        before = after - 1
        part = (share * level - total[before]) / (total[after] - total[before])
        up = heights[before] + part * (heights[after] - heights[before]) + centre[2] - domain.min[2]
        return distance * up / (above_floor - up) if up < above_floor else np.inf

    front, middle, back = (floor_depth(share) for share in (0.2, 0.5, 0.8))
    # a disc on the floor is as deep as it is wide; the lower end of what floats takes many more rows
    if abs(middle) < reach and back - front < width + pixel:
        return _FloorContact(middle, width, float(base))
    return None


def _joined(totals: NDArray[np.float64], heights: NDArray[np.float64], above: float, width: float) -> float | None:
    """The height from which on other smoke has joined that of the contact; None if there is none."""
    step = max(1, round(0.5 * width / (heights[1] - heights[0])))
    least = 1e-3 * totals.max()
    growth = np.min(np.maximum(totals[:, step:], least) / np.maximum(totals[:, :-step], least), 0)
    sudden = (growth > JOINING) & (heights[:-step] > above)
    return float(heights[:-step][sudden][0]) if sudden.any() else None
