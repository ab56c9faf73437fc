"""All that is chosen on coarse densities, in the order in which one choice needs the other."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cache

import numpy as np

from smokelift.density import Density, reconstruct_density
from smokelift.footage.clip import Clip
from smokelift.footage.matte import matte
from smokelift.footage.plate import Plate
from smokelift.scene import Scattering, Scene
from smokelift.setup.choice import Choice
from smokelift.setup.coarse import CoarseFrame, coarse_frame
from smokelift.setup.directions import choose_directions
from smokelift.setup.motion import choose_coarsening, choose_levels
from smokelift.setup.scattering import choose_scattering
from smokelift.setup.settings import Settings

FRAMES = 2
"""Frames that models are tried on: the one with the most smoke, and one with a middling amount."""


@dataclass(frozen=True, eq=False)
class Model:
    """What was chosen.

    Attributes
    ----------
    scene
        With a number of directions for each environment.
    scattering
        How light is scattered.
    coarsening, levels
        Of the grid of the velocity, and grids of one without a past.
    choices
        All of them, with their figures.
    """

    scene: Scene
    scattering: Scattering
    coarsening: int
    levels: int
    choices: tuple[Choice, ...]


def choose_model(
    clip: Clip,
    scene: Scene,
    plate_at: Callable[[int], Plate],
    smoky: Sequence[int],
    richest: Scattering,
    settings: Settings,
) -> Model:
    """Choose all that is chosen on coarse densities.

    Parameters
    ----------
    clip
        The footage.
    scene
        Complete.
    plate_at
        Background of each frame.
    smoky
        Frames with smoke, those with the most first.
    richest
        The richest model of scattering that the known light allows.
    settings
        What is said in them is taken.
    """

    @cache
    def coarse(number: int) -> CoarseFrame | None:
        assert scene.camera is not None
        return coarse_frame(clip.frame(number), scene.camera.at(number), scene, plate_at(number))

    def shows_smoke(number: int) -> bool:
        frame = coarse(number)
        return frame is not None and bool(matte(frame.picture, frame.plate).mask.any())

    by_hand = settings.density.scattering
    wanted: Scattering = richest if by_hand == "auto" else by_hand
    numbers = [number for number in _tried(smoky) if shows_smoke(number)]
    frames = [frame for frame in map(coarse, numbers) if frame is not None]
    assert scene.domain is not None
    halved = choose_coarsening(scene.domain, settings.velocity)
    assert isinstance(halved.chosen, int)
    if not frames:
        return Model(scene, wanted, halved.chosen, settings.velocity.grids, ())
    lit, directions = choose_directions(scene, frames, settings.density, wanted)
    frames = [frame.in_light_of(lit) for frame in frames]
    if by_hand == "auto":
        scattering, scattered = choose_scattering(frames, richest, settings.density)
        if directions and scattering != richest:
            lit, directions = choose_directions(scene, frames, settings.density, scattering)
    else:
        scattering, scattered = by_hand, Choice("scattering", by_hand, f"Scattering by hand: {by_hand}.", by_hand=True)
    fit = replace(settings.density, scattering=scattering)

    @cache
    def density(number: int) -> Density | None:
        frame = coarse(number)
        if frame is None:
            return None
        scene = frame.in_light_of(lit).scene
        return reconstruct_density(frame.picture, scene, settings=fit, plate=frame.plate)

    densities = [found for found in map(density, numbers) if found is not None]
    if settings.velocity.levels is None:
        # before the last frame, since something has to follow
        followed = sorted({min(number, len(clip) - 2) for number in numbers if len(clip) > 1})
        ends = [(density(number), density(number + 1)) for number in followed]
        pairs = [(before.values, after.values) for before, after in ends if before is not None and after is not None]
        velocity = replace(settings.velocity, coarsening=halved.chosen)
        moved = choose_levels(pairs, frames[0].scene, lit, velocity)
    else:
        said = settings.velocity.levels
        moved = Choice("velocity levels", said, f"Velocity grids by hand: {said}.", by_hand=True)
    assert isinstance(moved.chosen, int)
    choices = (_inside(densities, scene), scattered, *directions, _iterations(densities, settings), halved, moved)
    return Model(lit, scattering, halved.chosen, moved.chosen, choices)


def _tried(smoky: Sequence[int]) -> tuple[int, ...]:
    """Frames to measure on."""
    return tuple(dict.fromkeys((*smoky[:1], *smoky[len(smoky) // 2 : len(smoky) // 2 + 1])))


def _inside(densities: Sequence[Density], scene: Scene) -> Choice:
    """The part of the box that is worked on."""
    assert scene.domain is not None
    share = float(np.mean([density.hull.mean() for density in densities]))
    reason = (
        f"Domain: only voxels that the picture allows to hold smoke are worked on, {share:.0%} of the box; frames "
        "without smoke cost nothing."
    )
    return Choice("domain", scene.domain.resolution, reason, {"hull_share": share})


def _iterations(densities: Sequence[Density], settings: Settings) -> Choice:
    """How long a density is fitted."""
    fit = settings.density
    most = fit.fit_iterations + fit.descent_iterations
    used = float(np.mean([density.figures["iterations"] for density in densities]))
    usual = Settings.preset(settings.quality, settings.method).density
    by_hand = (fit.fit_iterations, fit.descent_iterations, fit.tolerance) != (
        usual.fit_iterations, usual.descent_iterations, usual.tolerance,
    )  # fmt: skip
    reason = (
        f"Iterations: until one lowers the error by less than {fit.tolerance:.0%} or noise is all that is left, "
        f"{used:.0f} on the coarse frames, {most} at most{' (by hand)' if by_hand else ''}."
    )
    return Choice("iterations", most, reason, {"iterations": used}, fit.tolerance, by_hand)
