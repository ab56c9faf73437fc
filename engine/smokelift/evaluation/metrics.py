"""How near a result is to the truth: pictures, densities, velocities.

Every function refuses with ValueError values that are not finite, since a NaN that slips into a mean is worse than no
figure; so it does arrays of other shapes than it says, a mask that counts nothing, and a size or a peak that is not
positive.
"""

import math

import numpy as np
import numpy.typing as npt
from scipy import ndimage

from smokelift.checks import Doubles, Mask
from smokelift.evaluation.statistics import PatchStatistics, RayShapes, finite_array, mean_gradient, relative
from smokelift.transport import require_positive

__all__ = [
    "PatchStatistics",
    "RayShapes",
    "flicker",
    "height_mass_error",
    "mass",
    "mean_divergence",
    "mean_gradient",
    "psnr",
    "ssim",
    "velocity_error",
    "volume_error",
    "warp_error",
]


def _pair(a: npt.ArrayLike, b: npt.ArrayLike) -> tuple[Doubles, Doubles]:
    """Return two arrays of float64; ValueError if a value is not finite, or they are empty or differ in shape."""
    first, second = finite_array(a), finite_array(b)
    if first.shape != second.shape:
        raise ValueError(f"shapes must be equal, not {first.shape} and {second.shape}; bring one to the other's size")
    if first.size == 0:
        raise ValueError("arrays must not be empty; give one value at least")
    return first, second


