"""Exposure that flickers in front of black, where nothing but the smoke shows it.

Exposure changes all smoke in a picture by one factor. Smoke itself changes more here and less there; it grows and
fades over some frames, and the second differences of all its light are some thousandths. So a clip flickers where this
light bends to and fro from frame to frame and the parts of the picture agree on it. Its logarithm is the sum of a
smooth course, whose second differences are independent, and of the exposure, which is independent from frame to frame;
their variances are those of the greatest likelihood (Whittaker's graduation as a mixed model: Green and Silverman,
"Nonparametric regression and generalized linear models", 1994). Exposure that changes slowly looks like smoke that
does, and stays. Figures: docs/experiments/flicker.md.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy import sparse
from scipy.linalg import cho_solve_banded, cholesky_banded

from smokelift.footage.clip import Clip
from smokelift.footage.evidence import GLIMPSE
from smokelift.footage.exposure import USABLE, shows_exposure, small
from smokelift.footage.images import Picture
from smokelift.footage.plate import Plates

FEWEST = 6
"""Frames at least: of five in a row of real smoke, one in a hundred bends to and fro by as much as exposure does."""

STRETCH = 24
"""Frames around the one with the most smoke that say whether a clip flickers."""

BLOCKS = 8
"""Blocks along each side of a picture whose light is compared."""

FAINTEST = 0.005
"""Share of a picture's light in a block that tells something."""

FEWEST_BLOCKS = 6
"""Blocks that have to tell something."""

BENDING = 0.03
"""Second difference of the logarithm of the light, median over frames, from which on a clip flickers. Exposure that
goes up and down by 1 % has 0.04, clips of smoke seldom more than 0.03."""

AGREEING = 4.5
"""The same, of blocks, over the median of their distances from their median, at least. Smoke and flames have at most
2.5, exposure that differs by up to 5 % from frame to frame 8."""

TURNING = 0.5
"""Share of frames at least from each of which to the next that second difference changes its sign: 0.73 where each
frame has an exposure of its own."""

STILL = 0.01
"""Change of the logarithm of the light up to which a frame counts as bright as the one before. Of frames that are shown
twice every second one is, and smoke that grows bends at each of them."""

MOST_STILL = 0.25
"""Share of such frames at most: 0.2 where the exposure differs by up to 5 % from frame to frame."""

LEAST = 0.03
"""Largest gain of a clip at least: less costs a velocity nothing."""

BURST = 3.0
"""Ratio of the light of a frame to that of the next from which on smoke itself appears or is gone."""

FAINT = 0.05
"""Light of a frame beside the most of any from which on it tells something."""

WEIGHTS = 10.0 ** np.arange(-1, 2.01, 0.25)
"""Variances of the exposure over those of the course's second differences that are tried. With larger ones changes
that take longer than 20 frames would be the exposure's."""

Array = NDArray[np.float64]


