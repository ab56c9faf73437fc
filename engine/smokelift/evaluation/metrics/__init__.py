"""How near a result is to the truth: pictures, densities, velocities.

Every function refuses arrays of different shapes and values that are not finite with ValueError: a NaN that
slips into a mean is worse than no figure.
"""

from smokelift.evaluation.metrics.motion import flicker, mean_divergence, velocity_error, warp_error
from smokelift.evaluation.metrics.patches import PatchStatistics, mean_gradient
from smokelift.evaluation.metrics.pictures import psnr, ssim
from smokelift.evaluation.metrics.shapes import RayShapes
from smokelift.evaluation.metrics.volumes import height_mass_error, mass, volume_error

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
