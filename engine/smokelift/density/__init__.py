"""Density from pictures: views, what is assumed of their depth, and the fit.

Observation -> ObservedView (observation) -> DepthEstimate (depth_prior) -> Start (temporal_prior)
-> FittedDensity (fit)

The default estimate (synthesis) is round, smooth smoke with detail: from every side it shows the distribution of
patches that the clip shows from the front. The fit has the last word.
"""

from smokelift.density.axis_cues import clip_axis
from smokelift.density.depth_prior import DepthEstimate, DepthPrior, Detail, RoundDepth
from smokelift.density.fit import (
    DensityFit,
    DensitySettings,
    FittedDensity,
    GradientFit,
    empty_density,
    reconstruct_density,
)
from smokelift.density.observation import Observation, ObservedClip, ObservedView, ViewSet
from smokelift.density.synthesis import DetailedDepth
from smokelift.density.temporal_prior import AdvectedDetail, NothingCarried, Start, TemporalPrior
from smokelift.density.upright_plane import AxisEstimate

__all__ = [
    "AdvectedDetail",
    "AxisEstimate",
    "DensityFit",
    "DensitySettings",
    "DepthEstimate",
    "DepthPrior",
    "Detail",
    "DetailedDepth",
    "FittedDensity",
    "GradientFit",
    "NothingCarried",
    "Observation",
    "ObservedClip",
    "ObservedView",
    "RoundDepth",
    "Start",
    "TemporalPrior",
    "ViewSet",
    "clip_axis",
    "empty_density",
    "reconstruct_density",
]
