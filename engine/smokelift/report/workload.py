"""What of a shot decides what a run of it takes: above all how many voxels of its box may hold smoke."""

from __future__ import annotations

from dataclasses import dataclass, replace
from statistics import fmean

from smokelift.density import RoundDepth, ViewSet
from smokelift.setup.first_estimate import SAMPLE_FRAMES
from smokelift.setup.settings import Settings
from smokelift.setup.shot import Shot

MAX_SIDE_VOXELS = 96
"""Voxels along the longest side of the grid on which the smoke is found, at most: it takes a rim of one of them
with it, which makes shares up to two fifths too large (docs/experiments/memory-and-time.md)."""

LOOKED_AT = 4
"""Frames with smoke that are measured, from the one with the most on."""


@dataclass(frozen=True)
class Workload:
    """What decides what a run takes, besides the resolution.

    Attributes
    ----------
    settings
        As they are given: a velocity's grid that is chosen is coarse, and takes no memory to speak of.
    frames
        How many.
    views
        Cameras.
    pixels
        Of all their pictures of one moment.
    largest, mean
        Shares of the box's voxels that may hold smoke: in the frame with the most of it, and on the mean of all frames.
    """

    settings: Settings
    frames: int
    views: int
    pixels: int
    largest: float
    mean: float

    @staticmethod
    def of(shot: Shot, settings: Settings) -> Workload:
        """Measure the smoke of some frames of a shot that was prepared with settings, on a coarse grid."""
        shares = _shares(shot, settings)
        smoky = len(shot.smoky) / len(shot.spread(SAMPLE_FRAMES))
        return Workload(
            settings=settings,
            frames=shot.length,
            views=len(shot.views),
            pixels=sum(width * height for width, height in (view.clip.size for view in shot.views)),
            largest=max(shares, default=0.0),
            mean=smoky * fmean(shares) if shares else 0.0,
        )


def _shares(shot: Shot, settings: Settings) -> list[float]:
    """Shares of the voxels that may hold smoke, in some of the frames that show smoke."""
    if settings.method == "paper":  # its densities are anywhere in the box
        return [1.0]
    optics = replace(shot.optics, domain=shot.optics.domain.with_at_most(MAX_SIDE_VOXELS))
    prior = RoundDepth().of_clip(shot)
    step = -(-len(shot.smoky) // LOOKED_AT) or 1
    moments = ((frame, shot.observe(frame)) for frame in shot.smoky[::step])
    seen = [ViewSet.of(observations, optics, frame) for frame, observations in moments if observations]
    return [float(prior.estimate(views).views.hull.mean()) for views in seen]
