"""The distribution of the patches of a clip, and pictures that are moved towards it.

A picture of turbulent smoke is a sample of a texture whose statistics do not depend on the azimuth. So every side of
the smoke should have the distribution of square patches that the clip's own pictures have. Two distributions agree if
all their one-dimensional projections do. So the patches of a picture are sorted along random directions and moved to
the quantiles of the clip's: one-dimensional optimal transport (sliced Wasserstein distance: Pitie, Kokaram and Dahyot
2005; for patches Elnekave and Weiss, "Generating natural images with direct patch distributions matching", 2022; for
solids Kopf et al., "Solid texture synthesis from 2D exemplars", 2007).

Patches hold v = log(1 + tau / tau0) of the optical depth tau, so that outlines and thin parts count as well as the
core. The height of a patch within the smoke is one more coordinate, as the cap of a column differs from its stem.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

import smokelift._core as _core

Picture = NDArray[np.float32]
"""Optical depth (columns, voxels along the axis) on the screen of a turntable, or the like."""

SIZE = 7
"""Pixels along a patch's side. With one scale for each factor of two, patches of neighbouring scales overlap widely."""

UNIT = 0.05
"""tau0, in shares of the clip's 95th percentile of optical depth."""

BASES = 8
"""Orthonormal bases of directions that take turns: more than a frame has rounds on one scale."""

KNOTS = 512
"""Quantiles that stand for a distribution."""

MAX_PATCHES = 8192
"""Largest number of patches for the quantiles of a scale: the rank of each is then known to 0.6 % at most, the standard
error of a share of one half."""

PASSES = 2
"""Times that a picture's patches are moved, each time along another basis."""

MIN_DEPTH_SHARE = 0.01
"""Share of a picture's largest optical depth below which a patch, or a row, shows no smoke."""

DENSE = 0.05
"""Share of a picture's largest optical depth from which the spread of v is measured."""

MAX_LOG_DEPTH = 12.0
"""Bound of v: far beyond any picture, within what an exponential holds."""


@dataclass(frozen=True, eq=False)
class Exemplar:
    """The distribution of the patches of some pictures at one scale.

    Attributes
    ----------
    scale
        Pixels of the pictures along one pixel of a patch, which is their mean.
    unit
        tau0.
    height
        What the whole height of the smoke counts as, in units of v.
    directions : (bases, n, n)
        Orthonormal; n is the number of a patch's pixels, and one for its height.
    quantiles : (bases, n, knots)
        Of the patches along each direction, ascending.
    """

    scale: int
    unit: float
    height: float
    directions: NDArray[np.float32]
    quantiles: NDArray[np.float32]

    @staticmethod
    def of(pictures: Sequence[Picture], scale: int) -> Exemplar:
        """Take the patches of pictures that show smoke, and of their mirror images."""
        fullest = max(pictures, key=lambda picture: float(picture.sum(dtype=np.float64)))
        unit = UNIT * float(np.percentile(fullest[fullest > 0], 95))
        spread = [np.log1p(each[each > DENSE * each.max()] / unit).std() for each in pictures]
        # patches at both ends of the smoke differ as much as all of a patch's pixels by half their spread
        height = SIZE / 2 * float(np.mean(spread))
        shifts = range(0, scale, max(1, scale // 2))
        samples = [
            _patches(np.log1p(reduced(each[shift:, shift:], scale) / unit), height)[0]
            for picture in pictures
            for each in (picture, picture[::-1])
            for shift in shifts
            if each[shift:, shift:].any()  # a shift may cut off all of the smoke, along an edge
        ]
        random = np.random.default_rng(0)
        every = np.concatenate(samples, 1)
        every = every[:, random.permutation(every.shape[1])[:MAX_PATCHES]]
        size = len(every)
        directions = np.stack([np.linalg.qr(random.standard_normal((size, size)))[0] for _ in range(BASES)])
        directions = directions.astype(np.float32)
        knots = ((np.arange(KNOTS) + 0.5) / KNOTS * every.shape[1]).astype(np.intp)
        quantiles = np.stack([np.sort(basis @ every, axis=1)[:, knots] for basis in directions])
        return Exemplar(scale, unit, height, directions, np.ascontiguousarray(quantiles, np.float32))

    def towards(self, picture: Picture, turn: int) -> Picture:
        """A picture at this scale, its patches moved to the exemplar's quantiles; where they overlap their mean counts.

        ``turn`` chooses the directions.
        """
        v = np.log1p(picture / np.float32(self.unit))
        reach = SIZE // 2
        padded = (v.shape[0] + 2 * reach, v.shape[1] + 2 * reach)
        for number in range(turn * PASSES, (turn + 1) * PASSES):
            basis = self.directions[number % BASES]
            patches, at = _patches(v, self.height)
            moves = basis @ patches
            _core.to_quantiles(moves, self.quantiles[number % BASES])
            mean = _core.fold(basis.T[:-1] @ moves, at, SIZE, padded)
            v = np.clip(v + mean[reach:-reach, reach:-reach], 0, MAX_LOG_DEPTH)
        return np.asarray(self.unit * np.expm1(v), np.float32)


def _patches(v: Picture, height: float) -> tuple[NDArray[np.float32], NDArray[np.int32]]:
    """Patches (n, count) about pixels near smoke, with their height; and their places (2, count) in v, padded."""
    linear, reach = np.expm1(v), SIZE // 2
    least = MIN_DEPTH_SHARE * linear.max()
    at = np.array(np.nonzero(ndimage.maximum_filter(linear, SIZE) > least), np.int32)
    amounts = linear.sum(0)
    there = np.flatnonzero(amounts > MIN_DEPTH_SHARE * amounts.max())
    place = height * (at[1] - there[0]) / max(there[-1] - there[0], 1)
    pixels = _core.unfold(np.pad(v, reach), at + reach, SIZE)
    return np.concatenate([pixels, place[None].astype(np.float32)]), at + reach


def reduced(picture: Picture, scale: int) -> Picture:
    """Means of square blocks of a picture, which is zero beyond its ends."""
    if scale == 1:
        return np.ascontiguousarray(picture)
    padded = np.pad(picture, [(0, -count % scale) for count in picture.shape])
    blocks = padded.reshape(padded.shape[0] // scale, scale, padded.shape[1] // scale, scale)
    return np.asarray(blocks.mean((1, 3)), np.float32)


def enlarged(picture: Picture, scale: int, shape: tuple[int, ...]) -> Picture:
    """The inverse of `reduced`, to a shape, linear between the blocks' middles."""
    if scale == 1:
        return picture
    for axis, count in enumerate(shape):
        last = picture.shape[axis] - 1
        at = np.clip((np.arange(count) + 0.5) / scale - 0.5, 0, last)
        below = np.minimum(at.astype(np.intp), max(last - 1, 0))
        share = (at - below).astype(np.float32).reshape((-1, 1) if axis == 0 else (1, -1))
        above = picture.take(np.minimum(below + 1, last), axis)
        picture = picture.take(below, axis) * (1 - share) + above * share
    return picture
