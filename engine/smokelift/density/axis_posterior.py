"""Where in depth the smoke stands: a posterior over the depth of its base, to which each cue adds a log-likelihood.

One picture of smoke looks the same whether the smoke is near and small or far and large. Three cues show its place:

- the box, which is put around its smoke: the mean depth is normal about its middle;
- the base, where a column begins: a given distance or a marked inlet says its depth, else its contact with the floor;
- the way up: a column is upright or leans. One that comes back to the middle across the picture does so in depth. One
  that drifts across the picture drifts as far in depth, but nobody knows where to: there the box alone speaks.

Several cameras need none of them: `depth_prior` reads the axis from what they have in common.
docs/experiments/density-axis.md has the worth of each cue. It chose the constants of this page that cite no other.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from smokelift.checks.array_types import Doubles
from smokelift.density.axis import AxisEstimate, Cue, SmokeAxis, depth_at
from smokelift.density.observation import ObservedClip, ObservedView
from smokelift.density.screen import Screen, reach_along, seen_at, upright_screen, view_frame
from smokelift.footage.matte import matte
from smokelift.scene import Camera, Domain, Inlet
from smokelift.scene.projection import ray_through_pixels

FRAMES = 16
"""Number of frames of a clip from which the axis is estimated."""

MAX_VOXELS = 512
"""Largest number of voxels along a side of the box; finer grids show the place no better
(docs/experiments/density-axis.md)."""

CANDIDATES = 121
"""Number of depths that are compared, from the front of the box to its back: 60 to a reach (half the box's depth). So
`UPRIGHT_DEVIATION`, the narrowest of all, is three steps."""

BOX_DEVIATION = 0.165
"""Standard deviation, in reaches, of the smoke's depth about the middle of its box
(docs/experiments/density-axis.md)."""

BOX_COUNT = 2.0
"""Number of boxes that `BOX_DEVIATION` counts as. The box at hand counts as one more, by how far off its middle the
smoke is across the picture (docs/experiments/density-axis.md)."""

MAX_KNOWN_DEVIATION = 0.95
"""Largest standard deviation of a depth that a floor contact determines, over that by the box alone. A contact that
leaves about as much spread as the box shows nothing."""

MIN_CONTACT_SHARE = 0.6
"""Smallest share of the frames that show a floor contact where there is one."""

FLOOR_PROBABILITY = 0.6
"""Probability that smoke which seems to touch the floor does."""

CONTACT_DEVIATION = 0.08
"""Standard deviation, in reaches, of the depth that a floor contact shows."""

BASE_HEIGHT = 0.3
"""Mean height above the floor, in reaches, of smoke that only seems to touch it (exponential)."""

LEANING_PROBABILITY = 0.2
"""Probability that a column leans, before anything is seen of it."""

UPRIGHT_DEVIATION = 0.05
"""Standard deviation, in reaches, of the distance of an upright column's mean from its base."""

LEANING_DEVIATION = 0.5
"""Standard deviation, in reaches, of that distance for a column that leans, across the picture and in depth."""

WIDENING = 0.15
"""Growth of a column's radius per metre of height: it takes in air (docs/experiments/density-axis.md)."""

INERTIA = 0.5
"""Weight of a column's place in the row below, in shares of its smoke: other smoke in a row may not be its own
(docs/experiments/density-axis.md)."""


def clip_axis(clip: ObservedClip, distance: float | None = None) -> AxisEstimate | None:
    """The axis of a clip's smoke; None where there is no smoke, or a camera that travels, or more than one.

    The pictures of a camera that turns in its place are put into its middle picture. For one that travels the axis is
    known only by ``distance``: how far (m) ahead of the camera of its first picture the smoke stands. It raises
    ValueError if what stands there is outside the box.
    """
    moments = [observations for frame in clip.spread(FRAMES) if (observations := clip.observe(frame))]
    if not moments or len(moments[0]) > 1:
        return None
    seen = [observations[0] for observations in moments]
    eyes = np.array([each.camera.matrix for each in seen])[:, :3, 3]
    if not np.allclose(eyes, eyes[0]):
        if distance is None:
            return None
        first, domain = seen[0].camera, clip.optics.domain
        return estimate_axis([], first, domain, base=depth_at(distance, first, domain))
    camera, domain = seen[len(seen) // 2].camera, clip.optics.domain.with_at_most(MAX_VOXELS)
    optics = replace(clip.optics, domain=domain)
    amounts = [
        np.where(matte(each.image, each.plate).mask, ObservedView.of(each, optics).optical_depth, np.float32(0))
        for each in seen
    ]
    if distance is None and not any(amount.any() for amount in amounts):
        return None
    if clip.moves:
        points = np.add(*ray_through_pixels(camera))
        amounts = [
            seen_at(points, amount, each.camera).astype(np.float32) for amount, each in zip(amounts, seen, strict=True)
        ]
    base = None if distance is None else depth_at(distance, camera, clip.optics.domain)
    return estimate_axis(amounts, camera, domain, clip.inlets, base)


def estimate_axis(
    amounts: Sequence[NDArray[np.float32]],
    camera: Camera,
    domain: Domain,
    inlets: Sequence[Inlet] = (),
    base: float | None = None,
) -> AxisEstimate:
    """The axis of the smoke in some frames; the middle of the box where nothing else is known.

    ``amounts`` are the optical depths (rows, columns) that a camera at rest sees, 0 where there is no smoke. Smoke
    enters at the inlets; without any a floor contact is searched for. ``base`` is the depth (m) at which the one column
    is known to stand; neither counts then.
    """
    screens = [screen for amount in amounts if (screen := upright_screen(amount, camera, domain)).values.any()]
    reach = reach_along(domain, view_frame(camera)[1])
    cue: Cue = "box" if base is None else "distance"
    if not screens:
        return AxisEstimate(SmokeAxis.upright(base or 0.0), cue, base or 0.0, BOX_DEVIATION * reach)
    mean = replace(screens[0], values=np.mean([screen.values for screen in screens], 0))
    total = mean.values.sum(1)
    smoky = total > 0.02 * total.max()
    middle = np.interp(mean.heights, mean.heights[smoky], mean.rows().mean[smoky])
    aside = np.average(middle**2, weights=total)
    deviation = np.sqrt((BOX_COUNT * (BOX_DEVIATION * reach) ** 2 + aside) / (BOX_COUNT + 1))
    depths = np.linspace(-reach, reach, CANDIDATES)
    if base is not None:
        lowest, widths = int(np.argmax(smoky)), np.zeros_like(middle)
        columns = [
            _Column(
                _normal(depths - base, depths[1] - depths[0]),
                mean.heights[lowest],
                middle,
                widths,
                middle - middle[lowest],
            )
        ]
    elif inlets:
        cue, columns = "inlets", _inlet_columns(inlets, mean, middle, depths, camera, domain)
    else:
        columns = _floor_column(screens, len(amounts), middle, depths, camera, domain)
    if not columns:
        return AxisEstimate(SmokeAxis.upright(), cue, 0.0, float(deviation))
    # several columns lean towards one another
    leans = LEANING_PROBABILITY if len(columns) == 1 else 0.0
    known = [_posterior(column, depths, total, deviation, leans) for column in columns]
    error = np.sqrt(np.average(np.mean([variance for _, variance in known], 0), weights=total))
    axis = _axis(columns, [depth for depth, _ in known], mean)
    depth = float(np.average(np.broadcast_to(axis.depths, mean.values.shape), weights=mean.values))
    if cue == "box" and error < MAX_KNOWN_DEVIATION * deviation:
        cue = "floor contact"
    return AxisEstimate(axis, cue, depth, float(error))


@dataclass(frozen=True, eq=False)
class _Column:
    """Smoke that rises from a base.

    Attributes
    ----------
    base : (k,)
        Log-likelihood of each depth of its base.
    begins
        Height (m above the domain's centre) of its base.
    middles, widths, drifts : (n,)
        By height: lateral place (m) of its axis, its lateral standard deviation, distance of its axis from its base.
    """

    base: Doubles
    begins: float
    middles: Doubles
    widths: Doubles
    drifts: Doubles


def _posterior(column: _Column, depths: Doubles, total: Doubles, box: float, leans: float) -> tuple[Doubles, Doubles]:
    """Mean and variance (n,) of a column's depth by height, from candidates (k,) for the depth of its base.

    The depth of its mean has a standard deviation ``box`` (m) about the middle. It leans with a probability ``leans``.
    ``total`` (n,) is the smoke by height.
    """
    raised = np.cumsum(total) / total.sum()  # half in the column's mean
    aside = float(np.average(column.drifts, weights=total))
    upright, leaning = UPRIGHT_DEVIATION * depths[-1], LEANING_DEVIATION * depths[-1]
    wide = np.hypot(box, leaning)
    # of an upright column and of one that leans (2, k): where its base is, and how it leans across the picture
    likelihood = column.base + _normal(depths, np.array([[box], [wide]]))
    likelihood += _normal(aside, np.array([[upright], [leaning]]))
    share = np.exp(likelihood - likelihood.max()) * np.array([[1 - leans], [leans]])
    share /= share.sum()
    # what leans comes back to where the box expects its mean, and further above it
    back = np.stack([np.zeros_like(raised), 2 * raised * (leaning / wide) ** 2])
    depth, square = (np.einsum("hk,k,hn->n", share, depths**power, (1 - back) ** power) for power in (1, 2))
    variance = square - depth**2 + (share.sum(1) @ back * box) ** 2
    # what drifts across the picture drifts in depth as well
    trusted = box**2 / (box**2 + column.drifts**2)
    return depth * trusted, variance * trusted**2 + box**2 * (1 - trusted)


def _normal(value: Doubles | float, deviation: Doubles | float) -> Doubles:
    """Logarithm of a normal density about zero, but for a constant."""
    return np.asarray(-np.square(value / deviation) / 2 - np.log(deviation))


def _floor_column(
    screens: Sequence[Screen], frames: int, middle: Doubles, depths: Doubles, camera: Camera, domain: Domain
) -> list[_Column]:
    """The column that stands on the floor; none where too few of the frames show a contact.

    A disc of smoke on the floor begins in the picture within a few rows, where the ray through the floor meets it. What
    begins nearer and above the floor shows the same.
    """
    eye, (_, along, height) = np.array(camera.matrix, np.float64)[:3, 3], view_frame(camera)
    distance = float((np.array(domain.centre) - eye) @ along)
    above = eye[2] - domain.min[2]
    if camera.type != "perspective" or abs(height[2]) < 1 or distance <= 0 or above <= 0:
        return []
    found = [contact for screen in screens if (contact := _floor_contact(screen, distance, above, camera, domain))]
    if len(found) < MIN_CONTACT_SHARE * frames:
        return []
    contact, width, begins = np.median(found, 0)
    reach, heights = depths[-1], screens[0].heights
    # the line of sight rises towards the camera
    nearer, rate = contact - depths, above / (distance + contact) / (BASE_HEIGHT * reach)
    deviation = CONTACT_DEVIATION * reach
    on_floor = np.exp(_normal(nearer, deviation)) / np.sqrt(2 * np.pi)
    above_floor = np.where(nearer > 0, rate * np.exp(-rate * np.abs(nearer)), 0)
    base = np.log(FLOOR_PROBABILITY * on_floor + (1 - FLOOR_PROBABILITY) * above_floor + 1e-300)
    drifts = middle - np.interp(begins + width / 4, heights, middle)
    return [_Column(base, begins, middle, np.zeros_like(middle), drifts)]


def _floor_contact(
    screen: Screen, distance: float, above: float, camera: Camera, domain: Domain
) -> tuple[float, float, float] | None:
    """Depth and lateral width (m) of the floor contact in one frame, and the height (m) of its lower end; if any.

    ``distance`` is how far the camera is before the middle of the box, ``above`` how far above its floor (m).
    """
    reach = reach_along(domain, view_frame(camera)[1])
    # depth of the floor that one row of the picture shows
    pixel = distance**2 / (above * camera.fy)
    if pixel > reach / 2:
        return None
    rows = screen.rows()
    heights, total = rows.heights, rows.total
    smoky = total > 0.05 * np.percentile(total[total > 0], 75)
    begins = heights[np.argmax(smoky)]
    near = smoky & (heights <= begins + 12 * (heights[1] - heights[0]))
    width = 2 * np.sqrt(3) * np.average(rows.spread[near], weights=total[near])
    level = np.median(total[smoky & (heights <= begins + width)])
    # where the rows first hold so much of their level
    edges = np.interp(np.array([0.2, 0.5, 0.8]) * level, np.maximum.accumulate(total), heights)
    up = edges + domain.centre[2] - domain.min[2]
    front, middle, back = np.where(up < above, distance * up / np.maximum(above - up, 1e-9), np.inf)
    # a disc on the floor is as deep as it is wide; the lower end of what floats takes many more rows
    return (middle, width, begins) if abs(middle) < reach and back - front < width + pixel else None


def _inlet_columns(
    inlets: Sequence[Inlet], mean: Screen, middle: Doubles, depths: Doubles, camera: Camera, domain: Domain
) -> list[_Column]:
    """The columns above inlets, followed upwards in the mean picture where there are several.

    The smoke of each row is shared out among the columns that have begun: a mixture of Gaussians, by expectation
    maximisation. Each is expected where it was in the row below, as wide as a rising column becomes. Were the widths
    free, one column would swallow the others.
    """
    lateral, along, up = view_frame(camera)
    places = np.array([inlet.centre for inlet in inlets]) - np.array(domain.centre)
    radii = np.array([inlet.radius for inlet in inlets])
    now, begins = places @ lateral, places @ up - radii
    # a disc's standard deviation is half its radius
    widths = (radii[:, None] + WIDENING * np.maximum(mean.heights - begins[:, None], 0)) / 2
    middles = np.tile(middle, (len(inlets), 1))
    for row, smoke in enumerate(mean.values if len(inlets) > 1 else ()):
        begun = mean.heights[row] >= begins
        for _ in range(3):
            share = _likelihood(mean.laterals, now[begun, None], widths[begun, row, None])
            part = smoke / max(smoke.sum(), 1e-30) * share / np.maximum(share.sum(0), 1e-30)
            now[begun] = (INERTIA * now[begun] + part @ mean.laterals) / (INERTIA + part.sum(1))
        middles[:, row] = now
    drifts = middles - (places @ lateral)[:, None]
    bases = _normal(depths - (places @ along)[:, None], depths[1] - depths[0])
    return [_Column(*column) for column in zip(bases, begins, middles, widths, drifts, strict=True)]


def _likelihood(places: Doubles, middles: Doubles, widths: Doubles) -> Doubles:
    """Likelihood of columns at some lateral places with smoke; never quite zero."""
    return np.asarray(np.exp(-(((places - middles) / widths) ** 2) / 2) + 1e-9)


def _axis(columns: Sequence[_Column], known: Sequence[Doubles], mean: Screen) -> SmokeAxis:
    """The axis of columns whose depths (n,) are known; their mean where several may hold the smoke."""
    if len(columns) == 1:
        return SmokeAxis.by_height(mean.heights, known[0])
    # below all columns there is the lowest one
    heights = np.maximum(mean.heights, min(column.begins for column in columns))[:, None]
    shares = np.array(
        [
            _likelihood(mean.laterals, column.middles[:, None], column.widths[:, None]) * (heights >= column.begins)
            for column in columns
        ]
    )
    shares /= shares.sum(0)
    depths, squares, widths = (
        np.sum(shares * np.array(values)[..., None], 0)
        for values in (known, np.square(known), [column.widths for column in columns])
    )
    return SmokeAxis(mean.heights, mean.laterals, depths, np.sqrt(np.maximum(squares - depths**2, 0)), widths)
