"""The light as the coarse frames show it: how strong it is, how it is scattered, from where it comes.

Directions of environments, strength of the lights, model of scattering, light from the surroundings: in the order in
which one choice needs the other.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

from smokelift.scene import CompleteScene, Scattering
from smokelift.setup.choice import Choice
from smokelift.setup.coarse import CoarseClip, CoarseFrame
from smokelift.setup.directions import choose_directions
from smokelift.setup.light_strength import choose_strength, scaled
from smokelift.setup.scattering import choose_scattering, settled, tries_multiple, unclear
from smokelift.setup.settings import Settings
from smokelift.setup.surroundings import choose_surroundings


@dataclass(frozen=True, eq=False)
class LightModel:
    """The light that was chosen.

    Attributes
    ----------
    scene
        With its model of scattering, a number of directions for each environment, and lights as strong as the clip
        needs.
    choices
        With their figures.
    """

    scene: CompleteScene
    choices: tuple[Choice[Any], ...]


@dataclass(frozen=True, eq=False)
class _Scattered:
    """How strong the lights are, in multiples of the scene's, and how light is scattered."""

    factor: float
    strength: tuple[Choice[str], ...]
    scattering: Scattering
    choice: Choice[str]


def choose_light_model(
    clip: CoarseClip, frames: Mapping[int, CoarseFrame], by_hand: bool, guessed: bool, settings: Settings
) -> LightModel:
    """Choose how strong the light is, how it is scattered and, if nothing tells it, from where it comes.

    Parameters
    ----------
    clip
        Its scene's scattering is the richest that the known light allows, or what the user says.
    frames
        Those that models are tried on by their numbers, one at least.
    by_hand
        Whether the user says how light is scattered.
    guessed
        Whether nothing tells the light, not even its strength.
    settings
        How to fit, and what errors a cheaper model may have.
    """
    scene, fit = clip.scene, settings.density
    lit, directions = choose_directions(scene, list(frames.values()), fit)
    found = _scattered(clip, frames, lit, by_hand, settings)
    scene, lit = scaled(scene, found.factor), scaled(lit, found.factor)
    if by_hand:
        return LightModel(lit, (*found.strength, found.choice, *directions))
    seen = [frame.in_light_of(lit) for frame in frames.values()]
    scattering, choice = found.scattering, found.choice
    around = choose_surroundings(seen, choice, fit) if guessed else None
    if around is not None:
        lights, choice = around
        scattering, lit = "single", replace(lit, lights=lights)
    lit = replace(lit, scattering=scattering)
    if directions and scattering != scene.scattering:
        lit, directions = choose_directions(replace(scene, scattering=scattering), seen, fit)
    return LightModel(lit, (*found.strength, choice, *directions))


def _scattered(
    clip: CoarseClip,
    frames: Mapping[int, CoarseFrame],
    lit: CompleteScene,
    by_hand: bool,
    settings: Settings,
) -> _Scattered:
    """How strong the light of a scene is and how it is scattered."""
    said, fit = lit.scattering, settings.density
    exposed = [frame.in_light_of(lit) for frame in frames.values()]
    factor = 1.0
    strength: tuple[Choice[str], ...] = ()
    known: dict[Scattering, float] = {}
    # what single scattering lacks would be taken for light that is missing
    if said == "multiple" or (said == "single" and tries_multiple(lit) and not by_hand):
        alike = [frame.scattered_by("multiple") for frame in exposed]
        factor, known["multiple"], strength = choose_strength(alike, fit)
        exposed = [frame.in_light_of(scaled(frame.scene, factor)) for frame in exposed]
    if by_hand:
        chosen = Choice("scattering", said, f"Scattering by hand: {said}.", by_hand=True)
        return _Scattered(factor, strength, said, chosen)
    tolerance = settings.selection.scattering_error
    scattering, choice = choose_scattering(exposed, said, fit, tolerance, known)
    finer = clip.frame(next(iter(frames)), times=2) if unclear(choice) else None
    if finer is not None and finer.scene.domain != exposed[0].scene.domain:
        own = finer.in_light_of(exposed[0].scene)
        scattering, choice = choose_scattering([own], said, settled(fit), tolerance, {})
    return _Scattered(factor, strength, scattering, choice)
