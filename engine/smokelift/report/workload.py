"""What decides how much a run takes: above all, how many voxels of the box may hold smoke."""

from __future__ import annotations

from dataclasses import dataclass, replace
from statistics import fmean

from smokelift.density import RoundDepth, ViewSet
from smokelift.setup.first_estimate import SAMPLE_FRAMES
from smokelift.setup.settings import Settings
from smokelift.setup.shot import Shot

MAX_SIDE_VOXELS = 96
"""Largest number of voxels along a side of the grid that smoke is measured on. A rim of one voxel counts with it, which
makes shares up to two fifths too large (docs/experiments/memory-and-time.md)."""

LOOKED_AT = 4
"""Largest number of frames with smoke that are measured, from the one with the most on."""


@dataclass(frozen=True)
class Workload:
    """What decides how much a run takes, besides the resolution.

    Attributes
    ----------
    settings
        The given ones: a velocity's grid that is chosen is coarse, and hardly takes memory.
    frames, views, pixels
        Numbers: of frames, of cameras, and of pixels in all cameras' pictures of one moment.
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
        """Measure a shot that was prepared with settings."""
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
    """Shares of the voxels that may hold smoke, in some of the frames with smoke, on a coarse grid."""
    if settings.method == "paper":  # its densities are anywhere in the box
        return [1.0]
    optics = replace(shot.optics, domain=shot.optics.domain.with_at_most(MAX_SIDE_VOXELS))
    prior = RoundDepth().of_clip(shot)
    step = -(-len(shot.smoky) // LOOKED_AT) or 1
    moments = ((frame, shot.observe(frame)) for frame in shot.smoky[::step])
    seen = [ViewSet.of(observations, optics, frame) for frame, observations in moments if observations]
    return [float(prior.estimate(views).views.hull.mean()) for views in seen]
