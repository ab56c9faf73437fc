"""Density from pictures: views, what is assumed of their depth, and the fit.

Observation -> View (observation) -> DepthEstimate (depth_prior) -> Start (temporal_prior) -> Density (fit)
"""

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
from smokelift.density.temporal_prior import BlendCarried, NothingCarried, Start, TemporalPrior

__all__ = [
    "BlendCarried",
    "Density",
    "DensityFit",
    "DensitySettings",
    "DepthEstimate",
    "DepthPrior",
    "GradientFit",
    "ImposedView",
    "NothingCarried",
    "Observation",
    "ObservedClip",
    "RoundDepth",
    "Start",
    "TemporalPrior",
    "View",
    "ViewSet",
    "empty_density",
    "reconstruct_density",
]
