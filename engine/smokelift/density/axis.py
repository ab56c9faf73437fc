"""Where in depth the smoke stands: the axis that depth profiles are centred on.

One picture of smoke in parallel light looks the same whether the smoke is near and small or far and large, so its place
in depth has to come from something else. Where smoke rises from the floor, the contact gives it: a disc of smoke on the
floor begins in the picture where the ray through the floor meets it, within a few rows. Elsewhere the axis of the
domain is the best estimate, because a box is put around its smoke. Where several columns rise from known places, each
has an axis of its own, and the picture shows whose smoke stands where.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from smokelift.density.screen import Screen, Upright, upright_screen, view_frame
from smokelift.scene import Camera, Domain, Inlet


@dataclass(frozen=True)
class AxisSettings:
    """How far floor contacts and inlets are trusted. Lengths along the depth are in reaches: half the domain's depth.

    Attributes
    ----------
    frames
        Share of the frames that have to show a floor contact.
    contact
        Share of the contact's distance from the domain's axis that is trusted: a pixel is many centimetres on the
        floor.
    behind
        Distance of the contact behind the axis, in reaches, over which that trust falls (standard deviation of a normal
        curve). Smoke that begins above the floor shows the same picture as smoke further back on it.
    joining
        Growth of the smoke within half its width, in every frame, from which other smoke must have joined it: a column
        that only rises gets no thicker, and what piles up at its head moves on.
    near_side
        Distances of the contact from the axis, in reaches. Between them the assumption fades in that smoke leans to the
        other side, so that its mean is on the axis; beyond the second it holds fully: a box is around its smoke.
    widening
        Growth of a column's radius per metre on its way up, by the air that it takes in (density-columns.md).
    inertia
        Weight of a column's place in the row below, in shares of its smoke: other smoke there may not be its own.
    usual
        Standard deviation, in reaches, of the smoke's mean about the middle of its box.
    usual_count
        How many boxes that counts as, beside the one at hand, which shows how far off the middle its smoke is across
        the picture.

    docs/experiments/density-axis.md has what they are worth, and the posterior that was no better.
    """

    frames: float = 0.6
    contact: float = 0.8
    behind: float = 0.3
    joining: float = 1.45
    near_side: tuple[float, float] = (0.3, 0.45)
    widening: float = 0.15
    inertia: float = 0.5
    usual: float = 0.165
    usual_count: float = 2.0


@dataclass(frozen=True, eq=False)
class Column:
    """One of several columns of smoke, by height.

    Attributes
    ----------
    begins
        Height (m above the domain's centre) of its lower end.
    middles, widths, depths : (n,)
        Lateral place of its axis, lateral standard deviation and depth, in metres, at the heights of its `SmokeAxis`.
    """

    begins: float
    middles: NDArray[np.float64]
    widths: NDArray[np.float64]
    depths: NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class SmokeAxis:
    """How far behind the domain's centre the middle of the smoke is, by height, and by column where there are several.

    Attributes
    ----------
    heights : (n,)
        In metres above the domain's centre, ascending, along `view_frame`'s height.
    depths : (n,)
        In metres along `view_frame`'s depth, away from the camera.
    spreads : (n,)
        Standard deviation (m) about it of several columns that are known to stand behind one another.
    columns
        Known columns, if there are several. Beside one another they have depths of their own.
    """

    heights: NDArray[np.float64]
    depths: NDArray[np.float64]
    spreads: NDArray[np.float64]
    columns: tuple[Column, ...] = ()

    @staticmethod
    def upright(depth: float = 0.0) -> SmokeAxis:
        """The same depth at all heights."""
        return SmokeAxis(np.zeros(1), np.full(1, float(depth)), np.zeros(1))

    @staticmethod
    def given(depth: float, camera: Camera, domain: Domain) -> SmokeAxis:
        """A depth that is known, at all heights.

        Raises
        ------
        ValueError
            If it is outside the domain.
        """
        reach = _reach(domain, view_frame(camera)[1])
        if abs(depth) >= reach:
            raise ValueError(
                f"The axis depth {depth:g} m is outside the box, which reaches {reach:.3g} m before and behind its "
                "middle; give a number between."
            )
        return SmokeAxis.upright(depth)

    def at(self, heights: NDArray[np.float64], laterals: NDArray[np.float64] | None = None) -> NDArray[np.float64]:
        """Depths at some heights, and lateral places if it is not to be the mean over the columns."""
        if not self.columns or laterals is None:
            return np.asarray(np.interp(heights, self.heights, self.depths))
        return self._mean([column.depths for column in self.columns], heights, laterals)

    def spread_at(
        self, heights: NDArray[np.float64], laterals: NDArray[np.float64] | None = None
    ) -> NDArray[np.float64]:
        """Spreads at some heights, and lateral places."""
        if not self.columns or laterals is None:
            return np.asarray(np.interp(heights, self.heights, self.spreads))
        square = self._mean([column.depths**2 for column in self.columns], heights, laterals)
        return np.asarray(np.sqrt(np.maximum(square - self.at(heights, laterals) ** 2, 0)))

    def width_at(self, heights: NDArray[np.float64], laterals: NDArray[np.float64]) -> NDArray[np.float64]:
        """Lateral standard deviation (m) of the columns at some heights and lateral places."""
        return self._mean([column.widths for column in self.columns], heights, laterals)

    def _mean(
        self, values: Sequence[NDArray[np.float64]], heights: NDArray[np.float64], laterals: NDArray[np.float64]
    ) -> NDArray[np.float64]:
        """Mean over the columns that may hold the smoke at some places."""
        total, shares = np.zeros(np.shape(heights)), np.zeros(np.shape(heights))
        for column, value in zip(self.columns, values, strict=True):
            middle, width = (np.interp(heights, self.heights, of) for of in (column.middles, column.widths))
            share = _likelihood(laterals, middle, width) * (heights >= column.begins)
            total += share * np.interp(heights, self.heights, value)
            shares += share
        lowest = min(range(len(values)), key=lambda k: self.columns[k].begins)
        below = np.interp(heights, self.heights, values[lowest])
        return np.where(shares > 0, total / np.maximum(shares, 1e-30), below)


Cue = Literal["box", "floor contact", "inlets", "lamps"]
"""What tells where the smoke stands; the box alone leaves it undetermined."""


@dataclass(frozen=True, eq=False)
class AxisEstimate:
    """An axis, and how well it is known.

    Attributes
    ----------
    axis
        The most likely one.
    cue
        What tells it.
    depth
        Mean depth (m behind the domain's centre) of smoke that stands on it.
    deviation
        Standard deviation (m) of the mean depth's error.
    """

    axis: SmokeAxis
    cue: Cue
    depth: float
    deviation: float


@dataclass(frozen=True)
class _FloorContact:
    """Where smoke meets the floor: depth and lateral width (m), and the height (m) at which it shows on the axis."""

    depth: float
    width: float
    height: float


def estimate_axis(
    amounts: Sequence[NDArray[np.float32]],
    camera: Camera,
    domain: Domain,
    sources: Sequence[Inlet] = (),
    settings: AxisSettings = AxisSettings(),
) -> AxisEstimate:
    """The axis of the smoke in some frames of a clip.

    Parameters
    ----------
    amounts : sequence of (rows, columns)
        Optical depths, 0 where there is no smoke.
    camera
        A camera that stands still.
    sources
        Where smoke is known to enter; else its contact with the floor is searched for.
    settings
        How far contacts and inlets are trusted.

    Returns
    -------
    AxisEstimate
        The domain's axis where nothing else is known: no smoke that stands on the domain's floor in most frames, or a
        camera that does not look down on the floor.
    """
    reach = _reach(domain, view_frame(camera)[1])
    screens = [
        screen for screen in (upright_screen(amount, camera, domain) for amount in amounts) if screen.values.any()
    ]
    if not screens:
        return AxisEstimate(SmokeAxis.upright(), "box", 0.0, settings.usual * reach)
    rows = [screen.rows() for screen in screens]
    heights, total = rows[0].heights, np.sum([row.total for row in rows], 0)
    usual = settings.usual_count * (settings.usual * reach) ** 2
    unknown = float(np.sqrt((usual + np.average(_middle(rows), weights=total) ** 2) / (settings.usual_count + 1)))
    if sources:
        depth, across, spread = _through(sources, heights, camera, domain)
        columns = _columns(sources, screens, camera, domain, settings) if len(sources) > 1 else ()
        trusted = _trusted(depth, across, rows, camera, domain, settings.near_side)
        # as much in depth as across the picture; a disc's standard deviation is half its radius
        radius = np.mean([source.radius for source in sources])
        drift = float(np.hypot(np.sqrt(np.average((_middle(rows) - across) ** 2, weights=total)), radius / 2))
        axis = SmokeAxis(heights, trusted, spread, columns)
        return AxisEstimate(axis, "inlets", _mean(trusted, total), min(unknown, drift))
    found = [contact for contact in (_floor_contact(row, camera, domain) for row in rows) if contact is not None]
    if not found or len(found) < settings.frames * len(amounts):
        return AxisEstimate(SmokeAxis.upright(), "box", 0.0, unknown)
    deep = float(np.median([contact.depth for contact in found]))
    depth = np.full(heights.shape, deep)
    width = float(np.median([contact.width for contact in found]))
    base = float(np.median([contact.height for contact in found]))
    across = np.full(heights.shape, np.interp(base + width / 4, heights, _middle(rows)))
    behind = max(deep, 0.0) / (settings.behind * reach)
    trusted = _trusted(depth, across, rows, camera, domain, settings.near_side)
    trusted *= settings.contact * np.exp(-(behind**2) / 2)
    join = _joined(np.array([row.total for row in rows]), heights, base + width / 2, width, settings.joining)
    if join is not None:
        trusted *= np.clip((join + width / 2 - heights) / width, 0, 1)
    mean = _mean(trusted, total)
    # as if that share of the distance were the box's and the contact's, weighted by their variances
    believed = np.clip(mean / deep, 0, 1) if deep else 0.0
    axis = SmokeAxis(heights, trusted, np.zeros_like(trusted))
    return AxisEstimate(axis, "floor contact", mean, unknown * float(np.sqrt(1 - believed)))


def _mean(depths: NDArray[np.float64], total: NDArray[np.float64]) -> float:
    """Mean of depths by height over the smoke."""
    return float(np.average(depths, weights=total))


def _through(
    sources: Sequence[Inlet], heights: NDArray[np.float64], camera: Camera, domain: Domain
) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
    """Mean depth, mean lateral position and spread in depth (m), at some heights, of the sources below."""
    lateral, along, height = view_frame(camera)
    places = np.array([source.centre for source in sources]) - np.array(domain.centre)
    places = places[np.argsort(places @ height)]
    counts = np.arange(1, len(places) + 1)
    depths = places @ along
    means = np.cumsum(depths) / counts
    variances = np.cumsum(depths**2) / counts - means**2
    quantities = means, np.cumsum(places @ lateral) / counts, np.sqrt(np.maximum(variances, 0))
    depth, across, spread = (np.interp(heights, places @ height, quantity) for quantity in quantities)
    return depth, across, spread


def _columns(
    sources: Sequence[Inlet], screens: Sequence[Screen], camera: Camera, domain: Domain, settings: AxisSettings
) -> tuple[Column, ...]:
    """The columns above several sources, followed upwards in the mean picture.

    In every row the smoke is shared out among the columns that have begun (a mixture of Gaussians, by expectation
    maximisation), each expected where it was in the row below and as wide as a rising column becomes; were the widths
    free, one column would swallow the others.
    """
    lateral, along, up = view_frame(camera)
    places = np.array([source.centre for source in sources]) - np.array(domain.centre)
    radii = np.array([source.radius for source in sources])
    starts, depths, begins = places @ lateral, places @ along, places @ up - radii
    heights, across = screens[0].heights, screens[0].laterals
    # a disc's standard deviation is half its radius
    widths = (radii[:, None] + settings.widening * np.maximum(heights - begins[:, None], 0)) / 2
    picture = np.sum([screen.values for screen in screens], 0)
    picture /= np.maximum(picture.sum(1, keepdims=True), 1e-30)
    middles = np.empty_like(widths)
    now = starts.copy()
    for row, smoke in enumerate(picture):
        begun = heights[row] >= begins
        for _ in range(3):
            share = _likelihood(across, now[begun, None], widths[begun, row, None])
            part = smoke * share / np.maximum(share.sum(0), 1e-30)
            now[begun] = (settings.inertia * now[begun] + part @ across) / (settings.inertia + part.sum(1))
        middles[:, row] = now
    drift = (middles - starts[:, None]) / np.maximum(np.abs(depths), domain.voxel_size)[:, None]
    trusted = depths[:, None] / (1 + drift**2)
    return tuple(Column(float(begins[k]), middles[k], widths[k], trusted[k]) for k in range(len(sources)))


def _likelihood(
    places: NDArray[np.float64], middles: NDArray[np.float64], widths: NDArray[np.float64]
) -> NDArray[np.float64]:
    """How likely smoke at some lateral places belongs to columns; never quite impossible."""
    return np.asarray(np.exp(-(((places - middles) / widths) ** 2) / 2) + 1e-9)


def _trusted(
    depth: NDArray[np.float64],
    across: NDArray[np.float64],
    rows: Sequence[Upright],
    camera: Camera,
    domain: Domain,
    near_side: tuple[float, float],
) -> NDArray[np.float64]:
    """The axis at each height of smoke that started at a depth and a lateral position."""
    total = np.sum([row.total for row in rows], 0)
    raised = np.cumsum(total) / total.sum()  # 1/2 in the smoke's mean
    low, high = near_side
    leaning = np.clip((np.abs(depth) / _reach(domain, view_frame(camera)[1]) - low) / (high - low), 0, 1)
    # what drifts across the picture drifts in depth as well, nobody knows where to
    drift = (_middle(rows) - across) / np.maximum(np.abs(depth), domain.voxel_size)
    return np.asarray(depth * (1 - 2 * leaning * raised) / (1 + drift**2))


def _middle(rows: Sequence[Upright]) -> NDArray[np.float64]:
    """Mean lateral position (m) of the smoke at each height, over all frames."""
    total = np.sum([row.total for row in rows], 0)
    known = total > 0.02 * total.max()
    mean = np.sum([row.total * row.mean for row in rows], 0)[known] / total[known]
    return np.asarray(np.interp(rows[0].heights, rows[0].heights[known], mean))


def _floor_contact(row: Upright, camera: Camera, domain: Domain) -> _FloorContact | None:
    """The floor contact in one frame, if the lower end of the smoke is one."""
    _, along, height = view_frame(camera)
    matrix = np.array(camera.matrix, np.float64)
    centre = np.array(domain.centre)
    if camera.type != "perspective" or abs(height[2]) < 1 or (matrix[:3, 3] - centre) @ along >= 0:
        return None
    above_floor = matrix[2, 3] - domain.min[2]
    distance = float((centre - matrix[:3, 3]) @ along)
    reach = _reach(domain, along)
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


def _reach(domain: Domain, direction: NDArray[np.float64]) -> float:
    """Half the domain's extent along a direction."""
    return float(np.abs(direction) @ (np.array(domain.max) - np.array(domain.centre)))


def _joined(
    totals: NDArray[np.float64], heights: NDArray[np.float64], above: float, width: float, joining: float
) -> float | None:
    """The height from which on other smoke has joined that of the contact; None if there is none."""
    step = max(1, round(0.5 * width / (heights[1] - heights[0])))
    least = 1e-3 * totals.max()
    growth = np.min(np.maximum(totals[:, step:], least) / np.maximum(totals[:, :-step], least), 0)
    sudden = (growth > joining) & (heights[:-step] > above)
    return float(heights[:-step][sudden][0]) if sudden.any() else None
