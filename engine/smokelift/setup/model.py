"""What a run needs besides the light and is measured on coarse densities: the grids of velocities.

The part of the box and the iterations that these densities took are reported with them.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cache
from typing import Any

import numpy as np

from smokelift.density import FittedDensity, reconstruct_density
from smokelift.scene import CompleteScene, Domain
from smokelift.setup.coarse import CoarseClip, CoarseFrame
from smokelift.setup.estimate import Estimate, given, measured
from smokelift.setup.settings import Settings
from smokelift.setup.velocity_grid import choose_coarsening, choose_levels
from smokelift.velocity import VelocitySettings


@dataclass(frozen=True, eq=False)
class Model:
    """What was chosen.

    Attributes
    ----------
    velocity
        With the grids that velocities are estimated on.
    estimates
        With their figures.
    """

    velocity: VelocitySettings
    estimates: tuple[Estimate[Any], ...]


def choose_model(
    scene: CompleteScene, clip: CoarseClip, frames: Mapping[int, CoarseFrame], settings: Settings
) -> Model:
    """Choose what is measured on coarse densities.

    Parameters
    ----------
    scene
        In the light and with the model of scattering that were chosen.
    clip
        The input.
    frames
        Its frames that models are tried on, by their numbers.
    settings
        What they decide is taken.
    """
    coarsened = choose_coarsening(scene.domain, settings.velocity, settings.selection.velocity_side)
    velocity = replace(settings.velocity, coarsening=coarsened.value)
    if not frames:
        return Model(replace(velocity, levels=velocity.grids), ())

    @cache
    def density(number: int) -> FittedDensity | None:
        frame = clip.frame(number)
        if frame is None:
            return None
        own, seen = frame.lit_by(scene.lights).scattered_by(scene.scattering).scene, frame.views[0]
        return reconstruct_density(seen.picture, own, settings=settings.density, plate=seen.plate)

    densities = [found for found in map(density, frames) if found is not None]
    # before the last frame, since something has to follow
    length = len(clip.views[0].clip)
    followed = sorted({min(number, length - 2) for number in frames if length > 1})
    levels = _levels(followed, density, next(iter(frames.values())).scene.domain, scene.domain, velocity)
    chosen = (_inside(densities, scene), _iterations(densities, settings), coarsened, levels)
    return Model(replace(velocity, levels=levels.value), chosen)


def tried_frames(smoky: Sequence[int]) -> tuple[int, ...]:
    """Frames that models are tried on: the one with the most smoke, and one with a middling amount."""
    return tuple(dict.fromkeys((*smoky[:1], *smoky[len(smoky) // 2 : len(smoky) // 2 + 1])))


def _levels(
    numbers: Sequence[int],
    density: Callable[[int], FittedDensity | None],
    coarse: Domain,
    final: Domain,
    settings: VelocitySettings,
) -> Estimate[int]:
    """How many grids velocities are estimated on, by the coarse densities of some frames and those after them."""
    if settings.levels is not None:
        return given("velocity levels", settings.levels)
    ends = [(density(number), density(number + 1)) for number in numbers]
    pairs = [(before.density, after.density) for before, after in ends if before is not None and after is not None]
    return choose_levels(pairs, coarse, final, settings)


def _inside(densities: Sequence[FittedDensity], scene: CompleteScene) -> Estimate[tuple[int, int, int]]:
    """The part of the box that is worked on."""
    share = float(np.mean([density.hull.mean() for density in densities]))
    return measured("domain", scene.domain.resolution, {"hull_share": share})


def _iterations(densities: Sequence[FittedDensity], settings: Settings) -> Estimate[int]:
    """How long a density is fitted."""
    fit = settings.density
    most = fit.fit_iterations + fit.descent_iterations
    used = float(np.mean([density.figures["iterations"] for density in densities]))
    by_hand = fit != Settings.preset(settings.quality, settings.method).density
    return Estimate(
        "iterations",
        {"iterations": used},
        what="iterations",
        value=most,
        source="given" if by_hand else "measured",
        tolerance=fit.tolerance,
    )