def _checked_mask(mask: npt.ArrayLike | None, shape: tuple[int, ...]) -> Mask:
    """Return which values count, all without a mask; ValueError if it does not fit the shape or counts none."""
    if mask is None:
        return np.ones(shape, np.bool_)
    counts = np.asarray(mask, np.bool_)
    if counts.shape != shape[: counts.ndim] or not counts.any():
        raise ValueError(f"the mask {counts.shape} must fit {shape} and count at least one value")
    return counts


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
    """
    found, true = _pair(density, truth)
    counts = _checked_mask(mask, found.shape)
    return relative(float(np.linalg.norm((found - true)[counts])), float(np.linalg.norm(true[counts])))


def mass(density: npt.ArrayLike, voxel_size: float) -> float:
    """Return the volume integral of a density, in density times cubic meters."""
    require_positive("voxel_size", voxel_size)
    return float(finite_array(density).sum()) * voxel_size**3


def height_mass_error(density: npt.ArrayLike, truth: npt.ArrayLike) -> float:
    """Return how much mass is at a wrong height: sum |m - m_true| / sum m_true over the layers along z.

    Parameters
    ----------
    density, truth
        Arrays of one shape (nx, ny, nz).

    Returns
    -------
    0 for equal masses in every layer, 1 for no density at all; infinity if only the truth is empty.
    """
    found, true = _pair(density, truth)
    layers, wanted = found.sum(axis=(0, 1)), true.sum(axis=(0, 1))
    return relative(float(np.abs(layers - wanted).sum()), float(wanted.sum()))


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
    """
    require_positive("peak", peak)
    first, second = _pair(a, b)
    error = (first - second) ** 2
    mean = float(error[_checked_mask(mask, error.shape)].mean())
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
    """
    require_positive("peak", peak)
    first, second = _pair(a, b)
    if first.ndim not in (2, 3) or min(first.shape[:2]) < 11:
        raise ValueError(f"ssim needs pictures of at least 11 x 11 pixels, not of shape {first.shape}")

    def smooth(picture: Doubles) -> Doubles:
        sigma = (1.5, 1.5, 0.0)[: picture.ndim]
        blurred: Doubles = ndimage.gaussian_filter(picture, sigma, truncate=5 / 1.5)
        return blurred[5:-5, 5:-5]

    mean_a, mean_b = smooth(first), smooth(second)
    variance_a = smooth(first * first) - mean_a**2
    variance_b = smooth(second * second) - mean_b**2
    covariance = smooth(first * second) - mean_a * mean_b
    c1, c2 = (0.01 * peak) ** 2, (0.03 * peak) ** 2
    above = (2 * mean_a * mean_b + c1) * (2 * covariance + c2)
    below = (mean_a**2 + mean_b**2 + c1) * (variance_a + variance_b + c2)
    return float((above / below).mean())


def velocity_error(
    velocity: npt.ArrayLike, truth: npt.ArrayLike, mask: npt.ArrayLike | None = None
) -> tuple[float, float]:
    """Return how far a velocity is from the truth.

    Parameters
    ----------
    velocity, truth
        Vectors at voxel centers, shape (nx, ny, nz, 3), in one unit.
    mask
        Which voxels count (those with smoke, as a rule), shape (nx, ny, nz); None counts all.

    Returns
    -------
    The relative L2 error, and the mean cosine of the angle between both, over voxels where the truth moves
    faster than a millionth of its largest speed; a velocity of zero there has the cosine 0. Without any such
    voxel the cosine is 1.
    """
    found, true = _pair(velocity, truth)
    counts = _checked_mask(mask, found.shape[:-1])
    u, v = found[counts], true[counts]
    error = relative(float(np.linalg.norm(u - v)), float(np.linalg.norm(v)))
    speed = np.linalg.norm(v, axis=-1)
    moving = speed > 1e-6 * speed.max()
    if not moving.any():
        return error, 1.0
    lengths = np.linalg.norm(u, axis=-1)[moving] * speed[moving]
    products = (u * v).sum(axis=-1)[moving]
    cosine = np.divide(products, lengths, out=np.zeros_like(products), where=lengths > 0.0)
    return error, float(cosine.mean())


def mean_divergence(velocity: npt.ArrayLike, voxel_size: float, mask: npt.ArrayLike | None = None) -> float:
    """Return the mean |div u| in 1/s of a velocity at voxel centers, measured at the corners between eight voxels.

    Where velocities at the centers are means of opposite faces, that is the mean over the eight voxels of the
    divergence on their faces: zero if that is. Central differences would be small for a smooth flow only.

    Parameters
    ----------
    velocity
        Shape (nx, ny, nz, 3), m/s.
    voxel_size
        Edge of a voxel in meters.
    mask
        Which voxels count, shape (nx, ny, nz): a corner counts if all of its eight do. None counts all.
    """
    require_positive("voxel_size", voxel_size)
    u = finite_array(velocity)
    if u.ndim != 4 or u.shape[3] != 3:
        raise ValueError(f"a velocity must have the shape (nx, ny, nz, 3), not {u.shape}")
    outflow = np.zeros([n - 1 for n in u.shape[:3]])
    for axis in range(3):
        slope = np.diff(u[..., axis], axis=axis)
        for across in {0, 1, 2} - {axis}:
            slope = (np.delete(slope, 0, across) + np.delete(slope, -1, across)) / 2
        outflow += slope / voxel_size
    counts = _checked_mask(mask, u.shape[:3])
    corners = np.lib.stride_tricks.sliding_window_view(counts, (2, 2, 2)).all(axis=(3, 4, 5))
    return float(np.abs(outflow)[_checked_mask(corners, outflow.shape)].mean())


def warp_error(
    before: npt.ArrayLike, after: npt.ArrayLike, displacement: npt.ArrayLike, mask: npt.ArrayLike | None = None
) -> float:
    """Return how well a velocity carries one density into the next: |before(x - u) - after| / |after|.

    Densities are interpolated linearly and are zero outside the box. The error of the truth is not zero, and that of a
    wrong velocity may be smaller: this says whether motion and densities agree, not whether either is right.

    Parameters
    ----------
    before, after
        Densities of one shape (nx, ny, nz).
    displacement
        The way u from one to the other in voxels at the points of arrival, shape (nx, ny, nz, 3).
    mask
        Which voxels count; None counts all.
    """
    start, end = _pair(before, after)
    way = finite_array(displacement)
    if way.shape != (*start.shape, 3):
        raise ValueError(f"the displacement {way.shape} must have a vector for each of {start.shape} voxels")
    origins = np.indices(start.shape) - np.moveaxis(way, -1, 0)
    return volume_error(ndimage.map_coordinates(start, origins, order=1, mode="constant"), end, mask)


def flicker(series: npt.ArrayLike) -> float:
    """Return the unsteadiness of something in time: mean size of its second differences over that of its values.

    Detail that moves on has some; detail that appears and dissolves has more.

    Parameters
    ----------
    series
        Shape (frames, ...), at least three frames.
    """
    values = finite_array(series)
    if len(values) < 3:
        raise ValueError(f"flicker needs at least three frames, not {len(values)}")
    second = values[2:] - 2 * values[1:-1] + values[:-2]
    return relative(float(np.abs(second).mean()), float(np.abs(values).mean()))
