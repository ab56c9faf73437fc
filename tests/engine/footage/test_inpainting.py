"""What is unknown is continued from what is known around it."""

import numpy as np
import pytest
from scipy import ndimage

from smokelift.footage.images import continuation_errors, in_one_piece, mostly_beside, push_pull

HEIGHT, WIDTH = 40, 60
COLOR = np.array([0.3, 0.2, 0.1], np.float32)


def hole() -> np.ndarray:
    """Return what is known: all but a block."""
    known = np.ones((HEIGHT, WIDTH), np.bool_)
    known[12:28, 20:40] = False
    return known


def test_what_is_known_stays_and_the_rest_is_between_it() -> None:
    """A slope goes on."""
    known = hole()
    for image in (np.random.default_rng(1).uniform(0.2, 0.8, (HEIGHT, WIDTH, 3)), np.linspace(0, 1, WIDTH)[:, None]):
        whole = np.broadcast_to(image, (HEIGHT, WIDTH, 3)).astype(np.float32)
        spoilt = np.where(known[..., None], whole, 100).astype(np.float32)
        continued = push_pull(spoilt, known.astype(np.float32))
        assert (continued[known] == whole[known]).all()
        assert whole.min() <= continued.min() <= continued.max() <= whole.max()
    assert np.abs(continued - whole)[~known].mean() < 0.02
    assert (np.diff(continued[20, 20:40, 0]) > -0.02).all()


def test_what_most_of_a_square_shows_is_its_median() -> None:
    known = ndimage.gaussian_filter(np.random.default_rng(0).random((40, 60)), 2) > 0.5
    smooth = ndimage.median_filter(known.astype(np.uint8), 7) > 0
    islands, count = ndimage.label(smooth)
    large = [n for n in range(1, count + 1) if (islands == n).mean() > 0.01]
    assert np.array_equal(in_one_piece(known), np.isin(islands, large))


def bricks(deviation: float) -> np.ndarray:
    """A wall of one color, whose bricks of 16 x 16 pixels are brighter and darker."""
    light = 1 + deviation * np.random.default_rng(4).standard_normal((8, 14, 1))
    return (np.kron(light, np.ones((16, 16, 1))) * COLOR).astype(np.float32)


def column(width: int, shape: tuple[int, ...]) -> np.ndarray:
    """All but a column in the middle is known."""
    known = np.ones(shape[:2], np.bool_)
    known[:, (shape[1] - width) // 2 : (shape[1] + width) // 2] = False
    return known


def test_errors_are_along_the_walls_color_and_as_large_as_behind_the_smoke() -> None:
    wall = bricks(0.15)
    known = column(32, wall.shape)
    variances, axes = np.linalg.eigh(continuation_errors(wall, known))
    assert abs(axes[:, 2] @ COLOR) > 0.999 * np.linalg.norm(COLOR)
    assert np.sqrt(variances[2]) == pytest.approx(0.15 * np.linalg.norm(COLOR), rel=0.5)
    assert variances[1] < 1e-3 * variances[2]
    # what is hidden has no part in it
    wall[~known] = 0.9
    np.testing.assert_array_equal(continuation_errors(wall, known), continuation_errors(wall * known[..., None], known))


def test_a_patch_counts_if_it_borders_on_more_that_is_known() -> None:
    known = hole()
    grown = known.copy()
    grown[12:15, 20:40] = True  # along the upper rim
    grown[20:23, 28:31] = True  # amid the unknown
    kept = mostly_beside(grown, known)
    assert kept[12:15, 20:40].all()
    assert not kept[20:23, 28:31].any()
    assert kept[known].all()
