"""Where in depth the smoke of one camera stands, by what shows it.

One picture of smoke looks the same whether the smoke is near and small or far and large. Three cues show its place:

- the box, which is put around its smoke: the mean depth is about its middle;
- the base, where a column begins: a given distance or a marked inlet says its depth, else its contact with the floor;
- the ceiling, where smoke reaches it and none shows above: rays over the middle of it meet only what stands nearer.

A column that drifts across the picture drifts as far in depth, but nobody knows where to.

Several cameras need none of them: `depth_prior` reads the axis from what they have in common.
docs/experiments/density-axis.md has the worth of each cue.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from smokelift.checks import Doubles
from smokelift.density.observation import ObservedClip, ObservedView
from smokelift.density.upright_plane import (
    AxisEstimate,
    Cue,
    PlanePicture,
    PlaneRays,
    SmokeAxis,
    depth_at,
    on_upright_plane,
    reach_along,
    seen_at,
    view_frame,
)
from smokelift.extraction.matte import matte
from smokelift.scene import Camera, Domain, Inlet
from smokelift.scene.camera import ray_through_pixels

FRAMES = 16
"""Number of frames of a clip from which the axis is estimated."""

ROWS = 2
"""Rows of the upright plane to a voxel: a contact begins within few."""

MAX_VOXELS = 512
"""Largest number of voxels along a side of the box; finer grids show the place no better
(docs/experiments/density-axis.md)."""

BOX_DEVIATION = 0.165
"""Standard deviation, in reaches, of the smoke's depth about the middle of its box
(docs/experiments/density-axis.md)."""

BOX_COUNT = 2.0
"""Number of boxes that `BOX_DEVIATION` counts as. The box at hand counts as one more, by how far off its middle the
smoke is across the picture (docs/experiments/density-axis.md)."""

MIN_CONTACT_FRAMES = 0.6
"""Smallest fraction of the frames that show a floor contact where there is one."""

CONTACT_TRUST = 0.7
"""Weight of the depth that a floor contact shows, at most: smoke that begins above the floor shows one as well
(docs/experiments/density-axis.md)."""

FAR_BEHIND = 1.5
"""Distance behind the middle, in `BOX_DEVIATION`, from which a contact is more likely smoke that begins above the
floor: the standard deviation of the Gaussian by which the weight falls."""

MIN_CONTACT_TRUST = 0.2
"""Smallest weight of a contact that shows the place: less leaves about what the box does."""

LEANING = 0.2
"""Fraction of the box's variance that stays of a column whose base is known: it may lean
(docs/experiments/density-axis.md)."""

SPECK, USUAL_ROW = 0.05, 75
"""Fraction of the largest row from which a row shows smoke, not specks; and the percentile of the rows with smoke that
counts as the largest where a floor contact is looked for."""

FAINT_ROW = 0.02
"""Fraction of the largest row from which a row shows where across the picture the smoke is; between such rows the
places are interpolated."""

CONTACT_ROWS = 12
"""Rows of the upright plane, above the first one with smoke, that show how wide a floor contact is."""

CONTACT_EDGES = (0.2, 0.5, 0.8)
"""Fractions of the smoke above a floor contact that the rows reach at its front, middle and back."""

WIDENING = 0.15
"""Growth of a column's radius per meter of height: it takes in air."""

INERTIA = 0.5
"""Weight of a column's place in the row below, in units of its smoke: other smoke in a row may not be its own."""


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
    thicknesses = [
        np.where(matte(each.image, each.clean_plate).mask, ObservedView.of(each, optics).optical_depth, np.float32(0))
        for each in seen
    ]
    if distance is None and not any(each.any() for each in thicknesses):
        return None
    if clip.moves:
        points = np.add(*ray_through_pixels(camera))
        thicknesses = [
            seen_at(points, shown, each.camera).astype(np.float32)
            for shown, each in zip(thicknesses, seen, strict=True)
        ]
    base = None if distance is None else depth_at(distance, camera, clip.optics.domain)
    return estimate_axis(thicknesses, camera, domain, clip.inlets, base)


