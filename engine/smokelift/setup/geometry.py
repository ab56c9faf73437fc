"""Camera, box and voxels: as the scene gives them, or estimated from the smoke; and the picture they are fitted to.

As many voxels are taken as the smoke's detail asks for, as far as it stands out from the clip's noise. The spectrum of
what the smoke changes is compared with that of the noise beside it. It is a cosine transform of sRGB values, in which a
clip's noise is even. A grid shows what is coarser than two of its voxels, and loses the part of the contrast that is
finer (docs/experiments/clip-pixels.md). The working picture is a frame cropped to the box and reduced to about one
pixel per voxel.
"""

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np
import scipy.fft
from numpy.typing import NDArray

from smokelift.checks import Doubles, Figures, Finding
from smokelift.density.upright_plane import view_frame
from smokelift.extraction.matte import matte
from smokelift.extraction.plate import Plate
from smokelift.footage.clip import Clip
from smokelift.footage.images import Picture, area_average, linear_to_srgb
from smokelift.render.renderer import Image
from smokelift.scene import Camera, Domain, Scene, as_matrix
from smokelift.scene.camera import project_points, voxel_width
from smokelift.setup.first_estimate import FirstEstimate, SmokeSamples
from smokelift.setup.settings import LIMITS, LOST_DETAIL, QUALITIES, Quality, Settings

PICTURE_HEIGHT = 2.0
"""Height in meters of an uncalibrated picture where the smoke is, unless its distance is given: a person's size."""

FILM_SIZE = 36.0, 24.0
"""Width and height (mm) of 35 mm film (by definition)."""

LENS_FOCAL_LENGTH = 50.0
"""Focal length (mm) where the clip's file says none: Blender's default lens."""

BOX_MARGIN = 0.06
"""Margin on each side of an estimated box, as a fraction of its longer side: two voxels of the coarsest grid, for smoke
that is fainter than the mask shows."""

MIN_ASPECT = 0.25
"""Smallest width over height of an estimated box, and the reverse: no side of the coarsest grid is below 8 voxels."""

MIN_SIDE_VOXELS = 32
"""Smallest number of voxels along the longest side: fewer save nothing more
(docs/experiments/clip-pixels.md)."""

DETAIL_FRAMES = 3
"""Number of frames, those with the most smoke, whose detail decides the resolution (docs/selection.md)."""

Shape = tuple[int, int, int]

RINGS = 256
"""Rings of equal width of spatial frequency, up to that of single pixels: in a picture of up to 1,024 pixels they are
finer than the step of four voxels from one grid to the next."""

NORMAL_MEDIAN = 1.4826
"""Standard deviation of normal noise over the median of its size (by definition)."""


@dataclass(frozen=True)
class Grid:
    """The voxels (x, y, z) that a quality takes for a clip.

    ``lost`` is the part of the smoke's contrast that is finer than they show; None where that was not measured.
    """

    resolution: Shape
    lost: float | None


@dataclass(frozen=True, eq=False)
class DetailSpectrum:
    """The energy (RINGS,) of the smoke's picture beyond the noise, by spatial frequency.

    ``pixels`` of the picture lie along the longest side of the box.
    """

    energy: Doubles
    pixels: float

    def lost(self, longest: float, finest: float | None = None) -> float:
        """Fraction of the clip's contrast (root of the energy) that a grid with ``longest`` voxels in a row loses.

        With ``finest``, only what a grid of so many voxels shows counts as lost.
        """
        whole = float(self.energy.sum())
        if whole <= 0:
            return 0.0
        # the first rings that grids do not show; as many voxels as pixels show all
        first, end = (min(round(RINGS * voxels / self.pixels), RINGS) for voxels in (longest, finest or self.pixels))
        return float(np.sqrt(self.energy[first:end].sum() / whole))


@dataclass(frozen=True, eq=False)
class Geometry:
    """The camera of the clip's full pictures, and the box with its final resolution.

    ``qualities`` has the grid that each quality would take, ``findings`` what was assumed, and why the resolution is
    that one.
    """

    camera: Camera
    domain: Domain
    qualities: Mapping[Quality, Grid]
    findings: tuple[Finding, ...]


