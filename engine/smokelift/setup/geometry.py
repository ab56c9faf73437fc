"""Camera, domain and resolution: as the scene gives them, or estimated from where the smoke is in the picture."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from contextlib import suppress
from dataclasses import dataclass, field, replace

import numpy as np

from smokelift.checks import Figures, Remark
from smokelift.checks.array_types import Doubles
from smokelift.density.screen import view_frame
from smokelift.footage.clip import Clip
from smokelift.footage.plate import Plates
from smokelift.footage.working_picture import CameraError, working_picture
from smokelift.scene import Box, Camera, Domain, Scene, as_matrix
from smokelift.scene.projection import voxel_width
from smokelift.setup.detail import DetailSpectrum, smoke_detail
from smokelift.setup.estimate import Estimate, Grid, given, measured
from smokelift.setup.settings import LIMITS, LOST_DETAIL, QUALITIES, Quality, Settings
from smokelift.setup.smoke import SmokeSamples

Shape = tuple[int, int, int]

PICTURE_HEIGHT = 2.0
"""Metres that an uncalibrated picture is taken to be high where the smoke is, unless its distance is given: the size of
a person."""

FILM_WIDTH = 36.0
FILM_DIAGONAL = math.hypot(FILM_WIDTH, 24)
"""Millimetres of 35 mm film."""

LENS = 50 / FILM_WIDTH
"""Focal length over the longer side of the picture of an uncalibrated camera whose file says none: Blender's default
lens."""

BOX_MARGIN = 0.06
"""Margin on each side of an estimated box, as a fraction of its longer side."""

NARROWEST = 0.25
"""Width over height of an estimated box at least, and the reverse."""

MIN_SIDE_VOXELS = 32
"""Voxels along the longest side at least: with fewer there is nothing more to save."""

DETAIL_FRAMES = 3
"""Frames whose detail decides the resolution: those with the most smoke."""


@dataclass(frozen=True, eq=False)
class Geometry:
    """Where the camera stands and where the smoke is.

    Attributes
    ----------
    camera
        Of the clip's full pictures.
    domain
        With its final resolution.
    resolution
        Why it has that resolution; None for the finest grid of a quality that nothing was measured for.
    remarks
        What was assumed.
    qualities
        The grid that each quality would take of this clip; empty where nothing was measured.
    """

    camera: Camera
    domain: Domain
    resolution: Estimate[Shape] | None
    remarks: tuple[Remark, ...] = ()
    qualities: Mapping[Quality, Grid] = field(default_factory=dict)

    @property
    def estimates(self) -> tuple[Estimate[Shape], ...]:
        """What was measured for it."""
        return () if self.resolution is None else (self.resolution,)


def find_geometry(clip: Clip, scene: Scene, settings: Settings, plates: Plates, samples: SmokeSamples) -> Geometry:
    """Complete camera and domain.

    Raises
    ------
    ValueError
        If the scene gives a box without its camera or an inlet without its box, or no box for a camera that moves,
        looks steeply up or down, or is orthographic.
    """
    known = None if scene.camera is None else fitting(scene.camera, clip)
    if known is not None and scene.domain is not None:
        box, division, qualities = _divided(scene.domain, clip, known, settings, plates, samples)
        return Geometry(known, box, division, _grown(scene.domain, box), qualities)
    if scene.domain is not None:
        raise ValueError("The scene gives a box but no camera; give the camera that filmed it.")
    if scene.inlets:
        raise ValueError("The scene marks an inlet but gives no box; give camera and box to say where it is.")
    if known is not None and not _boxes(known):
        raise ValueError(
            "The scene gives a camera but no box; give the one that holds the smoke. It is found only for "
            "a perspective camera that does not move or look steeply up or down."
        )
    focal = _focal(clip)
    camera = known or _level(clip, focal, settings.distance)
    base, size, metres = _around(camera, samples, settings.distance)

    def grids(quality: Quality) -> tuple[Domain, ...]:
        # multiples of four, so that pyramids halve them evenly
        return _grids(base, size, LIMITS[quality].voxels(max(size) / metres), 4)

    estimate: Estimate[Shape] | None = None
    by_quality: Mapping[Quality, Grid] = {}
    if isinstance(settings.resolution, tuple):
        domain = _filled(base, size, settings.resolution)
        estimate = given("resolution", domain.resolution)
    elif settings.selection.measure:
        domain, estimate, by_quality = _resolved(clip, camera, grids, plates, samples.smoky, settings)
    else:
        domain = grids(settings.quality)[-1]
    around = Remark(
        "box around the smoke" if samples.smoky else "box over the picture",
        {"size": _size(domain), "resolution": domain.resolution},
    )
    return Geometry(
        camera, domain, estimate, (_assumed(known, clip, focal, metres * camera.size[1]), around), by_quality
    )


def _divided(
    box: Box, clip: Clip, camera: Camera, settings: Settings, plates: Plates, samples: SmokeSamples
) -> tuple[Domain, Estimate[Shape], Mapping[Quality, Grid]]:
    """A box that is given, with as many voxels as are asked for, and why; and the grid of each quality."""
    floor, size = np.array([*box.centre[:2], box.min[2]]), np.subtract(box.max, box.min)
    if isinstance(settings.resolution, tuple):
        if isinstance(box, Domain):
            domain = replace(box, resolution=settings.resolution)
        else:
            domain = _filled(floor, size, settings.resolution)
        return domain, given("resolution", domain.resolution), {}
    if isinstance(box, Domain) and settings.resolution is None:
        return box, given("resolution", box.resolution), {}
    still = camera.at(next(iter(samples.smoky), 0))

    def grids(quality: Quality) -> tuple[Domain, ...]:
        if isinstance(box, Domain):
            return _same_shape(box, LIMITS[quality].voxels(_pixels(still, box)))
        (coarsest,) = _grids(floor, size, MIN_SIDE_VOXELS, 1)
        return _grids(floor, size, LIMITS[quality].voxels(_pixels(still, coarsest)), 1)

    return _resolved(clip, camera, grids, plates, samples.smoky, settings)


def _focal(clip: Clip) -> float:
    """Focal length in pixels of a clip without a camera: the file's, or that of the usual lens."""
    width, height = clip.size
    return LENS * max(width, height) if clip.lens is None else clip.lens / FILM_DIAGONAL * math.hypot(width, height)


