"""Depth from one view: a flat-topped profile, as deep as the smoke is wide across its own axis.

One picture says how much smoke lies along a ray, not where. The profile

    rho(x, y, z) = m(x, z) g(y),   g(y) = exp(-(|y - y0| / A)^q)

keeps the picture m as it is and spreads it about the smoke's axis y0. Where g is below `PROFILE_CUT` no smoke is
expected, and g - `PROFILE_CUT` is spread: smoke that is cut off shows a shell. For such a distribution of standard
deviation sigma, A = sigma sqrt(Gamma(1/q) / Gamma(3/q)). sigma is the geometric mean of two widths that the picture
shows. One is the least spread of the smoke along any line through the pixel: across a column or a jet wherever it
goes, upright, lying or bent, and through a ball as long as the ray's way in it. The other is the width of balls that
fill the silhouette (inflated outlines: Igarashi, Matsuoka and Tanaka 1999). In true smoke dark rays are longer than
thin ones, by which a smooth density gains nothing (docs/experiments/density-profile.md).

What stands nearer to the camera than the axis shows beyond the domain's ends there. The domain holds all smoke that a
density can have, so a ray's middle is moved into it, and its profile is narrower by as much: it reaches no farther from
the axis than other smoke (docs/experiments/density-profile.md).
"""

import numpy as np
from scipy import ndimage
from scipy.special import gamma, gammainc

import smokelift._core as _core
from smokelift.checks import Array, Doubles, Mask
from smokelift.density.hull import Places
from smokelift.density.lattice_noise import Scatter
from smokelift.density.objective import FAINT
from smokelift.density.upright_plane import (
    TINY_DOUBLE,
    PlanePicture,
    PlaneRays,
    SmokeAxis,
    on_upright_plane,
    view_frame,
)
from smokelift.scene import Camera, Domain

FLATNESS = 3.5
"""q: between a Gaussian (2) and a box. 3 to 4 were equally good over four scenes
(docs/experiments/density-profile.md)."""

SCALE = float(np.sqrt(gamma(1 / FLATNESS) / gamma(3 / FLATNESS)))
"""A in standard deviations (by definition)."""

PROFILE_CUT = 0.0056
"""Fraction of the profile's peak from which smoke is expected. The profile is 1.6 times as wide there as assumed, which
is how far its width may be wrong: at 1.4 lobes end in flat walls, seen from the side
(docs/experiments/density-profile.md)."""

ROOM = 0.3
"""Smallest distance, in A, of a ray's middle from the ends of its way through the domain, and smallest fraction of A
that is left of the profile there (docs/experiments/density-profile.md)."""

SILHOUETTE = 0.05
"""Fraction of the smoke's usual optical depth from which a pixel belongs to the silhouette
(docs/experiments/density-profile.md)."""

THINNEST = 0.7
"""Half the thickness of a silhouette's thinnest parts, in pixels (docs/experiments/density-profile.md)."""

LASTING_DISTANCE = 0.5
"""Fraction of the distance between columns behind one another that lasts on the way up, as they draw together
(docs/experiments/density-axis.md)."""

DIRECTIONS = 8
"""Directions of lines over half a turn: across a jet that lies between two of them its spread is 2 % too large."""

MIN_SPREAD_BIAS = 1.2
"""Width across the smoke over the least of the spreads, which is smaller by chance
(docs/experiments/density-profile.md)."""

LINE_SMOOTHING = 2.0
"""Standard deviation (voxels) of the Gaussian that smooths the spread from line to line."""

STEPS_TO_AXIS = 3
"""Fixed-point steps from a ray's place in the middle of the domain to where it meets the axis. A step leaves of the
distance the lean of the axis times that of the ray, mostly under a tenth."""

SMOOTHING = 1.5
"""Standard deviation (pixels) of the Gaussian that smooths the thickness (docs/experiments/density-profile.md)."""


def smallest_spread(optical_depth: Array, camera: Camera, domain: Domain) -> PlanePicture:
    """Standard deviation (m), on the upright plane, of the smoke along the line through each point where it is least.

    ``optical_depth`` (rows, columns) may be in any unit.
    """
    plane = on_upright_plane(optical_depth, camera, domain, 1)
    turns = np.pi / DIRECTIONS * np.arange(DIRECTIONS)
    least = np.min([_spread_along(plane, turn, domain.voxel_size) for turn in turns], axis=0)
    return PlanePicture(plane.heights, plane.laterals, least)


def _spread_along(plane: PlanePicture, turn: float, voxel_size: float) -> Doubles:
    """The smoke's standard deviation (n, m) along the line through each point that rises at an angle (radians).

    Lines without smoke take the spread from beside them.
    """
    heights = plane.heights[:, None]
    along = np.cos(turn) * plane.laterals + np.sin(turn) * heights
    across = np.cos(turn) * heights - np.sin(turn) * plane.laterals
    line = np.rint((across - across.min()) / voxel_size).astype(np.intp)
    total, first, second = (np.bincount(line.ravel(), (plane.values * along**power).ravel()) for power in range(3))
    # normalized convolution: lines count by the smoke that they hold
    most = total.max(initial=0.0)
    squares = np.maximum(second - first**2 / np.maximum(total, TINY_DOUBLE), 0)
    weight = ndimage.gaussian_filter1d(total, LINE_SMOOTHING) + 1e-6 * max(most, 1e-30)
    variance = ndimage.gaussian_filter1d(squares, LINE_SMOOTHING) / weight
    known = np.flatnonzero(total > FAINT * most)
    if known.size:
        variance = np.interp(np.arange(len(variance)), known, variance[known])
    return np.asarray(np.sqrt(np.maximum(variance, voxel_size**2))[line])