def find_geometry(scene: Scene, estimate: FirstEstimate, settings: Settings) -> Geometry:
    """Complete camera and domain.

    It is a ValueError if a box lacks its camera or an inlet its box, or if no box is given for a camera that moves,
    looks steeply up or down, or is orthographic.
    """
    clip, samples, box = estimate.clip, estimate.samples, scene.domain
    known = None if scene.camera is None else fitting(scene.camera, clip)
    _require_camera_and_box(scene, known)
    assumed = partial(Finding, about="camera", source="assumed")
    if known is not None:
        focal, scale = known.fy, assumed("assumed scale", about="")
    elif clip.lens is not None:
        focal = clip.lens / math.hypot(*FILM_SIZE) * math.hypot(*clip.size)
        scale = assumed("assumed camera with the file's lens", {"lens": clip.lens})
    else:
        focal = LENS_FOCAL_LENGTH / FILM_SIZE[0] * max(clip.size)
        scale = assumed("assumed camera", {"lens": LENS_FOCAL_LENGTH, "film": FILM_SIZE[0]})
    # what a pixel shows where the smoke is
    meters = PICTURE_HEIGHT / clip.size[1] if settings.distance is None else settings.distance / focal
    camera = known or _level_camera(clip.size, focal, meters)
    if box is None:
        # multiples of four: pyramids halve them evenly
        (floor, size), multiple = _box_around_smoke(camera, samples, meters), 4
    else:
        floor, size, multiple = np.array([*box.centre[:2], box.min[2]]), np.array(box.size), 1
    first_camera = camera.at(next(iter(samples.smoky), 0))

    def grids(quality: Quality) -> tuple[Domain, ...]:
        limit = LIMITS[quality]
        if isinstance(box, Domain):
            least, most = min(MIN_SIDE_VOXELS, max(box.resolution)), limit.voxels(_pixels_along(first_camera, box))
            allowed = proportional(box.resolution, least, most)
            allowed = allowed or proportional(box.resolution, least, max(box.resolution))[:1]
            return tuple(replace(box, resolution=each) for each in allowed)
        pixels = (
            max(size) / meters
            if box is None
            else _pixels_along(first_camera, _box_grids(floor, size, MIN_SIDE_VOXELS, 1)[0])
        )
        return _box_grids(floor, size, limit.voxels(pixels), multiple)

    qualities: Mapping[Quality, Grid]
    found: tuple[Finding, ...] = ()
    asked = box.resolution if isinstance(box, Domain) and settings.resolution is None else settings.resolution
    if isinstance(asked, tuple):
        voxel = float((size / asked).max())
        domain = replace(box, resolution=asked) if isinstance(box, Domain) else _domain_above(floor, voxel, asked)
        resolution = Finding("given", about="resolution", value=asked, source="given")
        qualities = dict.fromkeys(QUALITIES, Grid(asked, None))
    else:
        allowed = {quality: grids(quality) for quality in QUALITIES}
        detail = _smoke_detail(estimate, camera, allowed[settings.quality][-1])
        domain, resolution, qualities = choose_grid(allowed, detail, settings)
    if box is None:
        figures: Figures = {"size": domain.size, "resolution": domain.resolution}
        around = Finding("box around the smoke", figures, about="box", source="estimated")
        if not samples.smoky:
            around = replace(around, kind="box over the picture", source="assumed")
        found = replace(scale, figures={"height": meters * camera.size[1], **scale.figures}), around
    elif not np.allclose([domain.min, domain.max], [box.min, box.max], rtol=0, atol=1e-3 * domain.voxel_size):
        found = (Finding("grown box", {"size": domain.size}, about="box", source="given"),)
    return Geometry(camera, domain, qualities, (*found, resolution))