def fitting(camera: Camera, clip: Clip) -> Camera:
    """The camera with as many pixels as its clip.

    Raises
    ------
    ValueError
        If its picture has another shape than the clip's.
    """
    if camera.size[0] * clip.size[1] != camera.size[1] * clip.size[0]:
        raise ValueError(
            f"The camera's picture is {camera.size[0]} x {camera.size[1]}, the clip's {clip.size[0]} x {clip.size[1]} "
            f"({clip.path.name}); the camera's size must have the clip's shape."
        )
    return camera.resized(*clip.size)


def _assumed(given: Camera | None, clip: Clip, focal: float, height: float) -> Remark:
    """What is assumed of a camera, with its focal length in pixels, or of the scale where that alone is unknown.

    The picture is so many metres high where the smoke is.
    """
    if given is not None:
        return Remark("assumed scale", {"height": height})
    if clip.lens is not None:
        return Remark("assumed camera with the file's lens", {"height": height, "lens": clip.lens})
    lens = FILM_WIDTH * focal / max(clip.size)
    return Remark("assumed camera", {"height": height, "lens": lens, "film": FILM_WIDTH})


def _size(box: Box) -> tuple[float, ...]:
    """Lengths of the sides of a box in metres."""
    return tuple(high - low for low, high in zip(box.min, box.max, strict=True))


def _level(clip: Clip, focal: float, distance: float | None = None) -> Camera:
    """A level camera of a focal length in pixels that looks along +Y at the smoke above the world's origin."""
    width, height = clip.size
    metres = _pixel_at(distance, height, focal)
    up = metres * height / 2
    matrix = np.array([[1, 0, 0, 0], [0, 0, -1, -focal * metres], [0, 1, 0, up], [0, 0, 0, 1]], np.float64)
    return Camera("perspective", as_matrix(matrix), (width, height), focal, focal, width / 2, height / 2)


