"""How near a velocity is to the truth, and whether it carries a density as the next frame shows it."""

import numpy as np
import numpy.typing as npt
from scipy import ndimage

from smokelift.evaluation.metrics.volumes import checked_mask, finite_array, pair, relative, volume_error
from smokelift.transport import require_positive


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

    Raises
    ------
    ValueError
        If the shapes differ, a value is not finite, or no voxel counts.
    """
    found, true = pair(velocity, truth)
    counts = checked_mask(mask, found.shape[:-1])
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

    Raises
    ------
    ValueError
        If a value is not finite, the size not positive, a shape does not fit, or no corner counts.
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
    counts = checked_mask(mask, u.shape[:3])
    corners = np.lib.stride_tricks.sliding_window_view(counts, (2, 2, 2)).all(axis=(3, 4, 5))
    return float(np.abs(outflow)[checked_mask(corners, outflow.shape)].mean())


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

    Raises
    ------
    ValueError
        If shapes differ, a value is not finite, or no voxel counts.
    """
    start, end = pair(before, after)
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

    Raises
    ------
    ValueError
        If a value is not finite, or there are fewer than three frames.
    """
    values = finite_array(series)
    if len(values) < 3:
        raise ValueError(f"flicker needs at least three frames, not {len(values)}")
    second = values[2:] - 2 * values[1:-1] + values[:-2]
    return relative(float(np.abs(second).mean()), float(np.abs(values).mean()))