def estimate_axis(
    thicknesses: Sequence[NDArray[np.float32]],
    camera: Camera,
    domain: Domain,
    inlets: Sequence[Inlet] = (),
    base: float | None = None,
) -> AxisEstimate:
    """The axis of the smoke in some frames; the middle of the box where nothing else is known.

    ``thicknesses`` are the optical depths (rows, columns) that a camera at rest sees, 0 where there is no smoke. Smoke
    enters at the inlets; without any a floor contact is searched for. ``base`` is the depth (m) at which the one column
    is known to stand; neither counts then.
    """
    pictures = [shown for each in thicknesses if (shown := on_upright_plane(each, camera, domain, ROWS)).values.any()]
    reach = reach_along(domain, view_frame(camera)[1])
    cue: Cue = "box" if base is None else "distance"
    if not pictures:
        return AxisEstimate(SmokeAxis.upright(base or 0.0), cue, base or 0.0, BOX_DEVIATION * reach)
    mean = replace(pictures[0], values=np.mean([picture.values for picture in pictures], 0))
    total = mean.total
    smoky = total > FAINT_ROW * total.max()
    middle = np.interp(mean.heights, mean.heights[smoky], mean.mean[smoky])
    offset = np.average(middle**2, weights=total)
    box = np.sqrt((BOX_COUNT * (BOX_DEVIATION * reach) ** 2 + offset) / (BOX_COUNT + 1))
    if base is not None:
        lowest = int(np.argmax(smoky))
        columns = [_Column(base, mean.heights[lowest], middle, np.zeros_like(middle), middle - middle[lowest])]
    elif inlets:
        cue, columns = "inlets", _inlet_columns(inlets, mean, middle, camera, domain)
    else:
        columns = _floor_column(pictures, len(thicknesses), middle, camera, domain)
    if not columns:
        axis = SmokeAxis.by_height(mean.heights, np.zeros_like(mean.heights))
        axis = _under_ceiling(axis, pictures, camera, domain)
        return AxisEstimate(axis, cue, _mean_depth(axis, mean), float(box))
    # what drifts across the picture drifts in depth as well
    weights = [box**2 / (box**2 + column.drifts**2) for column in columns]
    trusts = [(1 - LEANING) * column.trust * weight for column, weight in zip(columns, weights, strict=True)]
    error = box * np.sqrt(1 - np.average(np.mean(trusts, 0), weights=total))
    axis = _axis(columns, [column.base * weight for column, weight in zip(columns, weights, strict=True)], mean)
    if cue == "box":
        axis = _under_ceiling(axis, pictures, camera, domain)
    depth = _mean_depth(axis, mean)
    if cue == "box" and columns[0].trust >= MIN_CONTACT_TRUST:
        cue = "floor contact"
    return AxisEstimate(axis, cue, depth, float(error))


def _mean_depth(axis: SmokeAxis, mean: PlanePicture) -> float:
    """Mean depth (m) of the smoke of a picture that stands on an axis."""
    return float(np.average(np.broadcast_to(axis.depths, mean.values.shape), weights=mean.values))


@dataclass(frozen=True, eq=False)
class _Column:
    """Smoke that rises from a base."""

    base: float
    """Depth (m) of its base."""
    begins: float
    """Height (m above the domain's center) of its base."""
    middles: Doubles
    widths: Doubles
    drifts: Doubles
    """(n,): by height: lateral place (m) of its axis, its lateral standard deviation, distance of its axis from its
    base."""
    trust: float = 1.0
    """Weight of what shows the base."""


