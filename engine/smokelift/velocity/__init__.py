"""The velocity that carries one density into the next.

Two densities show how fast smoke moves along their gradient. The rest follows from a flow that is smooth and has no
divergence. The estimate minimizes (equations 11 to 13 of Cen et al., generalized)

    sum W (r + g . (u - u_k))^2 + R(u - u_p) + irrotational * sum outside the smoke of |curl u|^2

subject to div u = 0, over velocities u on voxel faces, in voxels per frame, with

    r = (after(x) - before(x - u_k(x))) / s       what the estimate so far, u_k, leaves unexplained
    g = grad (after(x) + before(x - u_k(x))) / 2s
    s = root mean square of |grad| inside the smoke
    W = 0 where smoke is known to enter, else 1
    u_p = t prediction + P(momentum)              both fitted with a few numbers (`fit_center`)
    R(v) = k (smoothness * sum |grad curl v|^2 + kinetic * sum |v|^2)

on one grid after a prediction, which is coarse in a reconstruction; else from a coarse grid to the one that is asked
for (`coarse_to_fine`). It is linearized anew after the first solve (`linearization`). Before and after are as
`prepare` makes them. Division by s makes every weight independent of the scales of density, space and time. k is
`UNEXPLAINED_FRACTION` over the fraction of the change that u_p leaves unexplained: it grows as u_p gets better.

Sources: Cen, Zhang, Liang (2023), Entropy 25, 1348, section 3.3; Eckert et al. (2019), ACM TOG 38(6), 239 (ScalarFlow).
"""

from typing import Any

import numpy as np
import numpy.typing as npt

from smokelift.checks import Mask, require_kind
from smokelift.scene import Side
from smokelift.transport import Velocity
from smokelift.velocity.coarse_to_fine import CoarseToFine, VelocitySettings
from smokelift.velocity.estimator import DensityPair, VelocityEstimator, predict_velocity
from smokelift.velocity.optical_flow import PicturePair
from smokelift.velocity.pyramid import refine
from smokelift.velocity.solver import PrimalDual, ProjectedCG, Solver


def estimate_velocity(
    before: npt.NDArray[np.floating[Any]],
    after: npt.NDArray[np.floating[Any]],
    dt: float,
    voxel_size: float,
    settings: VelocitySettings | None = None,
    *,
    closed: tuple[Side, ...] = (),
    inflow: Mask | None = None,
    prediction: Velocity | None = None,
) -> Velocity:
    """Estimate the velocity that carries one density into the next.

    Parameters
    ----------
    before, after
        Densities >= 0, shape (nx, ny, nz).
    dt
        Time between them in seconds.
    voxel_size
        Edge of a voxel in meters.
    settings
        See `VelocitySettings`.
    closed
        Sides of the box that are walls. None by default: the box of a video is cut out of the air around the
        smoke, which goes in and out through it freely. A floor, say, is ``("z-",)``.
    inflow
        True in voxels where smoke enters, shape (nx, ny, nz): no motion is taken from changes of density there. Inlets
        that are not marked are read as motion.
    prediction
        What the velocity should be near, such as `predict_velocity` of the frame before. How near is decided by how
        much of the change it explains; one that explains less than half is not used.

    Returns
    -------
    Velocity
        In m/s, without divergence, such that after(x) = before(x - u(x) dt). `figures` has ``iterations``, ``products``
        and ``projections`` of the whole estimate, the last ``residual`` of the solver, the ``divergence`` (max |div u|
        voxel size / max |u|) on the estimate's grid, the ``unexplained`` fraction of the change that the center of
        the regularizer leaves, the ``trust`` in the prediction and the ``dissipation``, the fraction of the smoke that
        dissolves in `dt`, below zero where all of it gets denser. Zero if there is no smoke, or none in one of the two,
        or no motion.

    Raises
    ------
    ValueError
        If shapes differ, a density is negative or not finite, `dt` or `voxel_size` is not positive, a side is unknown
        or the steps of the primal-dual splitting do not converge.

    Examples
    --------
    >>> import numpy as np
    >>> from smokelift import Domain, estimate_velocity
    >>> domain = Domain((-0.5, -0.5, 0), (0.5, 0.5, 1), (24, 24, 24))
    >>> x, y, z = domain.offsets((0, 0, 0.4))
    >>> before = np.exp(-(x**2 + y**2 + z**2) / 0.02)
    >>> after = np.roll(before, 1, axis=2)  # a voxel up in a frame
    >>> velocity = estimate_velocity(before, after, dt=1 / 24, voxel_size=domain.voxel_size)
    >>> round(float(velocity.centres()[12, 12, 10, 2]), 1)  # m/s
    1.0
    """
    require_kind(settings, VelocitySettings | None, "settings", "VelocitySettings (settings.velocity of a run's)")
    pair = DensityPair(before, after, dt, voxel_size, closed, inflow)
    found = CoarseToFine(settings or VelocitySettings()).estimate(pair, prediction)
    x, y, z = np.shape(before)
    return refine(found, (x, y, z))


__all__ = [
    "CoarseToFine",
    "DensityPair",
    "PicturePair",
    "PrimalDual",
    "ProjectedCG",
    "Solver",
    "Velocity",
    "VelocityEstimator",
    "VelocitySettings",
    "estimate_velocity",
    "predict_velocity",
]
