"""All that is chosen on coarse densities: the light, and the grids that velocities are estimated on."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cache
from typing import Any

import numpy as np

from smokelift.density import FittedDensity, reconstruct_density
from smokelift.footage.clip import Clip
from smokelift.footage.plate import Plates
from smokelift.scene import CompleteScene, Domain
from smokelift.setup.choice import Choice
from smokelift.setup.coarse import CoarseClip
from smokelift.setup.light_model import choose_light_model
from smokelift.setup.settings import Settings
from smokelift.setup.velocity_grid import choose_coarsening, choose_levels
from smokelift.velocity import VelocitySettings


@dataclass(frozen=True, eq=False)
class Model:
    """What was chosen.

    Attributes
    ----------
    scene
        With its model of scattering, a number of directions for each environment, and lights as strong as the clip
        needs.
    velocity
        With the grids that velocities are estimated on.
    choices
        All of them, with their figures.
    """

    scene: CompleteScene
    velocity: VelocitySettings
    choices: tuple[Choice[Any], ...]


def choose_model(
    clip: Clip,
    scene: CompleteScene,
    plates: Plates,
    smoky: Sequence[int],
    by_hand: bool,
    settings: Settings,
    guessed: bool,
) -> Model:
    """Choose all that is chosen on coarse densities.

    Parameters
    ----------
    clip
        The footage.
    scene
        Its scattering is the richest that the known light allows, or what the user says.
    plates
        Background of each frame.
    smoky
        Frames with smoke, those with the most first.
    by_hand
        Whether the user says how light is scattered.
    settings
        What they decide is taken.
    guessed
        Whether nothing tells the light, not even its strength.
    """
    coarsened = choose_coarsening(scene.domain, settings.velocity, settings.selection.velocity_side)
    velocity = replace(settings.velocity, coarsening=coarsened.chosen)
    coarse = CoarseClip(clip, scene, plates)
    tried = ((number, coarse.frame(number)) for number in tried_frames(smoky))
    frames = {number: frame for number, frame in tried if frame is not None and frame.shows_smoke}
    if not frames:
        return Model(scene, replace(velocity, levels=velocity.grids), ())
    light = choose_light_model(coarse, frames, by_hand, guessed, settings)

    @cache
    def density(number: int) -> FittedDensity | None:
        frame = coarse.frame(number)
        if frame is None:
            return None
        own = frame.in_light_of(light.scene).scattered_by(light.scene.scattering)
        return reconstruct_density(frame.picture, own.scene, settings=settings.density, plate=frame.plate)

    densities = [found for found in map(density, frames) if found is not None]
    # before the last frame, since something has to follow
    followed = sorted({min(number, len(clip) - 2) for number in frames if len(clip) > 1})
    levels = _levels(followed, density, next(iter(frames.values())).scene.domain, scene.domain, velocity)
    choices: tuple[Choice[Any], ...] = (
        _inside(densities, scene),
        *light.choices,
        _iterations(densities, settings),
        coarsened,
        levels,
    )
    return Model(light.scene, replace(velocity, levels=levels.chosen), choices)


def tried_frames(smoky: Sequence[int]) -> tuple[int, ...]:
    """Frames that models are tried on: the one with the most smoke, and one with a middling amount."""
    return tuple(dict.fromkeys((*smoky[:1], *smoky[len(smoky) // 2 : len(smoky) // 2 + 1])))


def _levels(
    numbers: Sequence[int],
    density: Callable[[int], FittedDensity | None],
    coarse: Domain,
    final: Domain,
    settings: VelocitySettings,
) -> Choice[int]:
    """How many grids velocities are estimated on, by the coarse densities of some frames and those after them."""
    if settings.levels is not None:
        reason = f"Velocity grids by hand: {settings.levels}."
        return Choice("velocity levels", settings.levels, reason, by_hand=True)
    ends = [(density(number), density(number + 1)) for number in numbers]
    pairs = [(before.density, after.density) for before, after in ends if before is not None and after is not None]
    return choose_levels(pairs, coarse, final, settings)


def _inside(densities: Sequence[FittedDensity], scene: CompleteScene) -> Choice[tuple[int, int, int]]:
    """The part of the box that is worked on."""
    share = float(np.mean([density.hull.mean() for density in densities]))
    reason = (
        f"Domain: only voxels that the picture allows to hold smoke are worked on, {share:.0%} of the box; frames "
        "without smoke cost nothing."
    )
    return Choice("domain", scene.domain.resolution, reason, {"hull_share": share})


def _iterations(densities: Sequence[FittedDensity], settings: Settings) -> Choice[int]:
    """How long a density is fitted."""
    fit = settings.density
    most = fit.fit_iterations + fit.descent_iterations
    used = float(np.mean([density.figures["iterations"] for density in densities]))
    by_hand = fit != Settings.preset(settings.quality, settings.method).density
    reason = (
        f"Iterations: until one lowers the error by less than {fit.tolerance:.0%} or noise is all that is left, "
        f"{used:.0f} on the coarse frames, {most} at most{' (by hand)' if by_hand else ''}."
    )
    return Choice("iterations", most, reason, {"iterations": used}, fit.tolerance, by_hand)