def _floor_column(
    pictures: Sequence[PlanePicture], frames: int, middle: Doubles, camera: Camera, domain: Domain
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
    found = [contact for picture in pictures if (contact := _floor_contact(picture, distance, above, camera, domain))]
    if len(found) < MIN_CONTACT_FRAMES * frames:
        return []
    contact, width, begins = np.median(found, 0)
    far = FAR_BEHIND * BOX_DEVIATION * reach_along(domain, along)
    trust = CONTACT_TRUST * np.exp(-((max(contact, 0) / far) ** 2) / 2)
    drifts = middle - np.interp(begins + width / 4, pictures[0].heights, middle)
    return [_Column(trust * contact, begins, middle, np.zeros_like(middle), drifts, trust)]


def _floor_contact(
    picture: PlanePicture, distance: float, above: float, camera: Camera, domain: Domain
) -> tuple[float, float, float] | None:
    """Depth and lateral width (m) of the floor contact in one frame, and the height (m) of its lower end; if any.

    ``distance`` is how far the camera is before the middle of the box, ``above`` how far above its floor (m).
    """
    reach = reach_along(domain, view_frame(camera)[1])
    # depth of the floor that one row of the picture shows
    pixel = distance**2 / (above * camera.fy)
    if pixel > reach / 2:
        return None
    heights, total = picture.heights, picture.total
    smoky = total > SPECK * np.percentile(total[total > 0], USUAL_ROW)
    begins = heights[np.argmax(smoky)]
    near = smoky & (heights <= begins + CONTACT_ROWS * (heights[1] - heights[0]))
    width = 2 * np.sqrt(3) * np.average(picture.spread[near], weights=total[near])
    level = np.median(total[smoky & (heights <= begins + width)])
    # where the rows first hold so much of their level
    edges = np.interp(np.array(CONTACT_EDGES) * level, np.maximum.accumulate(total), heights)
    up = edges + domain.centre[2] - domain.min[2]
    front, middle, back = np.where(up < above, distance * up / np.maximum(above - up, 1e-9), np.inf)
    # a disc on the floor is as deep as it is wide; the lower end of what floats takes many more rows
    return (middle, width, begins) if abs(middle) < reach and back - front < width + pixel else None


def _under_ceiling(axis: SmokeAxis, pictures: Sequence[PlanePicture], camera: Camera, domain: Domain) -> SmokeAxis:
    """An axis that leads, from one width of the smoke below the ceiling, to where smoke stands that ends at it.

    A ray over the middle of the ceiling meets only what stands before it. So the row that shows half of what there is
    shows the smoke's middle, unless smoke goes on above: then the last rays that meet the domain show as much. What
    stands behind the middle shows as if it ended below the ceiling, and stays (docs/experiments/density-axis.md).
    """
    rays, (_, along, up) = PlaneRays.of(camera, domain), view_frame(camera)
    heights, ceiling = axis.heights, reach_along(domain, up)
    eye = np.array(camera.matrix, np.float64)[:3, 3] - np.array(domain.centre)
    distance, above = -float(eye @ along), ceiling - float(eye @ up)
    # of every column of pixels the last ray that meets the domain
    lasts = np.where(rays.missed, -np.inf, rays.height).max(0)
    last = lasts[np.isfinite(lasts)].min(initial=np.inf) - domain.voxel_size
    if camera.type != "perspective" or abs(up[2]) < 1 or distance <= 0 or above <= 0 or not ceiling < last < np.inf:
        return axis
    over, shown = heights >= ceiling, []
    for picture in pictures:
        total = picture.total
        there, beyond = np.interp([ceiling, last], heights, total)  # at the ceiling's middle, and at its front edge
        width = max(2 * np.sqrt(3) * np.interp(ceiling, heights, picture.spread), domain.voxel_size)
        below = np.median(total[(heights <= ceiling) & (heights >= ceiling - width / 2 - domain.voxel_size)])
        # a ray to the middle meets half of what stands there, and a speck is no column
        if there > max(below / 2, SPECK * total.max()):
            half = np.interp(-max(there, below) / 2, -np.minimum.accumulate(total[over]), heights[over])
            depth = distance * above / (half - ceiling + above) - distance
            shown.append([depth, width, max(1 - beyond / there, 0), there])
    if not shown:
        return axis
    *known, weights = np.array(shown).T
    depth, width, ends = np.average(known, 1, weights)
    weight = ends * np.exp(-((np.maximum(ceiling - heights, 0) / width) ** 2) / 2)[:, None]
    return replace(axis, depths=(1 - weight) * axis.depths + weight * depth)


def _inlet_columns(
    inlets: Sequence[Inlet], mean: PlanePicture, middle: Doubles, camera: Camera, domain: Domain
) -> list[_Column]:
    """The columns above inlets, followed upwards in the mean picture where there are several.

    The smoke of each row is shared out among the columns that have begun: a mixture of Gaussians, by expectation
    maximization. Each is expected where it was in the row below, as wide as a rising column becomes. Were the widths
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
            likelihood = _likelihood(mean.laterals, now[begun, None], widths[begun, row, None])
            part = smoke / max(smoke.sum(), 1e-30) * likelihood / np.maximum(likelihood.sum(0), 1e-30)
            now[begun] = (INERTIA * now[begun] + part @ mean.laterals) / (INERTIA + part.sum(1))
        middles[:, row] = now
    drifts = middles - (places @ lateral)[:, None]
    return [_Column(*column) for column in zip(places @ along, begins, middles, widths, drifts, strict=True)]


def _likelihood(places: Doubles, middles: Doubles, widths: Doubles) -> Doubles:
    """Likelihood of columns at some lateral places with smoke; never quite zero."""
    return np.asarray(np.exp(-(((places - middles) / widths) ** 2) / 2) + 1e-9)


def _axis(columns: Sequence[_Column], known: Sequence[Doubles], mean: PlanePicture) -> SmokeAxis:
    """The axis of columns whose depths (n,) are known; their mean where several may hold the smoke."""
    if len(columns) == 1:
        return SmokeAxis.by_height(mean.heights, known[0])
    # below all columns there is the lowest one
    heights = np.maximum(mean.heights, min(column.begins for column in columns))[:, None]
    weights = np.array(
        [
            _likelihood(mean.laterals, column.middles[:, None], column.widths[:, None]) * (heights >= column.begins)
            for column in columns
        ]
    )
    weights /= weights.sum(0)
    depths, squares, widths = (
        np.sum(weights * np.array(values)[..., None], 0)
        for values in (known, np.square(known), [column.widths for column in columns])
    )
    return SmokeAxis(mean.heights, mean.laterals, depths, np.sqrt(np.maximum(squares - depths**2, 0)), widths)