def _pixel_at(distance: float | None, height: int, focal: float) -> float:
    """Metres that a pixel of a picture so many pixels high shows where the smoke is; its distance (m) may be given."""
    return PICTURE_HEIGHT / height if distance is None else distance / focal


def _boxes(camera: Camera) -> bool:
    """Whether a box can be put around the smoke in a camera's picture: all of it shows what is ahead, not above."""
    if camera.type != "perspective" or camera.moves:
        return False
    _, along, up = view_frame(camera)
    width, height = camera.size
    ahead = _ways(camera, np.array([0, 0, width, width]), np.array([0, height, 0, height])) @ along
    return bool(up[2] == 1 and np.all(ahead > 0))


def _ways(camera: Camera, x: Doubles, y: Doubles) -> Doubles:
    """Directions (n, 3) in the world to what shows at some pixels; ``fy`` long along the way that the camera looks."""
    turn = np.array(camera.matrix, np.float64)[:3, :3]
    pixels = [(x - camera.cx) * camera.fy / camera.fx, camera.cy - y, np.full(x.shape, -camera.fy)]
    return np.asarray(np.stack(pixels, -1) @ turn.T)


def _around(camera: Camera, samples: SmokeSamples, distance: float | None) -> tuple[Doubles, Doubles, float]:
    """The box around the smoke before a camera, upright at a distance (m).

    That is where the picture of a level one is `PICTURE_HEIGHT` high, unless it is given.

    Returns
    -------
    The middle of its floor (3,) and its size (3,) in metres, and the metres that a pixel of the picture shows there.
    """
    metres = _pixel_at(distance, camera.size[1], camera.fy)
    distance = camera.fy * metres
    lateral, along, _ = view_frame(camera)
    eye = np.array(camera.matrix, np.float64)[:3, 3]
    left, right, top, bottom = _covered(samples)
    ways = _ways(camera, np.array([left, left, right, right]), np.array([top, bottom, top, bottom]))
    ways *= metres * (camera.fy / (ways @ along))[:, None]
    aside, height = ways @ lateral, ways[:, 2]
    across = max(np.ptp(aside), NARROWEST * np.ptp(height))
    up = max(np.ptp(height), NARROWEST * np.ptp(aside))
    # the far side of the box has to fill the picture too
    across *= 1 + across / (2 * distance)
    base = eye + distance * along + (aside.min() + aside.max()) / 2 * lateral
    base[2] = eye[2] + height.min()
    return base, np.array([across, across, up]), metres


def _filled(floor: Doubles, size: Doubles, resolution: Shape) -> Domain:
    """The box of so many voxels that holds one of a size in metres about the middle of its floor."""
    return _standing_on(floor, float((size / resolution).max()), resolution)


def _grids(floor: Doubles, size: Doubles, allowed: int, multiple: int) -> tuple[Domain, ...]:
    """A box of a size in metres about the middle of its floor, with every number of voxels, the fewest first.

    Where multiples of so many cubes do not fill it, it grows upward and to all sides.
    """
    grids = []
    for longest in range(MIN_SIDE_VOXELS, max(allowed, MIN_SIDE_VOXELS) + 1, 4):
        voxel = float(size.max() / longest)
        x, y, z = (max(8, multiple * math.ceil(side / voxel / multiple - 1e-6)) for side in size)
        grids.append(_standing_on(floor, voxel, (x, y, z)))
    return tuple(grids)


def _grown(given: Box, domain: Domain) -> tuple[Remark, ...]:
    """A remark where a box that is given without a resolution grows to whole voxels."""
    if np.allclose([domain.min, domain.max], [given.min, given.max], rtol=0, atol=1e-3 * domain.voxel_size):
        return ()
    return (Remark("grown box", {"size": _size(domain)}),)


def _standing_on(floor: Doubles, voxel: float, resolution: Shape) -> Domain:
    """The box of voxels of a size in metres about the middle of its floor."""
    size = np.array(resolution) * voxel
    low = floor - size * (0.5, 0.5, 0)
    high = low + size
    return Domain(
        (float(low[0]), float(low[1]), float(low[2])), (float(high[0]), float(high[1]), float(high[2])), resolution
    )