def _require_camera_and_box(scene: Scene, known: Camera | None) -> None:
    """Refuse a scene whose camera and box do not go together."""
    if scene.domain is not None and known is None:
        raise ValueError("The scene gives a box but no camera; give the camera that filmed it.")
    if scene.domain is None and scene.inlets:
        raise ValueError("The scene marks an inlet but gives no box; give camera and box to say where it is.")
    if scene.domain is None and known is not None and not _sees_ahead(known):
        raise ValueError(
            "The scene gives a camera but no box; give the one that holds the smoke. It is found only for "
            "a perspective camera that does not move or look steeply up or down."
        )


def fitting(camera: Camera, clip: Clip) -> Camera:
    """The camera with as many pixels as its clip; ValueError if its picture has another shape."""
    if camera.size[0] * clip.size[1] != camera.size[1] * clip.size[0]:
        raise ValueError(
            f"The camera's picture is {camera.size[0]} x {camera.size[1]}, the clip's {clip.size[0]} x {clip.size[1]} "
            f"({clip.path.name}); the camera's size must have the clip's shape."
        )
    return camera.resized(*clip.size)


def _level_camera(size: tuple[int, int], focal: float, meters: float) -> Camera:
    """A level camera along +Y; above the world's origin a pixel shows so many meters. ``focal`` is in pixels."""
    width, height = size
    up = meters * height / 2
    matrix = np.array([[1, 0, 0, 0], [0, 0, -1, -focal * meters], [0, 1, 0, up], [0, 0, 0, 1]], np.float64)
    return Camera("perspective", as_matrix(matrix), (width, height), focal, focal, width / 2, height / 2)


def _sees_ahead(camera: Camera) -> bool:
    """Whether a box can be put around the smoke: a still camera whose whole picture shows what is ahead."""
    if camera.type != "perspective" or camera.moves:
        return False
    _, along, up = view_frame(camera)
    width, height = camera.size
    ahead = _directions(camera, np.array([0, 0, width, width]), np.array([0, height, 0, height])) @ along
    return bool(up[2] == 1 and np.all(ahead > 0))


def _directions(camera: Camera, x: Doubles, y: Doubles) -> Doubles:
    """Directions (n, 3) in the world through some pixels; each is ``fy`` long along the camera's axis."""
    turn = np.array(camera.matrix, np.float64)[:3, :3]
    pixels = [(x - camera.cx) * camera.fy / camera.fx, camera.cy - y, np.full(x.shape, -camera.fy)]
    return np.asarray(np.stack(pixels, -1) @ turn.T)


def _box_around_smoke(camera: Camera, samples: SmokeSamples, meters: float) -> tuple[Doubles, Doubles]:
    """Middle of the floor (3,) and size (3,), in meters, of the upright box around smoke whose pixels show so many."""
    distance = camera.fy * meters
    lateral, along, _ = view_frame(camera)
    eye = np.array(camera.matrix, np.float64)[:3, 3]
    # a hundredth of the smoke's pixels at each side may be noise or the last wisps; without smoke any box will do
    rows, columns = np.nonzero(samples.covered if samples.covered.any() else ~samples.covered)
    (left, right), (top, bottom) = (
        (np.percentile(places, [1, 99]) + np.array([0, 1])) * samples.scale for places in (columns, rows)
    )
    margin = BOX_MARGIN * max(right - left, bottom - top)
    left, right = max(left - margin, 0), min(right + margin, camera.size[0])
    top, bottom = max(top - margin, 0), min(bottom + margin, camera.size[1])
    directions = _directions(camera, np.array([left, left, right, right]), np.array([top, bottom, top, bottom]))
    directions *= meters * (camera.fy / (directions @ along))[:, None]
    sideways, height = directions @ lateral, directions[:, 2]
    across = max(np.ptp(sideways), MIN_ASPECT * np.ptp(height))
    up = max(np.ptp(height), MIN_ASPECT * np.ptp(sideways))
    # the far side of the box has to fill the picture too
    across *= 1 + across / (2 * distance)
    base = eye + distance * along + (sideways.min() + sideways.max()) / 2 * lateral
    base[2] = eye[2] + height.min()
    return base, np.array([across, across, up])


