"""Density from pictures: views, what is assumed of their depth, and the fit.

Observation -> View (observation) -> DepthEstimate (depth_prior) -> Start (temporal_prior) -> Density (fit)

The default estimate (borrowed_moments) is round, smooth smoke with pictures of its sides, whose detail is that of other
moments of the clip. The fit meets them as far as the cameras' pictures allow.
"""

from smokelift.density.axis import AxisEstimate
from smokelift.density.borrowed_moments import BorrowedMoments
from smokelift.density.clip_axis import clip_axis
from smokelift.density.depth_prior import DepthEstimate, DepthPrior, ImposedView, RoundDepth
from smokelift.density.fit import (
    Density,
    DensityFit,
    DensitySettings,
    GradientFit,
    empty_density,
    reconstruct_density,
)
from smokelift.density.observation import Observation, ObservedClip, View, ViewSet
from smokelift.density.temporal_prior import BlendCarried, GuidedSimulation, NothingCarried, Start, TemporalPrior

__all__ = [
    "AxisEstimate",
    "BlendCarried",
    "BorrowedMoments",
    "Density",
    "DensityFit",
    "DensitySettings",
    "DepthEstimate",
    "DepthPrior",
    "GradientFit",
    "GuidedSimulation",
    "ImposedView",
    "NothingCarried",
    "Observation",
    "ObservedClip",
    "RoundDepth",
    "Start",
    "TemporalPrior",
    "View",
    "ViewSet",
    "clip_axis",
    "empty_density",
    "reconstruct_density",
]