def _covered(samples: SmokeSamples) -> tuple[float, float, float, float]:
    """Left, right, top and bottom of the smoke in the full picture, in pixels, with a margin."""
    rows, columns = np.nonzero(samples.covered)
    if rows.size == 0:  # no smoke: any box will do
        rows, columns = np.array([0, samples.covered.shape[0] - 1]), np.array([0, samples.covered.shape[1] - 1])
    # a hundredth of the smoke's pixels on each side may be noise or the last wisps
    left, right = np.percentile(columns, [1, 99]) + np.array([0, 1])
    top, bottom = np.percentile(rows, [1, 99]) + np.array([0, 1])
    first_x, first_y, last_x, last_y = samples.bounds
    left, right = (float(v) * samples.scale + first_x for v in (left, right))
    top, bottom = (float(v) * samples.scale + first_y for v in (top, bottom))
    margin = BOX_MARGIN * max(right - left, bottom - top)
    left, right = max(left - margin, first_x), min(right + margin, last_x)
    return left, right, max(top - margin, first_y), min(bottom + margin, last_y)


def _same_shape(domain: Domain, most: int) -> tuple[Domain, ...]:
    """The box with every number of cubic voxels that fills it exactly, the fewest first; none finer than allowed."""
    common = math.gcd(*domain.resolution)
    x, y, z = (n // common for n in domain.resolution)
    longest = max(x, y, z)
    fewest = -(-min(MIN_SIDE_VOXELS, max(domain.resolution)) // longest)
    return tuple(
        replace(domain, resolution=(x * times, y * times, z * times))
        for times in range(fewest, max(most // longest, fewest) + 1)
    )


def _resolved(
    clip: Clip,
    camera: Camera,
    grids: Callable[[Quality], tuple[Domain, ...]],
    plates: Plates,
    smoky: tuple[int, ...],
    settings: Settings,
) -> tuple[Domain, Estimate[Shape], Mapping[Quality, Grid]]:
    """The coarsest of a quality's grids that loses no more of what the finest shows than tolerated, and why.

    The clip's detail is measured once, and says what each quality would take.
    """
    own = grids(settings.quality)
    if not smoky:
        shape = own[0].resolution
        return own[0], Estimate("resolution without smoke", what="resolution", value=shape, source="assumed"), {}
    detail = _detail(clip, camera, own[-1], plates, smoky)

    def coarsest(allowed: tuple[Domain, ...], tolerance: float) -> Domain:
        finest = max(allowed[-1].resolution)
        return next((grid for grid in allowed if detail.lost(max(grid.resolution), finest) <= tolerance), allowed[-1])

    tolerance = settings.selection.lost_detail
    domain = coarsest(own, tolerance)
    longest, finest = max(domain.resolution), max(own[-1].resolution)
    lost = detail.lost(longest)
    figures: Figures = {
        "lost": lost,
        "lost_beside_finest": detail.lost(longest, finest),
        "pixels": detail.pixels,
        "quality": settings.quality,
    }
    estimate = measured("resolution", domain.resolution, figures, tolerance=tolerance)
    others = {quality: coarsest(grids(quality), LOST_DETAIL[quality]) for quality in QUALITIES}
    taken = {**others, settings.quality: domain}
    by_quality = {name: Grid(grid.resolution, detail.lost(max(grid.resolution))) for name, grid in taken.items()}
    return domain, estimate, by_quality


def _detail(clip: Clip, camera: Camera, box: Domain, plates: Plates, smoky: tuple[int, ...]) -> DetailSpectrum:
    """The detail of the smoke in some frames, at the clip's own pixels."""
    frames = []
    for number in smoky[:DETAIL_FRAMES]:
        with suppress(CameraError):
            part = working_picture(camera.at(number), box).part
            frames.append((part(clip.frame(number)), plates.at(number).through(part)))
    return smoke_detail(frames, _pixels(camera.at(smoky[0]), box))


def _pixels(camera: Camera, box: Domain) -> float:
    """How many pixels of a still camera's picture lie along the longest side of a box."""
    return voxel_width(camera, box) * max(box.resolution)
