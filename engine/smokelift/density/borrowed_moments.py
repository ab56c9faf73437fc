"""Detail in depth: what other sides of the smoke may look like, borrowed from other moments of the clip.

The smooth answer of `RoundDepth` is the mean of all smokes that show one picture. From the side it is a spindle without
detail. Turbulent smoke looks, in its statistics, the same from all sides, and after some frames it looks unlike itself.
So another moment's picture is one that this moment could show from the side.

From each of three sides the smooth answer's picture gets the detail of another moment (`borrowed_picture`). These are
soft observations of the density fit, which meets them as far as the camera's picture allows. Every row of theirs keeps
the amount, the middle and the width that the smooth answer has there. The idea is Okabe et al.'s (2015), who give the
sides the front's statistics.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

import smokelift._core as _core
from smokelift.density.borrowed_picture import borrowed_picture
from smokelift.density.depth_prior import DepthEstimate, ImposedView, RoundDepth
from smokelift.density.hull import inside, project_voxels
from smokelift.density.moments import Moments
from smokelift.density.multiplicative import fit_multiplicative
from smokelift.density.objective import camera_terms
from smokelift.density.observation import ObservedClip, View, ViewSet, eight_bit_plate
from smokelift.density.row_shape import Array
from smokelift.density.turntable import Turntable
from smokelift.footage.images import srgb_to_linear
from smokelift.footage.noise import EIGHT_BIT_STEP, lasting_noise, linear_per_srgb
from smokelift.render import Optics, Renderer, Sight, Volume
from smokelift.scene import Camera, Medium
from smokelift.scene.domain import box_around


@dataclass(frozen=True)
class BorrowedSide:
    """A side that a picture is borrowed for.

    Attributes
    ----------
    degrees
        From the camera's side, about the view's height.
    strength
        Weight of its picture's pixels, as the square root.
    apart
        Frames to the moment that is borrowed, in shares of `Moments.offset`: unlike one another, so that no two sides
        are copies.
    mirrored
        Whether the picture is.
    """

    degrees: float
    strength: float
    apart: float
    mirrored: bool = False


SIDES = (BorrowedSide(90, 1.0, 1.0), BorrowedSide(45, 0.35, 0.8), BorrowedSide(135, 0.35, 0.6))
"""The side says most about what the front cannot see. The two between keep the detail from being drawn out along the
rays of the first (docs/experiments/depth-detail.md)."""

NEAR = 22.5
"""Degrees from a camera within which nothing is borrowed: half the distance between sides."""

THIN = 0.5
"""Largest optical depth of a side's picture, so that every voxel on a ray counts alike."""

WHITE = np.ones(3, np.float32)
"""Radiance behind a side's picture."""

SHADOWGRAPH_NOISE = lasting_noise(srgb_to_linear(EIGHT_BIT_STEP) / linear_per_srgb(np.ones(3, np.float32)))
"""Of pictures of smoke before white that are as clean as those before black with eight bits, in linear light."""

AROUND = 0.05
"""Share of the smooth answer that is spread around it: the borrowed outlines need something to work on."""

SPREAD = 3.0
"""Standard deviation (voxels) of that spread."""

REACH = 12
"""Voxels that it reaches: four standard deviations."""

ENDS = 3.0
"""Rows at the top and the bottom over which the sides' weight fades in: voxels there hold what the domain cuts off."""

SMOOTH_ITERATIONS = 4
"""Multiplicative iterations for the smooth answer; its rows' amounts are what the borrowed pictures take over."""

SMOOTH_TOLERANCE = 0.02
"""Share of the objective that one of them has to gain for another to follow, as in the fit."""


