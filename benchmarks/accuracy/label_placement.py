"""Where labels go beside the points of a chart, so that none lies over another."""

from __future__ import annotations

import numpy as np

from smokelift.checks.array_types import Doubles

DIRECTIONS = 16
"""Around a point, in which its label is tried."""

GAPS = (10.0, 16.0, 26.0, 40.0, 60.0, 90.0, 130.0)
"""Distances (pixels) between a point and the edge of its label that are tried."""

SWEEPS = 20
"""Over all labels, at most. Two or three move some; after them none gains by moving alone."""

OVER_LABEL, OVER_OBSTACLE, OUTSIDE = 1e3, 1.0, 1e6
"""What a square pixel over another label or an obstacle, and a label beyond the bounds, cost; a pixel's distance from
the point costs 1."""


def place_labels(points: Doubles, sizes: Doubles, obstacles: Doubles, bounds: Doubles) -> Doubles:
    """Return the lower left corners of labels, near their points and apart from each other.

    Each label tries places around its point and takes the cheapest, given the others', until none moves: coordinate
    descent on the cost of J. Christensen, J. Marks and S. Shieber, "An empirical study of algorithms for point-feature
    label placement", ACM Transactions on Graphics 14, 1995.

    Parameters
    ----------
    points : (labels, 2)
        What they belong to (pixels).
    sizes : (labels, 2)
        Their widths and heights (pixels).
    obstacles : (obstacles, 4)
        Boxes that they had better not hide: left, bottom, right, top.
    bounds : (4,)
        The box that they stay in.
    """
    angles = 2 * np.pi * np.arange(DIRECTIONS) / DIRECTIONS
    ring = np.stack([np.cos(angles), np.sin(angles)], -1)
    gaps = np.repeat(GAPS, DIRECTIONS)
    steps = np.tile(ring, (len(GAPS), 1))
    # the side or the corner that faces the point is as far away as the gap says
    facing = np.clip(np.sqrt(2) * steps, -1, 1)
    corners = points[:, None] + steps * gaps[:, None] + (facing - 1) * sizes[:, None] / 2
    boxes = np.concatenate([corners, corners + sizes[:, None]], -1)
    beyond = ((boxes[..., :2] < bounds[:2]) | (boxes[..., 2:] > bounds[2:])).any(-1)
    alone = gaps + OUTSIDE * beyond + OVER_OBSTACLE * _common(boxes, obstacles).sum(-1)
    chosen = np.zeros((0, 4))
    for label in range(len(points)):
        cost = alone[label] + OVER_LABEL * _common(boxes[label], chosen).sum(-1)
        chosen = np.vstack([chosen, boxes[label, np.argmin(cost)]])
    for _ in range(SWEEPS):
        before = chosen.copy()
        for label in range(len(points)):
            others = np.delete(chosen, label, axis=0)
            cost = alone[label] + OVER_LABEL * _common(boxes[label], others).sum(-1)
            chosen[label] = boxes[label, np.argmin(cost)]
        if np.array_equal(before, chosen):
            break
    return np.asarray(chosen[:, :2])


def _common(boxes: Doubles, others: Doubles) -> Doubles:
    """Areas (..., others) that boxes (..., 4) share with others (others, 4)."""
    low = np.maximum(boxes[..., None, :2], others[:, :2])
    high = np.minimum(boxes[..., None, 2:], others[:, 2:])
    return np.asarray(np.prod(np.maximum(high - low, 0), axis=-1))
