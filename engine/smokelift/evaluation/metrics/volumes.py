"""How near a density is to the truth."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from smokelift.evaluation.metrics.inputs import counted, finite_array, pair, relative
from smokelift.transport import require_positive


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
    counts = counted(mask, found.shape)
    return relative(float(np.linalg.norm((found - true)[counts])), float(np.linalg.norm(true[counts])))


def mass(density: npt.ArrayLike, voxel_size: float) -> float:
    """Return the volume integral of a density, in density times cubic metres.

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
