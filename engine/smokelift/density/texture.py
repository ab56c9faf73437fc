"""The texture of a clip's smoke: along which axis it travels, how rough it is, how its patches are distributed.

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
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
import scipy.fft
from numpy.typing import NDArray
from scipy import ndimage

import smokelift._core as _core
from smokelift.checks import Mask
from smokelift.density.lattice_noise import LARGEST_BLUR, SMALLEST_BLUR
from smokelift.density.observation import ObservedClip, ObservedView
from smokelift.density.turntable import DepthMap, Turntable
from smokelift.scene import Camera, Domain
from smokelift.transport import block_means

SIZE = 7
"""Pixels along a patch's side. With one scale for each factor of two, patches of neighboring scales overlap widely."""

UNIT = 0.05
"""tau0, in units of the clip's 95th percentile of optical depth."""

BASES = 8
"""Orthonormal bases of directions that take turns: more than a frame has rounds on one scale."""

KNOTS = 512
"""Quantiles that stand for a distribution."""

MAX_PATCHES = 8192
"""Largest number of patches for the quantiles of a scale: the rank of each is then known to 0.6 % at most, the standard
error of a fraction of one half."""

PASSES = 2
"""Times that a picture's patches are moved, each time along another basis (docs/experiments/every-view.md)."""

MIN_DEPTH = 0.01
"""Fraction of a picture's largest optical depth below which a patch, or a row, shows no smoke."""

DENSE = 0.05
"""Fraction of a picture's largest optical depth from which the spread of v is measured."""

MAX_LOG_DEPTH = 12.0
"""Bound of v: far beyond any picture, within what an exponential holds."""

FRAMES = 12
"""Frames at most, spread over the clip, whose patches are taken: a thousand of each are enough for a scale."""

SMOOTHING = 1.5
"""Standard deviation (voxels) of the blur before the drift is measured: a difference quotient needs it."""

ACROSS = 6.0
"""Width of a row's smoke in its standard deviations: three to either side hold all but 0.3 % of a Gaussian profile."""

VOXEL = 12**-0.5
"""Standard deviation (voxels) of smoke that fills one voxel: the smallest, even for a thread of single pixels (by
definition)."""

BODY = 0.1
"""Fraction of a picture's largest optical depth, blurred, from which detail is measured: faint outlines do not
count."""

NEIGHBORS = (4, 2, 1, 1 / 2, 1 / 4, 1 / 8)
"""Blurs of the octaves whose energy a band holds, over the band's own: others add less than a hundredth."""

FINE_ENOUGH = 1.5
"""Smallest standard deviation (pixels) of the blurs that measure detail: larger pictures are reduced first."""


