"""How near a result is to the truth: pictures, densities, velocities.

Every function refuses arrays of different shapes and values that are not finite with ValueError: a NaN that
slips into a mean is worse than no figure.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import numpy.typing as npt
from scipy import fft, ndimage

from smokelift.density.anisotropy import depth_anisotropy as depth_anisotropy

Array = npt.NDArray[np.float64]
Mask = npt.NDArray[np.bool_]


def psnr(a: npt.ArrayLike, b: npt.ArrayLike, mask: npt.ArrayLike | None = None, peak: float = 1.0) -> float:
    """Return the peak signal-to-noise ratio of two pictures in dB.

    Parameters
    ----------
    a, b
        Pictures of one shape, in the encoding that is to be judged (usually sRGB values).
    mask
        Which pixels count, shape (rows, columns) or that of the pictures; None counts all.
    peak
        The value of white.

    Returns
    -------
    Decibels; infinity for equal pictures.

    Raises
    ------
    ValueError
        If the shapes differ, a value is not finite, or no pixel counts.
    """
    first, second = _pair(a, b)
    error = (first - second) ** 2
    mean = float(error[_mask(mask, error.shape)].mean())
    return math.inf if mean == 0.0 else 10.0 * math.log10(peak**2 / mean)


def ssim(a: npt.ArrayLike, b: npt.ArrayLike, peak: float = 1.0) -> float:
    """Return the structural similarity of two pictures (Wang 2004), the mean over pixels and channels.

    The window is the usual Gaussian of 11 x 11 pixels and sigma 1.5; pixels nearer than 5 to an edge do not
    count.

    Parameters
    ----------
    a, b
        Pictures of one shape, (rows, columns) or (rows, columns, channels), at least 11 x 11.
    peak
        The value of white.

    Raises
    ------
    ValueError
        If the shapes differ, the pictures are too small, or a value is not finite.
    """
    first, second = _pair(a, b)
    if first.ndim not in (2, 3) or min(first.shape[:2]) < 11:
        raise ValueError(f"ssim needs pictures of at least 11 x 11 pixels, not of shape {first.shape}")

    def smooth(picture: Array) -> Array:
        sigma = (1.5, 1.5, 0.0)[: picture.ndim]
        blurred: Array = ndimage.gaussian_filter(picture, sigma, truncate=5 / 1.5)
        return blurred[5:-5, 5:-5]

    mean_a, mean_b = smooth(first), smooth(second)
    variance_a = smooth(first * first) - mean_a**2
    variance_b = smooth(second * second) - mean_b**2
    covariance = smooth(first * second) - mean_a * mean_b
    c1, c2 = (0.01 * peak) ** 2, (0.03 * peak) ** 2
    above = (2 * mean_a * mean_b + c1) * (2 * covariance + c2)
    below = (mean_a**2 + mean_b**2 + c1) * (variance_a + variance_b + c2)
    return float((above / below).mean())


def volume_error(density: npt.ArrayLike, truth: npt.ArrayLike, mask: npt.ArrayLike | None = None) -> float:
    """Return the relative L2 error of a density, |density - truth| / |truth|.

    Parameters
    ----------
    density, truth
        Arrays of one shape.
    mask
        Which voxels count; None counts all.

    Returns
    -------
    0 for equal arrays; infinity if only the truth is zero everywhere.

    Raises
    ------
    ValueError
        If the shapes differ, a value is not finite, or no voxel counts.
    """
    found, true = _pair(density, truth)
    counts = _mask(mask, found.shape)
    return _ratio(float(np.linalg.norm((found - true)[counts])), float(np.linalg.norm(true[counts])))


def mass(density: npt.ArrayLike, voxel_size: float) -> float:
    """Return the volume integral of a density, in density times cubic metres.

    Raises
    ------
    ValueError
        If a value is not finite.
    """
    return float(_finite(density).sum()) * voxel_size**3


def velocity_error(
    velocity: npt.ArrayLike, truth: npt.ArrayLike, mask: npt.ArrayLike | None = None
) -> tuple[float, float]:
    """Return how far a velocity is from the truth.

    Parameters
    ----------
    velocity, truth
        Vectors at voxel centres, shape (nx, ny, nz, 3), in one unit.
    mask
        Which voxels count (those with smoke, as a rule), shape (nx, ny, nz); None counts all.

    Returns
    -------
    The relative L2 error, and the mean cosine of the angle between both, over voxels where the truth moves
    faster than a millionth of its largest speed; a velocity of zero there has the cosine 0. Without any such
    voxel the cosine is 1.

    Raises
    ------
    ValueError
        If the shapes differ, a value is not finite, or no voxel counts.
    """
    found, true = _pair(velocity, truth)
    counts = np.ones(found.shape[:-1], bool) if mask is None else np.asarray(mask, bool)
    if counts.shape != found.shape[:-1] or not counts.any():
        raise ValueError(f"the mask {counts.shape} must fit {found.shape[:-1]} voxels and count at least one")
    u, v = found[counts], true[counts]
    error = _ratio(float(np.linalg.norm(u - v)), float(np.linalg.norm(v)))
    speed = np.linalg.norm(v, axis=-1)
    moving = speed > 1e-6 * speed.max()
    if not moving.any():
        return error, 1.0
    lengths = np.linalg.norm(u, axis=-1)[moving] * speed[moving]
    products = (u * v).sum(axis=-1)[moving]
    cosine = np.divide(products, lengths, out=np.zeros_like(products), where=lengths > 0.0)
    return error, float(cosine.mean())


def height_mass_error(density: npt.ArrayLike, truth: npt.ArrayLike) -> float:
    """Return how much mass is at a wrong height: sum |m - m_true| / sum m_true over the layers along z.

    Parameters
    ----------
    density, truth
        Arrays of one shape (nx, ny, nz).

    Returns
    -------
    0 for equal masses in every layer, 1 for no density at all; infinity if only the truth is empty.

    Raises
    ------
    ValueError
        If the shapes differ or a value is not finite.
    """
    found, true = _pair(density, truth)
    layers, wanted = found.sum(axis=(0, 1)), true.sum(axis=(0, 1))
    return _ratio(float(np.abs(layers - wanted).sum()), float(wanted.sum()))


def mean_divergence(velocity: npt.ArrayLike, voxel_size: float, mask: npt.ArrayLike | None = None) -> float:
    """Return the mean |div u| in 1/s of a velocity at voxel centres, measured at the corners between eight voxels.

    Where velocities at the centres are means of opposite faces, that is the mean over the eight voxels of the
    divergence on their faces: zero if that is. Central differences would be small for a smooth flow only.

    Parameters
    ----------
    velocity
        Shape (nx, ny, nz, 3), m/s.
    voxel_size
        Edge of a voxel in metres.
    mask
        Which voxels count, shape (nx, ny, nz): a corner counts if all of its eight do. None counts all.

    Raises
    ------
    ValueError
        If a value is not finite, the mask does not fit, or no corner counts.
    """
    u = _finite(velocity)
    outflow = np.zeros([n - 1 for n in u.shape[:3]])
    for axis in range(3):
        slope = np.diff(u[..., axis], axis=axis)
        for across in {0, 1, 2} - {axis}:
            slope = (np.delete(slope, 0, across) + np.delete(slope, -1, across)) / 2
        outflow += slope / voxel_size
    counts = _mask(mask, u.shape[:3])
    corners = np.lib.stride_tricks.sliding_window_view(counts, (2, 2, 2)).all(axis=(3, 4, 5))
    return float(np.abs(outflow)[_mask(corners, outflow.shape)].mean())


def warp_error(
    before: npt.ArrayLike, after: npt.ArrayLike, displacement: npt.ArrayLike, mask: npt.ArrayLike | None = None
) -> float:
    """Return how well a velocity carries one density into the next: |before(x - u) - after| / |after|.

    Densities are interpolated linearly and are zero outside the box. The truth's own is not zero, and a wrong
    velocity may have a smaller one: this says whether motion and densities agree, not whether either is right.

    Parameters
    ----------
    before, after
        Densities of one shape (nx, ny, nz).
    displacement
        The way u from one to the other in voxels at the points of arrival, shape (nx, ny, nz, 3).
    mask
        Which voxels count; None counts all.

    Raises
    ------
    ValueError
        If shapes differ, a value is not finite, or no voxel counts.
    """
    start, end = _pair(before, after)
    way = _finite(displacement)
    if way.shape != (*start.shape, 3):
        raise ValueError(f"the displacement {way.shape} must have a vector for each of {start.shape} voxels")
    origins = np.indices(start.shape) - np.moveaxis(way, -1, 0)
    return volume_error(ndimage.map_coordinates(start, origins, order=1, mode="constant"), end, mask)


def shifted_psnr(
    a: npt.ArrayLike, b: npt.ArrayLike, reach: float = 0.25, peak: float = 1.0
) -> tuple[float, tuple[int, int]]:
    """Return the PSNR of two pictures after the best shift of the first by whole pixels.

    What is moved in from outside is zero: give differences from the background. The sum of squares of every shift
    comes from one correlation by fast Fourier transforms.

    Parameters
    ----------
    a, b
        Pictures of one shape, (rows, columns) or (rows, columns, channels).
    reach
        Largest shift, as a share of the rows and of the columns.
    peak
        The value of white.

    Returns
    -------
    Decibels (infinity for equal pictures), and the shift in rows and columns.

    Raises
    ------
    ValueError
        If the shapes differ or a value is not finite.
    """
    first, second = (np.atleast_3d(picture) for picture in _pair(a, b))
    rows, columns = first.shape[:2]
    far = int(reach * rows), int(reach * columns)
    size = [fft.next_fast_len(n + f, real=True) for n, f in zip((rows, columns), far, strict=True)]
    waves = np.conj(fft.rfft2(first, size, axes=(0, 1))) * fft.rfft2(second, size, axes=(0, 1))
    overlap = fft.irfft2(waves.sum(axis=-1), size)
    # sums of squares of what stays in the picture, from a table of sums
    table = np.zeros((rows + 1, columns + 1))
    table[1:, 1:] = (first**2).sum(axis=-1).cumsum(0).cumsum(1)
    down, right = (np.arange(-f, f + 1) for f in far)
    top, bottom = np.maximum(0, -down), rows - np.maximum(0, down)
    left, end = np.maximum(0, -right), columns - np.maximum(0, right)
    kept = table[np.ix_(bottom, end)] - table[np.ix_(top, end)] - table[np.ix_(bottom, left)] + table[np.ix_(top, left)]
    squares = kept + float((second**2).sum()) - 2 * overlap[np.ix_(down, right)]
    row, column = np.unravel_index(int(squares.argmin()), squares.shape)
    shift = int(down[row]), int(right[column])
    moved = np.zeros_like(first)
    there = np.s_[max(0, shift[0]) : rows + min(0, shift[0]), max(0, shift[1]) : columns + min(0, shift[1])]
    here = np.s_[max(0, -shift[0]) : rows - max(0, shift[0]), max(0, -shift[1]) : columns - max(0, shift[1])]
    moved[there] = first[here]
    return psnr(moved, second, peak=peak), shift


OCTAVES = ((2.0, 4.0), (4.0, 8.0), (8.0, 16.0), (16.0, 32.0))
"""Bands of `octave_power` in cycles across the longer side: from the shape of the smoke to what 64 voxels hold."""

DETAIL = 4.0
"""Standard deviation (pixels) of the blur that takes fine detail away."""


def octave_power(picture: npt.ArrayLike) -> Array:
    """Return the power of a picture in each of `OCTAVES`, whatever the direction.

    Parameters
    ----------
    picture
        Shape (rows, columns), at least 64 pixels on the longer side for the last band: the smoke alone, as its
        difference from the background. It is faded out over an eighth at each edge, which smoke may cross.

    Raises
    ------
    ValueError
        If a value is not finite or the picture has not two axes.
    """
    values = _finite(picture)
    if values.ndim != 2:
        raise ValueError(f"the power of octaves needs a picture (rows, columns), not one of shape {values.shape}")
    rows, columns = values.shape
    longer = max(rows, columns)
    power = np.abs(fft.fft2(values * np.outer(_faded(rows), _faded(columns)))) ** 2
    cycles = longer * np.hypot(fft.fftfreq(rows)[:, None], fft.fftfreq(columns))
    return np.array([power[(low <= cycles) & (cycles < high)].sum() for low, high in OCTAVES])


def spectrum_distance(power: npt.ArrayLike, truth: npt.ArrayLike) -> tuple[float, Array]:
    """Return how much stronger or weaker detail is than the truth's, wherever it is.

    Parameters
    ----------
    power, truth
        Sums of `octave_power` over the same frames.

    Returns
    -------
    The root mean square over the octaves, in dB, and each octave's 10 log10(power / truth): negative where the
    picture is smoother than the truth. A millionth of the truth's total is added to both, so that nothing is
    infinite.

    Raises
    ------
    ValueError
        If the shapes differ, a value is not finite, or the truth has no power at all.
    """
    found, true = _pair(power, truth)
    floor = 1e-6 * float(true.sum())
    if floor <= 0:
        raise ValueError("the truth's pictures show nothing: there is no spectrum to compare with")
    ratios = 10 * np.log10((found + floor) / (true + floor))
    return float(np.sqrt(np.mean(ratios**2))), np.asarray(ratios, np.float64)


def row_constant_detail(picture: npt.ArrayLike) -> float:
    """Return the share of a picture's fine detail that is constant along rows: smoke turned on a lathe.

    Parameters
    ----------
    picture
        Shape (rows, columns): the smoke alone, as its difference from the background.

    Returns
    -------
    0 to 1. Detail is what a blur of `DETAIL` pixels takes away, where the picture exceeds 5 % of its maximum. A row of
    n pixels of mere noise has 1/n.

    Raises
    ------
    ValueError
        If a value is not finite.
    """
    values = _finite(picture)
    smoke = np.abs(values) > 0.05 * np.abs(values).max(initial=0.0)
    detail = np.where(smoke, _detail(values), 0.0)
    counts = np.maximum(smoke.sum(1), 1)
    return _ratio(float(np.sum(detail.sum(1) ** 2 / counts)), float(np.sum(detail**2)))


def detail_correlation(a: npt.ArrayLike, b: npt.ArrayLike) -> float:
    """Return the correlation of two pictures' fine details: near 1 where one view shows what another does.

    Parameters
    ----------
    a, b
        Shape (rows, columns): the smoke alone. Detail is as in `row_constant_detail`, where either picture shows smoke.

    Raises
    ------
    ValueError
        If the shapes differ or a value is not finite.
    """
    first, second = _pair(a, b)
    smoke = (np.abs(first) > 0.05 * np.abs(first).max()) | (np.abs(second) > 0.05 * np.abs(second).max())
    if not smoke.any():
        return 0.0
    one, other = (_detail(values)[smoke] for values in (first, second))
    one, other = one - one.mean(), other - other.mean()
    norm = float(np.linalg.norm(one) * np.linalg.norm(other))
    return float(one @ other) / norm if norm > 0 else 0.0


def flicker(series: npt.ArrayLike) -> float:
    """Return the unsteadiness of something in time: RMS of its second differences over its own RMS.

    Parameters
    ----------
    series
        Shape (frames, ...), at least three frames; coarse means (of blocks of a picture, of layers of a volume) show
        flicker, single pixels mostly motion.

    Raises
    ------
    ValueError
        If a value is not finite, or there are fewer than three frames.
    """
    values = _finite(series)
    if len(values) < 3:
        raise ValueError(f"flicker needs at least three frames, not {len(values)}")
    second = values[2:] - 2 * values[1:-1] + values[:-2]
    return _ratio(float(np.sqrt(np.mean(second**2))), float(np.sqrt(np.mean(values**2))))


def _detail(values: Array) -> Array:
    return np.asarray(values - ndimage.gaussian_filter(values, DETAIL))


def _faded(count: int) -> Array:
    """Ones with an eighth at both ends that rises from zero (Tukey's window)."""
    inward = np.minimum(np.arange(count), np.arange(count)[::-1]) + 0.5
    return np.asarray(np.sin(np.pi / 2 * np.minimum(1.0, 8 * inward / count)) ** 2)


def _ratio(error: float, norm: float) -> float:
    if norm == 0.0:
        return 0.0 if error == 0.0 else math.inf
    return error / norm


def _finite(values: npt.ArrayLike) -> Array:
    array = np.asarray(values, np.float64)
    if not np.isfinite(array).all():
        raise ValueError("values must be finite")
    return array


def _pair(a: npt.ArrayLike, b: npt.ArrayLike) -> tuple[Array, Array]:
    first, second = _finite(a), _finite(b)
    if first.shape != second.shape:
        raise ValueError(f"shapes must be equal, not {first.shape} and {second.shape}")
    if first.size == 0:
        raise ValueError("arrays must not be empty")
    return first, second


def _mask(mask: npt.ArrayLike | None, shape: tuple[int, ...]) -> Any:
    if mask is None:
        return np.ones(shape, bool)
    counts = np.asarray(mask, bool)
    if counts.shape != shape[: counts.ndim] or not counts.any():
        raise ValueError(f"the mask {counts.shape} must fit {shape} and count at least one value")
    return counts