def inflated(mask: Mask) -> Doubles:
    """Half the thickness (pixels), seen from the front, of the balls that fill a silhouette (rows, columns).

    About every pixel inside stands the largest ball that stays inside the outline. A pixel shows the ball that is
    thickest there.
    """
    half = np.where(mask, THINNEST, 0.0)
    # smoke goes on beyond the picture's edge, unless it is everywhere
    inside = ndimage.distance_transform_edt(np.pad(mask, 1, mode="constant" if mask.all() else "edge"))[1:-1, 1:-1]
    for part in ndimage.find_objects(mask.astype(np.uint8)):  # the box around it, as no ball reaches out of the outline
        radius, balls = 1.5, half[part]
        while (centers := inside[part] >= radius).any():
            distance = ndimage.distance_transform_edt(~centers)
            np.maximum(balls, np.sqrt(np.maximum(radius**2 - distance**2, 0)), out=balls)
            radius *= 1.1
    return half


def ball_spread(optical_depth: Array, camera: Camera, domain: Domain) -> Array:
    """Standard deviation (m) along the depth of the balls that fill the silhouette, at each pixel (rows, columns)."""
    smoky = optical_depth > 0
    mask = optical_depth > SILHOUETTE * (np.percentile(optical_depth[smoky], 90) if smoky.any() else 1.0)
    weight = optical_depth + FAINT * optical_depth.max(initial=1e-30)
    total = ndimage.gaussian_filter(weight * mask, SMOOTHING) + 1e-30
    half = ndimage.gaussian_filter(weight * inflated(mask), SMOOTHING) / total
    return np.asarray(_pixel_size(camera, domain) * half / np.sqrt(3), np.float32)


def _pixel_size(camera: Camera, domain: Domain) -> float:
    """Width (m) of a pixel at the domain's center."""
    if camera.type == "orthographic":
        return 1 / camera.fx
    matrix = np.array(camera.matrix, np.float64)
    distance = (matrix[:3, 3] - np.array(domain.centre)) @ matrix[:3, 2]
    return float(max(distance, domain.voxel_size) / camera.fx)


class DepthProfile:
    """The profile that a picture suggests.

    ``optical_depth`` (rows, columns) may be in any unit. The rays' middles stand on the axis, or scatter about it. With
    scatter the profile is narrower, so that the smoke is as deep as without.
    """

    def __init__(
        self, optical_depth: Array, camera: Camera, domain: Domain, axis: SmokeAxis, scatter: Scatter | None = None
    ) -> None:
        self._domain, self._depth = domain, view_frame(camera)[1]
        self._rays = rays = PlaneRays.of(camera, domain)
        middle = np.zeros(optical_depth.shape)
        for _ in range(STEPS_TO_AXIS):
            middle = axis.at(*rays.at(middle))
        at = rays.at(middle)
        if axis.several:
            across = axis.read(axis.widths, *at)
        else:
            across = MIN_SPREAD_BIAS * smallest_spread(optical_depth, camera, domain).read(*at)
        behind = LASTING_DISTANCE * axis.read(axis.spreads, *at)
        spread = np.sqrt(across * ball_spread(optical_depth, camera, domain) + behind**2)
        deviation = np.maximum(spread, domain.voxel_size)  # in depth
        narrowing, offset = 1.0, np.zeros(optical_depth.shape)
        if scatter is not None:
            # a lobe moves as one, so what is as deep as its surroundings on the mean tells how far
            blur = scatter.width / _pixel_size(camera, domain)
            weight = optical_depth + 1e-6 * optical_depth.max(initial=1e-30)
            deep = ndimage.gaussian_filter(weight * deviation, blur) / ndimage.gaussian_filter(weight, blur)
            narrowing, offset = float(np.sqrt(1 - scatter.deviation**2)), deep * scatter.offset
        width, middle = narrowing * SCALE * deviation, middle + offset
        room = np.minimum(ROOM * width, (rays.far - rays.near) / 2)
        self._middle = np.where(rays.missed, middle, np.clip(middle, rays.near + room, rays.far - room))
        self._width = np.maximum(width - np.abs(self._middle - middle), ROOM * width)

    def at(self, places: Places, voxels: Mask) -> Array:
        """What is spread (1/m), of unit integral along the depth, at the marked voxels (n,), seen at `places`."""
        profile, width = self._shape_and_width(places, voxels)
        steep = np.log(1 / PROFILE_CUT)
        area = gamma(1 + 1 / FLATNESS) * gammainc(1 / FLATNESS, steep) - PROFILE_CUT * steep ** (1 / FLATNESS)
        return np.asarray(np.maximum(profile - np.float32(PROFILE_CUT), 0) / (np.float32(2 * area) * width))

    def shape(self, places: Places, voxels: Mask) -> Array:
        """The profile g at the marked voxels (n,), 1 in the middle."""
        return self._shape_and_width(places, voxels)[0]

    def fraction_inside(self) -> Array:
        """Fraction (rows, columns) of the profile that each pixel's ray meets inside the domain."""
        ends = [(end - self._middle) / self._width for end in (self._rays.near, self._rays.far)]
        low, high = (np.sign(end) * gammainc(1 / FLATNESS, np.abs(end) ** FLATNESS) for end in ends)
        return np.where(self._rays.missed, 0, (high - low) / 2).astype(np.float32)

    def _shape_and_width(self, places: Places, voxels: Mask) -> tuple[Array, Array]:
        """The profile g and its A (m) at the marked voxels (n,); compiled, as a large grid has millions."""
        return _core.depth_profile(
            voxels,
            [axis.ravel() for axis in self._domain.offsets(self._domain.centre)],
            self._depth,
            at=[places.rows, places.columns],
            middle=self._middle,
            width=self._width,
            flatness=FLATNESS,
        )