def _box_grids(floor: Doubles, size: Doubles, allowed: int, multiple: int) -> tuple[Domain, ...]:
    """The box of a size (m) about the middle of its floor, with every allowed number of voxels, the fewest first.

    Each side has a multiple of ``multiple`` cubes. Where these do not fill the box, it grows upward and to all sides.
    """
    grids = []
    for longest in range(MIN_SIDE_VOXELS, max(allowed, MIN_SIDE_VOXELS) + 1, 4):
        voxel = float(size.max() / longest)
        x, y, z = (max(8, multiple * math.ceil(side / voxel / multiple - 1e-6)) for side in size)
        grids.append(_domain_above(floor, voxel, (x, y, z)))
    return tuple(grids)


def _domain_above(floor: Doubles, voxel: float, resolution: Shape) -> Domain:
    """The box of voxels with this edge (m) about the middle of its floor (3,)."""
    size = np.array(resolution) * voxel
    low = floor - size * (0.5, 0.5, 0)
    return Domain(low.tolist(), (low + size).tolist(), resolution)


def _smoke_detail(estimate: FirstEstimate, camera: Camera, box: Domain) -> DetailSpectrum | None:
    """The smoke's detail in the frames with the most of it, at the clip's own pixels; None without smoke."""
    smoky, frames = estimate.samples.smoky, []
    for number in smoky[:DETAIL_FRAMES]:
        if (working := working_picture(camera.at(number), box)) is not None:
            picture = working.part(estimate.clip.frame(number))
            frames.append((picture, estimate.plate.at(number).through(working.part)))
    return smoke_detail(frames, _pixels_along(camera.at(smoky[0]), box)) if smoky else None


def _pixels_along(camera: Camera, box: Domain) -> float:
    """Pixels of a still camera's picture along the longest side of a box."""
    return voxel_width(camera, box) * max(box.resolution)


