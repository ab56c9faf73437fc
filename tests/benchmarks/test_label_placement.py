"""Labels of a chart lie beside their points, and none over another."""

import numpy as np

from benchmarks.accuracy.label_placement import place_labels

BOUNDS = np.array([0.0, 0.0, 600.0, 400.0])
NOTHING = np.zeros((0, 4))


def boxes(points, sizes, obstacles=NOTHING):
    corners = place_labels(points, sizes, obstacles, BOUNDS)
    return np.concatenate([corners, corners + sizes], -1)


def over(a, b) -> bool:
    return bool((np.minimum(a[2:], b[2:]) > np.maximum(a[:2], b[:2])).all())


def test_labels_of_points_in_one_place_lie_apart() -> None:
    points = np.full((12, 2), (300.0, 200.0)) + np.arange(12)[:, None]
    found = boxes(points, np.full((12, 2), (60.0, 12.0)))
    assert not any(over(found[a], found[b]) for a in range(12) for b in range(a))


def test_a_label_stays_near_its_point_and_within_the_bounds() -> None:
    points = np.array([[300.0, 200.0], [599.0, 399.0], [1.0, 1.0]])
    sizes = np.full((3, 2), (80.0, 12.0))
    found = boxes(points, sizes)
    assert (found[:, :2] >= BOUNDS[:2]).all()
    assert (found[:, 2:] <= BOUNDS[2:]).all()
    beside = np.maximum(np.maximum(found[:, :2] - points, points - found[:, 2:]), 0)
    assert np.linalg.norm(beside, axis=1).max() < 11


def test_a_label_avoids_what_it_would_hide() -> None:
    point, size = np.array([[300.0, 200.0]]), np.array([[60.0, 12.0]])
    free = boxes(point, size)[0]
    assert not over(boxes(point, size, free[None])[0], free)