@dataclass(frozen=True, eq=False)
class BorrowedMoments:
    """Round smoke with detail; see the module.

    Attributes
    ----------
    smooth
        The prior of the smooth answer.
    detail
        Strength, from 0 (the smooth answer) to 1.
    seed
        Of another plausible smoke of the same clip.
    moments
        Of the clip; None borrows nothing.
    """

    smooth: RoundDepth
    detail: float = 1.0
    seed: int = 0
    moments: Moments | None = None

    def of_clip(self, clip: ObservedClip) -> BorrowedMoments:
        """Look at all frames of a clip, unless there is no detail to borrow."""
        moments = Moments.of(clip) if self.detail > 0 else None
        return replace(self, smooth=self.smooth.of_clip(clip), moments=moments)

    def estimate(self, views: ViewSet) -> DepthEstimate:
        """The smooth answer, and pictures from the sides."""
        estimate = self.smooth.estimate(views)
        if self.moments is None or not views.hull.any():
            return estimate
        hull = views.hull
        start = inside(hull, estimate.density)
        smooth = fit_multiplicative(
            camera_terms(views, estimate.inside), start, SMOOTH_ITERATIONS, SMOOTH_TOLERANCE
        ).density
        imposed = tuple(self._sides(self.moments, smooth, views))
        if not imposed:
            return estimate
        around = AROUND * min(1.0, 2 * self.detail)
        box = box_around(hull, REACH)
        spread = (1 - around) * smooth[box] + around * _core.blur(smooth[box], SPREAD, REACH / SPREAD)
        density = np.zeros(hull.shape, np.float32)
        np.copyto(density[box], spread, where=hull[box])
        return replace(estimate, density=density, imposed=imposed, smooth=smooth)

    def _sides(self, moments: Moments, smooth: Volume, views: ViewSet) -> Iterator[ImposedView]:
        """Borrowed pictures of the sides that no camera is near to."""
        for side in unseen_sides(moments.turntable, [view.camera for view in views.views], self.seed):
            camera = moments.turntable.camera(side.degrees)
            renderer = _absorbing(views.optics).renderer(camera, WHITE, views.hull)
            seen, sight = _optical_depth(smooth, renderer), renderer.sight
            del renderer  # its voxels take much of the memory
            lent = moments.apart(views.frame, round(side.apart * moments.offset))
            picture = borrowed_picture(
                seen, [(share, moment[:, ::-1] if side.mirrored else moment) for share, moment in lent]
            )
            if picture is not None:
                yield _shadowgraph(picture, camera, side.strength * self.detail, views.optics, sight)


def varied_sides(seed: int) -> list[BorrowedSide]:
    """Return the sides of another plausible smoke: turned, borrowed from moments less far away, and mirrored.

    Multiples of irrational numbers are spread evenly, so that the smokes of neighbouring seeds are never alike.
    """
    turn = NEAR * (np.sqrt(5) * seed % 1 - 0.5 * (seed > 0))
    nearer = 1 - 0.3 * (np.sqrt(2) * seed % 1)
    return [
        replace(side, degrees=side.degrees + turn, apart=side.apart * nearer, mirrored=bool(seed >> number & 1))
        for number, side in enumerate(SIDES)
    ]


def unseen_sides(turntable: Turntable, cameras: Sequence[Camera], seed: int) -> list[BorrowedSide]:
    """Return the sides that no camera is near to."""
    seen_from = [turntable.degrees(camera) for camera in cameras]
    return [side for side in varied_sides(seed) if all(_apart(side.degrees, other) >= NEAR for other in seen_from)]


def _apart(a: float, b: float) -> float:
    """Degrees between two directions; what is seen from the back is what is seen from the front."""
    return abs((a - b + 90) % 180 - 90)


def _optical_depth(density: Volume, renderer: Renderer) -> Array:
    """Optical depth (rows, columns) of a density as a renderer's camera sees it."""
    renderer.image(density)
    clear = np.maximum(renderer.transmittance, np.finfo(np.float32).tiny)
    return np.asarray(-np.log(clear), np.float64)


def _shadowgraph(
    optical_depth: Array, camera: Camera, strength: float, optics: Optics, sight: Sight | None
) -> ImposedView:
    """A picture of smoke that takes light away and scatters none: it says how much of it each ray meets."""
    thin = THIN / optical_depth.max()
    depth = (thin * optical_depth).astype(np.float32)
    everywhere = np.ones(depth.shape, np.bool_)
    view = View(
        camera=camera,
        image=np.exp(-depth)[..., None] * WHITE,
        plate=replace(eight_bit_plate(WHITE, camera.size), noise=SHADOWGRAPH_NOISE),
        mask=everywhere,
        optical_depth=depth,
        projection=project_voxels(camera, optics.domain),
        counted=everywhere,
    )
    rows = np.arange(len(depth)) + 0.5
    fade = np.clip(np.minimum(rows, rows[::-1]) / ENDS, 0, 1)
    weight = np.broadcast_to((strength * fade[:, None]) ** 2, depth.shape).astype(np.float32)
    return ImposedView(view, weight, _absorbing(optics, thin), sight)


def _absorbing(optics: Optics, share: float = 1.0) -> Optics:
    """The optics of smoke that only absorbs, with a share of its extinction."""
    return replace(
        optics, medium=Medium(extinction=share * optics.medium.extinction), lights=(), scattering="absorption"
    )
