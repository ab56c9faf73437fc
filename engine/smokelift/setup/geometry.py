"""Camera, box and resolution: as the scene gives them, or estimated from where the smoke is in the picture."""

import math
from collections.abc import Mapping
from contextlib import suppress
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from smokelift.checks import Doubles, Figures, Finding
from smokelift.density.upright_plane import view_frame
from smokelift.footage.clip import Clip
from smokelift.scene import Camera, Domain, Scene, as_matrix
from smokelift.scene.camera import voxel_width
from smokelift.setup.first_estimate import FirstEstimate, SmokeSamples
from smokelift.setup.resolution import DetailSpectrum, Grid, Shape, choose_grid, proportional, smoke_detail
from smokelift.setup.settings import LIMITS, QUALITIES, Quality, Settings
from smokelift.setup.working_picture import CameraError, working_picture

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
    still = camera.at(next(iter(samples.smoky), 0))

    def grids(quality: Quality) -> tuple[Domain, ...]:
        limit = LIMITS[quality]
        if isinstance(box, Domain):
            least, most = min(MIN_SIDE_VOXELS, max(box.resolution)), limit.voxels(_pixels_along(still, box))
            allowed = proportional(box.resolution, least, most)
            allowed = allowed or proportional(box.resolution, least, max(box.resolution))[:1]
            return tuple(replace(box, resolution=each) for each in allowed)
        pixels = (
            max(size) / meters if box is None else _pixels_along(still, _box_grids(floor, size, MIN_SIDE_VOXELS, 1)[0])
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
        with suppress(CameraError):
            part = working_picture(camera.at(number), box).part
            frames.append((part(estimate.clip.frame(number)), estimate.plate.at(number).through(part)))
    return smoke_detail(frames, _pixels_along(camera.at(smoky[0]), box)) if smoky else None


def _pixels_along(camera: Camera, box: Domain) -> float:
    """Pixels of a still camera's picture along the longest side of a box."""
    return voxel_width(camera, box) * max(box.resolution)
