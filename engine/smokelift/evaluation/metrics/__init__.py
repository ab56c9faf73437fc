"""How near a result is to the truth: pictures, densities, velocities.

Every function refuses arrays of different shapes and values that are not finite with ValueError: a NaN that
slips into a mean is worse than no figure.
"""

from smokelift.evaluation.metrics.alignment import aligned_detail_correlation
from smokelift.evaluation.metrics.anisotropy import depth_anisotropy
from smokelift.evaluation.metrics.detail import (
    OCTAVES,
    detail_correlation,
    octave_power,
    octave_shares,
    row_constant_detail,
    spectrum_distance,
)
from smokelift.evaluation.metrics.motion import flicker, mean_divergence, velocity_error, warp_error
from smokelift.evaluation.metrics.optical_flow import PictureMotion, carried, optical_flow, picture_motion
from smokelift.evaluation.metrics.pictures import psnr, shifted_psnr, ssim
from smokelift.evaluation.metrics.volumes import height_mass_error, mass, volume_error

__all__ = [
    "OCTAVES",
    "PictureMotion",
    "aligned_detail_correlation",
    "carried",
    "depth_anisotropy",
    "detail_correlation",
    "flicker",
    "height_mass_error",
    "mass",
    "mean_divergence",
    "octave_power",
    "octave_shares",
    "optical_flow",
    "picture_motion",
    "psnr",
    "row_constant_detail",
    "shifted_psnr",
    "spectrum_distance",
    "ssim",
    "velocity_error",
    "volume_error",
    "warp_error",
]