def flicker_gains(clip: Clip, plates: Plates, smoky: int) -> Array | None:
    """Return by how much each frame (frames,) is exposed more than those around it; None where that does not flicker.

    Parameters
    ----------
    clip
        The footage. All of its frames are looked at if it flickers.
    plates
        Its backgrounds; those that are not black show the exposure, or are lit by something else.
    smoky
        Number of a frame with much smoke.
    """
    behind = small(plates.at(smoky).image)
    if len(clip) < FEWEST or shows_exposure(behind) or np.median(behind) > USABLE[0]:
        return None

    def light(first: int, last: int) -> Array:
        pictures = (small(clip.glimpse(number, GLIMPSE)) for number in range(first, last))
        return np.stack([_blocks(picture - behind) for picture in pictures])

    first = max(min(smoky - STRETCH // 2, len(clip) - STRETCH), 0)
    last = min(first + STRETCH, len(clip))
    stretch = light(first, last)
    if not flickers(stretch):
        return None
    whole = np.concatenate([light(0, first), stretch, light(last, len(clip))]) if len(clip) > len(stretch) else stretch
    gains = gains_of_light(whole.sum(1))
    return gains if np.abs(np.log(gains)).max() > LEAST else None


def evened(clip: Clip, gains: Array) -> Clip:
    """Return a clip whose frames are divided by gains (frames,). It is read when the frames of the result are."""
    return clip.changed(lambda number, picture: picture / np.float32(gains[number]))


def flickers(light: Array) -> bool:
    """Return whether the light (frames, blocks) of the parts of frames in a row bends to and fro, and alike in all."""
    bends, apart = [], []
    for before, at, after in zip(light[:-2], light[1:-1], light[2:], strict=True):
        tells = np.minimum(np.minimum(before, at), after) > FAINTEST * at.sum()
        if np.count_nonzero(tells) < FEWEST_BLOCKS:
            continue
        weight = at[tells]
        bend = np.log(before[tells] * after[tells] / weight**2)
        bends.append(_weighted_median(bend, weight))
        apart.append(_weighted_median(np.abs(bend - bends[-1]), weight))
    whole = light.sum(1)
    shown = (whole[1:] > 0) & (whole[:-1] > 0)
    if len(bends) < FEWEST - 2 or np.mean(np.abs(np.log(whole[1:][shown] / whole[:-1][shown])) < STILL) > MOST_STILL:
        return False
    typical = float(np.median(np.abs(bends)))
    turns = np.not_equal(np.sign(bends[1:]), np.sign(bends[:-1])).mean()
    return bool(typical > BENDING and typical > AGREEING * np.median(apart) and turns >= TURNING)


def gains_of_light(light: Array) -> Array:
    """Return the gains (frames,) of the light of frames in a row, some of which flicker.

    Examples
    --------
    >>> smoke = 1 + 0.05 * np.arange(20)
    >>> gains = 1 + 0.1 * np.random.default_rng(1).uniform(-1, 1, 20)
    >>> bool(np.ptp(np.diff(np.log(gains_of_light(gains * smoke) / gains))) < 0.02)
    True
    """
    count = len(light)
    bright = light > FAINT * light.max()
    logarithm = np.log(light, where=bright, out=np.zeros(count))
    steps = bright[1:] & bright[:-1] & (np.abs(np.diff(logarithm)) < np.log(BURST))
    bends = sparse.diags([1.0, -2.0, 1.0], [0, 1, 2], shape=(count - 2, count), format="csr")[steps[1:] & steps[:-1]]
    bent = bends @ logarithm
    if len(bent) < FEWEST - 2:
        return np.ones(count)
    products = bends @ bends.T
    diagonals = np.stack([np.pad(products.diagonal(k), (0, k)) for k in range(3)])
    best, logarithms = np.inf, np.zeros(count)
    for weight in WEIGHTS:
        covariance = diagonals.copy()
        covariance[0] += 1 / weight
        factor = cholesky_banded(covariance, lower=True)
        explained = cho_solve_banded((factor, True), bent)
        # the variance of greatest likelihood is put in
        unlikely = len(bent) * np.log(bent @ explained) + 2 * np.log(factor[0]).sum()
        if unlikely < best:
            best, logarithms = unlikely, bends.T @ explained
    return np.asarray(np.exp(logarithms))


def _blocks(picture: Picture) -> Array:
    """The light of the blocks of a linear picture, (blocks,)."""
    light: Array = picture.sum(-1, dtype=np.float64)
    for axis in (0, 1):
        edges = np.linspace(0, light.shape[axis], min(BLOCKS, light.shape[axis]) + 1).astype(int)
        light = np.add.reduceat(light, edges[:-1], axis)
    return np.asarray(np.maximum(light.ravel(), 0))


def _weighted_median(values: Array, weights: Array) -> float:
    order = np.argsort(values)
    sums = np.cumsum(weights[order])
    return float(values[order[np.searchsorted(sums, sums[-1] / 2)]])
