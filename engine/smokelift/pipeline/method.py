"""A method of reconstruction: four parts, each of which can be exchanged, and whether optical flow is used.

The default and the paper's method are two compositions; an ablation is a third, by `dataclasses.replace`.
"""

from dataclasses import dataclass

from smokelift.baselines.paper_method import AllCarried, FixedRateDescent, OrthogonalCopy, PaperVelocity
from smokelift.checks import require_kind
from smokelift.density import (
    AdvectedDetail,
    DensityFit,
    DepthPrior,
    DetailedDepth,
    GradientFit,
    NothingCarried,
    RoundDepth,
    TemporalPrior,
)
from smokelift.setup.settings import Settings
from smokelift.velocity import CoarseToFine, VelocityEstimator


@dataclass(frozen=True)
class Method:
    """How a clip is reconstructed, part by part.

    Attributes
    ----------
    density_fit
        Finds a density that renders to the pictures.
    depth_prior
        What is assumed of the depth, which one picture leaves undetermined.
    velocity_estimator
        Finds the velocity between two densities, and predicts the next.
    temporal_prior
        What a frame takes over from the one before.
    optical_flow
        Whether the estimator gets the pictures, where one camera that stands still alone sees the smoke, to correct the
        velocity by the optical flow in them (`velocity.optical_flow`).
    """

    density_fit: DensityFit
    depth_prior: DepthPrior
    velocity_estimator: VelocityEstimator
    temporal_prior: TemporalPrior
    optical_flow: bool = True


def other_parts(method: Method, settings: Settings) -> dict[str, str | bool]:
    """The names of what stands for other parts in a method than the settings ask for, by part."""
    asked = _names(compose(settings))
    return {part: name for part, name in _names(method).items() if name != asked[part]}


def _names(method: Method) -> dict[str, str | bool]:
    return {part: of if isinstance(of, bool) else type(of).__name__ for part, of in vars(method).items()}


def compose(settings: Settings) -> Method:
    """The method that settings ask for."""
    require_kind(settings, Settings, "settings", "Settings (Settings.preset makes them)")
    if settings.method == "paper":
        return Method(FixedRateDescent(), OrthogonalCopy(), PaperVelocity(), AllCarried(), optical_flow=False)
    smooth = RoundDepth()
    return Method(
        density_fit=GradientFit(settings.density),
        depth_prior=DetailedDepth(smooth, settings.detail, settings.seed) if settings.detail > 0 else smooth,
        velocity_estimator=CoarseToFine(settings.velocity),
        temporal_prior=AdvectedDetail(settings.transport) if settings.transport > 0 else NothingCarried(),
    )