@dataclass(frozen=True, eq=False)
class ClipTexture:
    """The texture of a clip's smoke.

    The `turntable` is before the input's camera. It turns about the smoke's own axis: what is seen on the way about it
    looks alike. There is one of the `exemplars` a scale, the coarsest first: its patches are as wide as the smoke.
    `width` is the standard deviation of the smoke across the axis, in voxels. `drift` is the mean motion of the
    pictures along it, in voxels per frame, and `roughness` the strength of each octave of `stretched_noise`.
    """

    turntable: Turntable
    exemplars: tuple[Exemplar, ...]
    width: float
    drift: float
    roughness: tuple[float, ...]

    @staticmethod
    def of(clip: ObservedClip) -> ClipTexture | None:
        """Measure the texture of some frames of a clip; None if none shows smoke."""
        frames, domain = clip.spread(FRAMES), clip.optics.domain
        # each frame is read once, the ones that follow for the motion alone
        needed = sorted({number + ahead for number in frames for ahead in (0, 1) if number + ahead < clip.length})
        seen = {number: _seen(clip, number) for number in needed}
        upright = {number: _upright_pictures(views, domain) for number, views in seen.items()}
        front = next((upright[number][0].turntable for number in frames if upright[number]), None)
        if front is None:
            return None
        motion = _motion([(upright[number], upright.get(number + 1, [])) for number in frames])
        axis = front.axis
        if abs(motion[0]) > abs(motion[1]):
            axis = int(np.argmax(np.abs(front.lateral)))
            motion = motion[::-1]
        shown = [each for number in frames for each in _upright_pictures(seen[number], domain, axis)]
        pictures = [each.picture for each in shown]
        width = max(VOXEL, float(np.mean([_width(picture) for picture in pictures])))
        scales = [1]
        while SIZE * scales[0] < ACROSS * width:
            scales.insert(0, 2 * scales[0])
        exemplars = tuple(Exemplar.of(pictures, scale) for scale in scales)
        drift = abs(float(motion[1]))
        return ClipTexture(shown[0].turntable, exemplars, width, drift, roughness(pictures, width))

    def halved(self, domain: Domain) -> ClipTexture:
        """The texture on a domain with voxels twice as wide, without the scale that these do not hold."""
        exemplars = tuple(replace(each, scale=each.scale // 2) for each in self.exemplars if each.scale > 1)
        turntable = replace(self.turntable, domain=domain)
        return ClipTexture(turntable, exemplars, self.width / 2, self.drift / 2, self.roughness)


class _Shown(NamedTuple):
    """What a camera saw, on the upright plane of the turntable before it."""

    turntable: Turntable
    picture: DepthMap


def _seen(clip: ObservedClip, number: int) -> list[tuple[Camera, NDArray[np.float32]]]:
    """Cameras of a frame, the input's first, and the optical depths (rows, columns) that they saw."""
    views = [ObservedView.of(observation, clip.optics) for observation in clip.observe(number)]
    return [(view.camera, view.optical_depth) for view in views]


def _upright_pictures(
    seen: Sequence[tuple[Camera, NDArray[np.float32]]], domain: Domain, axis: int | None = None
) -> list[_Shown]:
    """Pictures that show smoke, on upright planes of an axis of the grid or of their own height."""
    found = []
    for camera, optical_depth in seen:
        if optical_depth.any():
            turntable = Turntable.facing(camera, domain, axis)
            picture = turntable.on_plane(optical_depth, camera)
            if picture.any():
                found.append(_Shown(turntable, picture))
    return found


def _motion(pairs: Sequence[tuple[Sequence[_Shown], Sequence[_Shown]]]) -> NDArray[np.float64]:
    """Mean motion across and along the axis, in voxels per frame, that explains most of the change between frames.

    It is the least squares solution of p' - p + u . grad p = 0 over pairs of successive pictures of the input,
    compressed and smoothed.
    """
    normal, change = np.zeros((2, 2)), np.zeros(2)
    for pair in pairs:
        if all(pair):
            before, after = (ndimage.gaussian_filter(np.log1p(shown[0].picture), SMOOTHING) for shown in pair)
            slopes = np.array(np.gradient((before + after) / 2))
            normal += np.einsum("iab,jab->ij", slopes, slopes)
            change += np.einsum("iab,ab->i", slopes, before - after)
    return np.asarray(np.linalg.lstsq(normal, change, rcond=None)[0])


def _width(picture: DepthMap) -> float:
    """Standard deviation (columns) of a picture's smoke about the middle of its row."""
    columns, row_sums = np.arange(len(picture)), np.maximum(picture.sum(0), 1e-30)
    middles = columns @ picture / row_sums
    return float(np.sqrt(np.sum(picture * (columns[:, None] - middles) ** 2) / picture.sum()))


def roughness(pictures: Sequence[DepthMap], width: float) -> tuple[float, ...]:
    """Standard deviation of the logarithm of some smoke's density by octave, the coarsest first.

    The pictures are optical depths, one pixel per voxel; the smoke is ``width`` voxels wide (standard deviation across
    its axis). A picture's energy in a band, the difference of an octave's blur and half of that, is divided by that of
    smoke with a Gaussian profile whose octaves of noise all have unit strength.
    """
    octaves = max(1, 1 + int(np.log2(LARGEST_BLUR * width / SMALLEST_BLUR)))
    blurs = [LARGEST_BLUR * width / 2**octave for octave in range(octaves)]
    return tuple(float(np.sqrt(np.log1p(_energy(pictures, blur) / _unit_energy(blur, width)))) for blur in blurs)


def _energy(pictures: Sequence[DepthMap], blur: float) -> float:
    """Mean square of the detail between a blur (deviation, pixels) and half of it, over the blurred smoke's."""
    scale = 1
    while blur / (2 * scale) >= FINE_ENOUGH:
        scale *= 2
    square = total = 0.0
    for picture in pictures:
        detail, coarse, body = _octave(block_means(picture, scale), blur / scale)
        square += float(np.sum(detail[body] ** 2 / coarse[body], dtype=np.float64))
        total += float(np.sum(coarse[body], dtype=np.float64))
    return square / total


def fine_energy(pictures: Sequence[DepthMap]) -> float:
    """Mean square of the pictures' finest octave of detail, over the blurred smoke's, as smoke in depth has it.

    The Fourier transform of a picture is a plane through the vertical of the smoke's own. So its waves stand for the
    more of those in the smoke the farther they are from the vertical (the ramp filter of backprojection: Kak and
    Slaney, "Principles of Computerized Tomographic Imaging", 1988, ch. 3). 0 for pictures without smoke.
    """
    square = total = 0.0
    for picture in pictures:
        detail, coarse, body = _octave(picture, SMALLEST_BLUR)
        waves = scipy.fft.dct(detail * body / np.sqrt(np.where(body, coarse, 1)), axis=0, norm="ortho")
        square += float((np.square(waves).sum(1) * np.arange(len(waves)) / len(waves)).sum(dtype=np.float64))
        total += float(coarse[body].sum(dtype=np.float64))
    return square / total if total > 0 else 0.0


def _octave(picture: DepthMap, blur: float) -> tuple[DepthMap, DepthMap, Mask]:
    """A picture's detail between a blur (deviation, pixels) and half of it, the picture so blurred, and its body."""
    fine, coarse = (ndimage.gaussian_filter(picture, each) for each in (blur / 2, blur))
    return fine - coarse, coarse, coarse > BODY * coarse.max()


def _unit_energy(blur: float, width: float) -> float:
    """`_energy` of octaves of unit strength: each is blurred white noise, of which a ray averages independent parts."""
    own = np.array([each * blur for each in NEIGHBORS])
    square = own**2
    bands = 1 / (square + blur**2 / 4) - 2 / (square + blur**2 * 5 / 8) + 1 / (square + blur**2)
    return float(np.sum(square * bands * own / np.hypot(own, width)))


@dataclass(frozen=True, eq=False)
class Exemplar:
    """The distribution of the patches of some pictures at one scale."""

    scale: int
    """Pixels of the pictures along one pixel of a patch, which is their mean."""
    unit: float
    """tau0."""
    height: float
    """What the whole height of the smoke counts as, in units of v."""
    directions: NDArray[np.float32]
    """(bases, n, n): orthonormal; n is the number of a patch's pixels, and one for its height."""
    fine_energy: float
    """That of the pictures; see `fine_energy`."""
    quantiles: NDArray[np.float32]
    """(bases, n, knots): of the patches along each direction, ascending."""

    @staticmethod
    def of(pictures: Sequence[DepthMap], scale: int) -> Exemplar:
        """Take the patches of pictures that show smoke, and of their mirror images."""
        fullest = max(pictures, key=lambda picture: float(picture.sum(dtype=np.float64)))
        unit = UNIT * float(np.percentile(fullest[fullest > 0], 95))
        spread = [np.log1p(each[each > DENSE * each.max()] / unit).std() for each in pictures]
        # patches at both ends of the smoke differ as much as all of a patch's pixels by half their spread
        height = SIZE / 2 * float(np.mean(spread))
        shifts = range(0, scale, max(1, scale // 2))
        samples = [
            _patches(np.log1p(block_means(each[shift:, shift:], scale) / unit), height)[0]
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
        energy = fine_energy([block_means(picture, scale) for picture in pictures])
        return Exemplar(scale, unit, height, directions, energy, np.ascontiguousarray(quantiles, np.float32))

    def towards(self, picture: DepthMap, turn: int) -> DepthMap:
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


def _patches(v: DepthMap, height: float) -> tuple[NDArray[np.float32], NDArray[np.int32]]:
    """Patches (n, count) about pixels near smoke, with their height; and their places (2, count) in v, padded."""
    linear, reach = np.expm1(v), SIZE // 2
    least = MIN_DEPTH * linear.max()
    at = np.array(np.nonzero(ndimage.maximum_filter(linear, SIZE) > least), np.int32)
    row_sums = linear.sum(0)
    there = np.flatnonzero(row_sums > MIN_DEPTH * row_sums.max())
    place = height * (at[1] - there[0]) / max(there[-1] - there[0], 1)
    pixels = _core.unfold(np.pad(v, reach), at + reach, SIZE)
    return np.concatenate([pixels, place[None].astype(np.float32)]), at + reach


def enlarged(picture: DepthMap, scale: int, shape: tuple[int, int]) -> DepthMap:
    """The inverse of `block_means`, to a shape, linear between the blocks' middles."""
    columns, voxels = shape
    large = ndimage.zoom(picture, scale, order=1, mode="nearest", grid_mode=True)
    return np.ascontiguousarray(large[:columns, :voxels])
