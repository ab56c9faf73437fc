"""How near a result is to the truth: pictures, densities, velocities.

Every function refuses with ValueError values that are not finite, since a NaN that slips into a mean is worse than no
figure; so it does arrays of other shapes than it says, a mask that counts nothing, and a size or a peak that is not
positive.
"""

from smokelift.evaluation.metrics.errors import (
    flicker,
    height_mass_error,
    mass,
    mean_divergence,
    psnr,
    ssim,
    velocity_error,
    volume_error,
    warp_error,
)
from smokelift.evaluation.metrics.patches import PatchStatistics, mean_gradient
from smokelift.evaluation.metrics.shapes import RayShapes

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
