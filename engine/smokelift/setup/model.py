"""All that is chosen on coarse densities, in the order in which one choice needs the other."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cache
from typing import Any

import numpy as np

from smokelift.density import Density, reconstruct_density
from smokelift.footage.clip import Clip
from smokelift.footage.matte import matte
from smokelift.footage.plate import Plates
from smokelift.scene import CompleteScene, Scattering
from smokelift.setup.choice import Choice
from smokelift.setup.coarse import LONGEST, CoarseFrame, coarse_frame
from smokelift.setup.directions import choose_directions
from smokelift.setup.flicker import STEADY, exposure_of, light_of
from smokelift.setup.light_strength import choose_strength, scaled
from smokelift.setup.scattering import choose_scattering, settled, tries_multiple, unclear
from smokelift.setup.settings import Settings
from smokelift.setup.surroundings import choose_surroundings
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


@dataclass(frozen=True, eq=False)
class _Scattered:
    """How strong the lights are, in multiples of the scene's, and how light is scattered."""

    factor: float
    strength: tuple[Choice[str], ...]
    scattering: Scattering
    choice: Choice[str]


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

    @cache
    def coarse(number: int, most_voxels: int = LONGEST) -> CoarseFrame | None:
        return coarse_frame(clip, number, scene.camera.at(number), scene, plates.at(number), most_voxels)

    def shows_smoke(number: int) -> bool:
        frame = coarse(number)
        return frame is not None and bool(matte(frame.picture, frame.plate).mask.any())

    def light(number: int) -> float:
        frame = coarse(number)
        return light_of(frame) if frame is not None else 0.0

    def exposure(number: int) -> float:
        return exposure_of(number, len(clip), light)

    numbers = [number for number in tried_frames(smoky) if shows_smoke(number)]
    frames = [frame for frame in map(coarse, numbers) if frame is not None]
    coarsened = choose_coarsening(scene.domain, settings.velocity, settings.selection.velocity_side)
    velocity = replace(settings.velocity, coarsening=coarsened.chosen)
    if not frames:
        return Model(scene, replace(velocity, levels=velocity.grids), ())
    lit, directions = choose_directions(scene, frames, settings.density)
    said = scene.scattering

    def scattered_with(gains: Sequence[float]) -> _Scattered:
        """How strong the light is and how it is scattered, where the frames are exposed by gains."""
        exposed = [frame.in_light_of(scaled(lit, gain)) for frame, gain in zip(frames, gains, strict=True)]
        known: dict[Scattering, float] = {}
        strength: tuple[Choice[str], ...] = ()
        factor = 1.0
        # what single scattering lacks would be taken for light that is missing
        if said == "multiple" or (said == "single" and tries_multiple(scene) and not by_hand):
            alike = [frame.scattered_by("multiple") for frame in exposed]
            factor, known["multiple"], strength = choose_strength(alike, settings.density)
            exposed = [frame.in_light_of(scaled(frame.scene, factor)) for frame in exposed]
        if by_hand:
            chosen = Choice("scattering", said, f"Scattering by hand: {said}.", by_hand=True)
            return _Scattered(factor, strength, said, chosen)
        tolerance = settings.selection.scattering_error
        found = choose_scattering(exposed, said, settings.density, tolerance, known)
        finer = coarse(numbers[0], 2 * LONGEST) if unclear(found[1]) else None
        if finer is not None and finer.scene.domain != frames[0].scene.domain:
            own = finer.in_light_of(exposed[0].scene)
            found = choose_scattering([own], said, settled(settings.density), tolerance, {})
        return _Scattered(factor, strength, *found)

    found = scattered_with([1.0] * len(frames))
    # more light than one frame's smoke can scatter once may be that frame's exposure
    if (found.strength or found.scattering == "multiple") and abs(exposure(numbers[0]) - 1) > STEADY:
        found = scattered_with([exposure(number) for number in numbers])
    scene, lit = scaled(scene, found.factor), scaled(lit, found.factor)
    frames = [frame.in_light_of(lit) for frame in frames]
    strength, scattering, scattered = found.strength, found.scattering, found.choice
    if not by_hand:
        around = choose_surroundings(frames, scattered, settings.density) if guessed else None
        if around is not None:
            lights, scattered = around
            scattering, lit = "single", replace(lit, lights=lights)
        lit = replace(lit, scattering=scattering)
        if directions and scattering != scene.scattering:
            lit, directions = choose_directions(replace(scene, scattering=scattering), frames, settings.density)

    @cache
    def density(number: int) -> Density | None:
        frame = coarse(number)
        if frame is None:
            return None
        own = frame.in_light_of(lit).scattered_by(lit.scattering)
        return reconstruct_density(frame.picture, own.scene, settings=settings.density, plate=frame.plate)

    densities = [found for found in map(density, numbers) if found is not None]
    if velocity.levels is None:
        # before the last frame, since something has to follow
        followed = sorted({min(number, len(clip) - 2) for number in numbers if len(clip) > 1})
        ends = [(density(number), density(number + 1)) for number in followed]
        pairs = [(before.values, after.values) for before, after in ends if before is not None and after is not None]
        moved = choose_levels(pairs, frames[0].scene.domain, scene.domain, velocity)
    else:
        levels = velocity.levels
        moved = Choice[int]("velocity levels", levels, f"Velocity grids by hand: {levels}.", by_hand=True)
    choices: tuple[Choice[Any], ...] = (
        _inside(densities, scene),
        *strength,
        scattered,
        *directions,
        _iterations(densities, settings),
        coarsened,
        moved,
    )
    return Model(lit, replace(velocity, levels=moved.chosen), choices)


def tried_frames(smoky: Sequence[int]) -> tuple[int, ...]:
    """Frames that models are tried on: the one with the most smoke, and one with a middling amount."""
    return tuple(dict.fromkeys((*smoky[:1], *smoky[len(smoky) // 2 : len(smoky) // 2 + 1])))


def _inside(densities: Sequence[Density], scene: CompleteScene) -> Choice[tuple[int, int, int]]:
    """The part of the box that is worked on."""
    share = float(np.mean([density.hull.mean() for density in densities]))
    reason = (
        f"Domain: only voxels that the picture allows to hold smoke are worked on, {share:.0%} of the box; frames "
        "without smoke cost nothing."
    )
    return Choice("domain", scene.domain.resolution, reason, {"hull_share": share})


def _iterations(densities: Sequence[Density], settings: Settings) -> Choice[int]:
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
