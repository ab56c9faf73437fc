"""How near a density is to the truth; and what every metric demands: arrays of one shape, whose values are finite."""

import math

import numpy as np
import numpy.typing as npt

from smokelift.checks import Doubles, Mask, numbers
from smokelift.transport import StaggeredGrid, require_positive


def finite_array(values: npt.ArrayLike) -> Doubles:
    """Return an array of float64; ValueError if it holds anything but finite numbers."""
    if isinstance(values, StaggeredGrid):
        raise ValueError("a velocity must be an array of vectors at voxel centers: velocity.centres(), not a Velocity")
    array = numbers(values, "values", np.float64)
    if not np.isfinite(array).all():
        raise ValueError("values must be finite; replace those that are not, or leave their pixels or voxels out")
    return array


def pair(a: npt.ArrayLike, b: npt.ArrayLike) -> tuple[Doubles, Doubles]:
    """Return two arrays of float64; ValueError if a value is not finite, or they are empty or differ in shape."""
    first, second = finite_array(a), finite_array(b)
    if first.shape != second.shape:
        raise ValueError(f"shapes must be equal, not {first.shape} and {second.shape}; bring one to the other's size")
    if first.size == 0:
        raise ValueError("arrays must not be empty; give one value at least")
    return first, second


def checked_mask(mask: npt.ArrayLike | None, shape: tuple[int, ...]) -> Mask:
    """Return which values count, all without a mask; ValueError if it does not fit the shape or counts none."""
    if mask is None:
        return np.ones(shape, np.bool_)
    counts = np.asarray(mask, np.bool_)
    if counts.shape != shape[: counts.ndim] or not counts.any():
        raise ValueError(f"the mask {counts.shape} must fit {shape} and count at least one value")
    return counts


def relative(error: float, norm: float) -> float:
    """Return an error beside a norm: 0 where both are, infinity where only the norm is."""
    if norm == 0.0:
        return 0.0 if error == 0.0 else math.inf
    return error / norm


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
    found, true = pair(density, truth)
    counts = checked_mask(mask, found.shape)
    return relative(float(np.linalg.norm((found - true)[counts])), float(np.linalg.norm(true[counts])))


def mass(density: npt.ArrayLike, voxel_size: float) -> float:
    """Return the volume integral of a density, in density times cubic meters.

    Raises
    ------
    ValueError
        If a value is not finite, or the size not positive.
    """
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

    Raises
    ------
    ValueError
        If the shapes differ or a value is not finite.
    """
    found, true = pair(density, truth)
    layers, wanted = found.sum(axis=(0, 1)), true.sum(axis=(0, 1))
    return relative(float(np.abs(layers - wanted).sum()), float(wanted.sum()))