def proportional(resolution: Shape, least: int, most: int) -> list[Shape]:
    """Return the resolutions of the same proportions, ``least`` to ``most`` voxels long, the coarsest first."""
    common = math.gcd(*resolution)
    x, y, z = (n // common for n in resolution)
    longest = max(x, y, z)
    return [(x * times, y * times, z * times) for times in range(-(-least // longest), most // longest + 1)]


def choose_grid(
    allowed: Mapping[Quality, Sequence[Domain]], spectrum: DetailSpectrum | None, settings: Settings
) -> tuple[Domain, Finding, Mapping[Quality, Grid]]:
    """Choose the coarsest of a quality's grids that loses no more of what the finest shows than tolerated.

    ``allowed`` are those of each quality, the coarsest first; ``spectrum`` is the smoke's detail in the finest of the
    settings' quality, None without smoke. Returned are the grid, why it is that one, and what each quality would take.
    """
    own = allowed[settings.quality]
    if spectrum is None:
        shape = own[0].resolution
        unseen = Finding("resolution without smoke", about="resolution", value=shape, source="assumed")
        return own[0], unseen, dict.fromkeys(QUALITIES, Grid(shape, None))

    def coarsest(grids: Sequence[Domain], tolerance: float) -> Domain:
        finest = max(grids[-1].resolution)
        return next((grid for grid in grids if spectrum.lost(max(grid.resolution), finest) <= tolerance), grids[-1])

    taken = {quality: coarsest(grids, LOST_DETAIL[quality]) for quality, grids in allowed.items()}
    domain = taken[settings.quality]
    longest = max(domain.resolution)
    figures: Figures = {
        "lost": spectrum.lost(longest),
        "lost_beside_finest": spectrum.lost(longest, max(own[-1].resolution)),
        "pixels": spectrum.pixels,
        "quality": settings.quality,
        "tolerance": LOST_DETAIL[settings.quality],
    }
    qualities = {name: Grid(grid.resolution, spectrum.lost(max(grid.resolution))) for name, grid in taken.items()}
    why = Finding("resolution", figures, about="resolution", value=domain.resolution, source="measured")
    return domain, why, qualities


def smoke_detail(frames: Iterable[tuple[Image, Plate]], pixels: float) -> DetailSpectrum:
    """Measure the smoke's detail in linear pictures (rows, columns, 3) of the box before their plates.

    ``pixels`` lie along the longest side of the box.
    """
    energy = np.zeros(RINGS)
    for picture, plate in frames:
        change = (linear_to_srgb(picture) - linear_to_srgb(plate.image)).mean(-1, dtype=np.float64)
        noise, clear = float(plate.noise.total.mean()), ~matte(picture, plate).mask
        # the channels' mean has less noise; the median stays with pixels that have no thin smoke below the mask
        if clear.any():
            noise = min(noise, NORMAL_MEDIAN * float(np.median(np.abs(change[clear]))))
        energy += _beyond_noise(change, noise)
    return DetailSpectrum(energy, pixels)


def _beyond_noise(change: Doubles, noise: float) -> Doubles:
    """Energy (RINGS,) of a picture, less that of white noise of a standard deviation."""
    # a cosine transform mirrors the picture at its edge, so smoke that is cut off there is no detail
    power = np.square(scipy.fft.dctn(change, norm="ortho"))
    rows, columns = (np.arange(n) / n for n in change.shape)
    # a frequency of 1 alternates from pixel to pixel
    frequency = np.hypot(rows[:, None], columns)
    inside = frequency < 1
    ring = (RINGS * frequency[inside]).astype(int)
    total = np.bincount(ring, power[inside], RINGS)
    count = np.bincount(ring, minlength=RINGS)
    return np.asarray(np.maximum(total - count * noise**2, 0))


@dataclass(frozen=True)
class WorkingPicture:
    """The part of a camera's picture that the domain covers, at the grid's resolution.

    ``camera`` is that of the working picture; the other attributes are its place in the full picture, in full pixels.
    """

    camera: Camera
    left: int
    top: int
    width: int
    height: int

    @property
    def pixels(self) -> float:
        """Number of full pixels that each small one is the mean of."""
        columns, rows = self.camera.size
        return self.width * self.height / (columns * rows)

    def resized(self, columns: int, rows: int) -> "WorkingPicture":
        """Return the same part at another number of pixels."""
        return replace(self, camera=self.camera.resized(columns, rows))

    def part(self, picture: NDArray[np.float32]) -> NDArray[np.float32]:
        """Return the part of a full picture (rows, columns, ...) at its own resolution."""
        return picture[self.top : self.top + self.height, self.left : self.left + self.width]

    def cut(self, picture: NDArray[np.float32]) -> NDArray[np.float32]:
        """Return the working picture of a full one (rows, columns, ...)."""
        columns, rows = self.camera.size
        return area_average(self.part(picture), columns, rows)

    def of(self, clip: Clip, number: int) -> Picture:
        """Return the working picture of a clip's frame."""
        return clip.stored(number).cut(self.part).averaged(*self.camera.size)


def working_picture(camera: Camera, domain: Domain) -> WorkingPicture | None:
    """Return the picture that a grid is fitted to; None if the camera sees no part of the domain.

    A pixel is as wide as a voxel at the domain's center, unless the footage is coarser: finer pixels hold detail that
    the grid cannot show, coarser ones lose detail that it can.
    """
    pixels, depth = project_points(camera, domain.corners())
    width, height = camera.size
    low, high = np.zeros(2), np.array([width, height], np.float64)
    if (depth > 0).all():
        low, high = np.maximum(pixels.min(0), low), np.minimum(pixels.max(0), high)
    if (depth <= 0).all() or (high - low < 1).any():
        return None
    left, top = (int(v) for v in np.floor(low))
    right, bottom = (int(v) for v in np.ceil(high))
    shrink = max(1.0, voxel_width(camera, domain))
    columns = max(1, round((right - left) / shrink))
    rows = max(1, round((bottom - top) / shrink))
    small = camera.cropped(left, top, right - left, bottom - top).resized(columns, rows)
    return WorkingPicture(small, left, top, right - left, bottom - top)
