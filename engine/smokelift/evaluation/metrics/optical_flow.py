"""Optical flow of pictures of smoke, and what it says about how smoke moves where it is seen."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from scipy import ndimage

from smokelift.evaluation.metrics.checks import Array, pair, relative
from smokelift.evaluation.metrics.detail import fine_detail, smoke_pixels

WINDOW = 4.0
"""Standard deviation (pixels) of the window in which the flow is one vector: as wide as the finest detail."""

COARSEST = 12
"""Pixels along the shorter side below which no coarser level of the pyramid helps."""

LINEARISATIONS = 3
"""At each level of the pyramid."""

DAMPING = 0.01
"""Added to the squared gradients, as a share of their mean: where nothing changes in space, nothing moves."""


@dataclass(frozen=True)
class PictureMotion:
    """How the smoke of two consecutive pictures moves.

    Attributes
    ----------
    speed
        Mean length of the flow over the smoke (pixels a frame).
    divergence
        Root mean square of the flow's divergence over the smoke (1/frame): smoke that pops up and dissolves instead of
        flowing raises it.
    warp_error
        Fine detail that the flow does not carry over, relative to all fine detail of the later picture: 0 for a picture
        that is only carried along, about 1 for detail that is new in every frame.
    """

    speed: float
    divergence: float
    warp_error: float


def optical_flow(before: npt.ArrayLike, after: npt.ArrayLike) -> Array:
    """Return how far each point of a picture has moved since the picture before.

    Lucas and Kanade's method (IJCAI 1981) with a Gaussian window, coarse to fine (Bouguet, "Pyramidal implementation of
    the Lucas Kanade feature tracker", Intel 2000).

    Parameters
    ----------
    before, after
        Shape (rows, columns).

    Returns
    -------
    Pixels along rows and columns at the points of arrival, shape (rows, columns, 2):
    ``before(x - flow(x)) = after(x)``.

    Raises
    ------
    ValueError
        If the shapes differ or a value is not finite.
    """
    first, second = pair(before, after)
    pyramid = [(first, second)]
    while min(pyramid[-1][0].shape) >= 2 * COARSEST:
        finer = pyramid[-1]
        pyramid.append((_halved(finer[0]), _halved(finer[1])))
    flow = np.zeros((2, *pyramid[-1][0].shape))
    for start, end in reversed(pyramid):
        if flow.shape[1:] != start.shape:
            flow = 2 * _enlarged(flow, start.shape)
        flow = _refined(flow, start, end)
    return np.moveaxis(flow, 0, -1)


def carried(picture: npt.ArrayLike, flow: npt.ArrayLike) -> Array:
    """Return a picture (rows, columns) carried along a flow (rows, columns, 2), interpolated linearly."""
    values, way = np.asarray(picture, np.float64), np.asarray(flow, np.float64)
    origins = np.indices(values.shape) - np.moveaxis(way, -1, 0)
    return np.asarray(ndimage.map_coordinates(values, origins, order=1, mode="nearest"))


def picture_motion(before: npt.ArrayLike, after: npt.ArrayLike) -> PictureMotion | None:
    """Return how smoke moves between two pictures; None where the later one shows none.

    Parameters
    ----------
    before, after
        Shape (rows, columns): the smoke alone, as its difference from the background.

    Raises
    ------
    ValueError
        If the shapes differ or a value is not finite.
    """
    first, second = pair(before, after)
    smoke = smoke_pixels(second)
    if not smoke.any():
        return None
    flow = optical_flow(first, second)
    divergence = np.gradient(flow[..., 0], axis=0) + np.gradient(flow[..., 1], axis=1)
    missed, detail = fine_detail(second - carried(first, flow)), fine_detail(second)
    return PictureMotion(
        speed=float(np.linalg.norm(flow, axis=-1)[smoke].mean()),
        divergence=float(np.sqrt(np.mean(divergence[smoke] ** 2))),
        warp_error=relative(float(np.linalg.norm(missed[smoke])), float(np.linalg.norm(detail[smoke]))),
    )


def _refined(flow: Array, start: Array, end: Array) -> Array:
    """A flow, shape (2, rows, columns), that carries one picture into another better, in least squares."""
    down, right = np.gradient(end)
    dd, rr, dr = _window(down**2), _window(right**2), _window(down * right)
    damping = DAMPING * float(np.mean(dd + rr))
    if damping == 0.0:
        return flow
    dd, rr = dd + damping, rr + damping
    determinant = dd * rr - dr**2
    for _ in range(LINEARISATIONS):
        change = carried(start, np.moveaxis(flow, 0, -1)) - end
        dc, rc = _window(down * change), _window(right * change)
        flow = flow + np.stack([rr * dc - dr * rc, dd * rc - dr * dc]) / determinant
    return flow


def _window(values: Array) -> Array:
    return np.asarray(ndimage.gaussian_filter(values, WINDOW, truncate=2.5))


def _halved(picture: Array) -> Array:
    return np.asarray(ndimage.gaussian_filter(picture, 1.0)[::2, ::2])


def _enlarged(flow: Array, shape: tuple[int, ...]) -> Array:
    """Both parts of a flow at twice the resolution, whose pixel 2n is the coarse one's n."""
    places = np.indices(shape) / 2
    return np.stack([ndimage.map_coordinates(part, places, order=1, mode="nearest") for part in flow])
