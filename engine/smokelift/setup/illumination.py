"""The light of a shot and how its smoke scatters it, each question asked once, in the order in which they need answers.

    what the scene gives, or the smoke's source radiance -> a light, the richest scattering it allows   first_light
    coarse densities in it -> its strength, the model of scattering, shadows without a known light      measured_light
    cameras around the smoke -> a sun where no light is given                                           sunlight

All but the first are judged by `smokelift.setup.held_out`. Figures: docs/selection.md.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from smokelift.density import DensitySettings
from smokelift.footage.noise import Noise
from smokelift.render import Image
from smokelift.render.environment_count import MIN_LIGHTS, TOLERANCE, lights_needed
from smokelift.scene import SHADOWED, DirectionalLight, EnvironmentLight, Light, Medium, Scattering
from smokelift.setup.choice import UNDETERMINED, Choice
from smokelift.setup.coarse import CoarseClip, CoarseFrame
from smokelift.setup.held_out import HalfFit, HeldOut, fit_half, held_out
from smokelift.setup.scattering import NEARER, WORDS, choose_scattering, tries_multiple
from smokelift.setup.settings import Settings
from smokelift.setup.sky import AMBIENT, EXPLAINED, SHADING, SPREAD, directional, find_sky, light_around
from smokelift.setup.smoke import SmokeSamples
from smokelift.setup.source import FAINTEST, source_radiance
from smokelift.setup.thickness import smoke_thickness

STEP = 1.25
"""Ratio of one strength of given lights to the next that is tried: smoke nearly as bright as its light allows differs
by as much in optical depth."""

STRONGEST = 8.0
"""Largest strength that is tried. Light given in other units than the picture's is a mistake, not a measurement."""

MISSING = 0.05
"""Light that may be missing before the given one is contradicted: blocks of multiple scattering are themselves up to as
much too dark (docs/experiments/multiple-scattering.md)."""

DOUBTFUL = 0.12
"""Error of held-out pixels, as a share of the smoke's contrast, from which the light that is taken before one colour is
likely wrong: from there on the mass was off by 1.5 and more in 38 of 42 clips, below in 34 of 86
(docs/experiments/surroundings.md)."""

EVEN = 0.1
"""Spread of a background of one colour at most, as a share of its mean."""

QUIET = 2 / 255
"""Noise up to which what is left is not the noise's."""


@dataclass(frozen=True, eq=False)
class Illumination:
    """The light of a shot and how its smoke scatters it.

    Attributes
    ----------
    lights
        Those of the scene, or one that stands for an unknown one.
    scattering
        The chosen model; until it is measured the richest that the light allows.
    origin
        Of the lights: the scene gives them (or none is needed), the clip shows how strong they are, or it does not.
    by_hand
        Whether the user gives the model of scattering.
    measured
        What was chosen on coarse densities.
    thickness, direction
        What is known of a light that is not given; None of a light that is.
    """

    lights: tuple[Light, ...]
    scattering: Scattering
    origin: Literal["given", "measured", "assumed"]
    by_hand: bool
    measured: tuple[Choice[Any], ...] = ()
    thickness: Choice[str] | None = None
    direction: Choice[str] | None = None

    @property
    def sunny(self) -> bool:
        """Whether the lights are those of a sun that was found."""
        return self.direction is not None and self.direction.chosen != UNDETERMINED

    @property
    def choices(self) -> tuple[Choice[Any], ...]:
        """All that was measured of it, if its model of scattering asks for light."""
        if self.thickness is None or self.direction is None or self.scattering == "absorption":
            return self.measured
        return (*self.measured, *(() if self.sunny else (self.thickness,)), self.direction)


def first_light(
    given: tuple[Light, ...], scattering: Scattering | None, medium: Medium, samples: SmokeSamples
) -> Illumination:
    """The light of a scene, or one from everywhere without shadows as strong as the clip shows.

    Raises
    ------
    ValueError
        If the user wants shadows without a light to cast them.
    """
    if scattering in SHADOWED and not given:
        raise ValueError(
            f'Scattering "{scattering}" needs a light that casts the shadows; give one in [[lights]], or leave it to '
            '"auto".'
        )
    richest = scattering or ("absorption" if medium.albedo == 0 else "single" if given else "unshadowed")
    by_hand = scattering is not None
    if given or richest == "absorption":
        return Illumination(given, richest, "given", by_hand)
    source, thickness = smoke_thickness(samples.textures)
    radiance = source_radiance(samples, source)
    share = np.array(medium.albedos) / (4 * np.pi)
    sun = directional(np.array((0.0, 0.0, 1.0)), np.divide(radiance, share, out=np.zeros(3), where=share > 0))
    unknown = Choice(
        "light direction",
        UNDETERMINED,
        "Light direction: undetermined, and so are the colour of a sun and the share of light from everywhere; suns "
        "from many sides explain one view alike. Give [[lights]] if you know them.",
    )
    origin: Literal["measured", "assumed"] = "assumed" if source is None else "measured"
    return Illumination((sun,), richest, origin, by_hand, (), thickness, unknown)


def measured_light(
    light: Illumination, clip: CoarseClip, frames: dict[int, CoarseFrame], settings: Settings
) -> Illumination:
    """Measure on coarse densities how strong the lights are and how they are scattered.

    Parameters
    ----------
    light
        With the richest model that is allowed, or the one that the user gives.
    clip
        With the scene's camera and medium.
    frames
        Those that models are tried on by their numbers, one at least.
    settings
        How to fit, and what errors a cheaper model may have.
    """
    fit, tolerance = settings.density, settings.selection.scattering_error
    richest, lights = light.scattering, light.lights
    seen = [frame.lit_by(lights).scattered_by(richest) for frame in frames.values()]
    lights, measured = _with_directions(lights, seen, fit)
    known: dict[Scattering, float] = {}
    # what single scattering lacks would be taken for light that is missing
    if richest == "multiple" or (richest == "single" and tries_multiple(clip.scene) and not light.by_hand):
        lights, known["multiple"], strength = _strengthened(lights, seen, fit)
        measured += strength
    if light.by_hand:
        choice = Choice("scattering", richest, f"Scattering by hand: {richest}.", by_hand=True)
        return replace(light, lights=lights, measured=(*measured, choice))
    seen = [frame.lit_by(lights) for frame in seen]

    def finer() -> CoarseFrame | None:
        return clip.frame(next(iter(frames)), times=2)

    chosen, choice = choose_scattering(seen, richest, fit, tolerance, known, finer)
    around = _surroundings(seen, choice, fit) if light.origin == "assumed" else None
    if around is not None:
        lights, choice = around
        chosen = "single"
    return replace(light, lights=lights, scattering=chosen, measured=(*measured, choice))


def sunlight(light: Illumination, clip: CoarseClip, numbers: Sequence[int], settings: Settings) -> Illumination:
    """The light with what several cameras around the smoke show of a sun, whose scattering is to be measured then.

    Parameters
    ----------
    light
        As it is measured.
    clip
        Of all cameras, none of which moves, at one exposure; in that light.
    numbers
        Of frames with smoke.
    settings
        How to fit.
    """
    if light.origin == "given" or light.by_hand or light.scattering == "absorption" or len(clip.views) < 2:
        return light
    frames = list(clip.smoky(numbers).values())
    sky = find_sky(frames, clip.scene, settings.density) if frames else None
    if sky is None:
        return light
    measured = {name: getattr(sky, name) for name in ("ambient_share", "shading", "explained", "spread")}
    if not sky.determined:
        reason = (
            "Light direction: undetermined, and so are the colour of a sun and the share of light from everywhere; the "
            f"{len(clip.views)} views are explained best with {sky.ambient_share:.0%} of the light from everywhere "
            f"({AMBIENT:.0%} at most would do); that alone leaves {sky.shading:.0%} of the smoke's light "
            f"({SHADING:.0%} at least would do), of which the sun explains {sky.explained:.0%} "
            f"({EXPLAINED:.0%} at least would do); its direction is right to {sky.spread:.0f} degrees "
            f"({SPREAD:g} at most would do). Give [[lights]] if you know them."
        )
        return replace(light, direction=Choice("light direction", UNDETERMINED, reason, measured, AMBIENT))
    named = ", ".join(f"{value:.2f}" for value in -sky.towards)
    reason = (
        f"Light direction: {named}, give or take 20 degrees, as the {len(clip.views)} views show together; "
        f"{sky.ambient_share:.0%} of the light comes from everywhere."
    )
    return Illumination(
        sky.lights(),
        "single",
        "measured",
        False,
        (),
        light.thickness,
        Choice("light direction", named, reason, measured, AMBIENT),
    )


def light_notes(light: Illumination, samples: SmokeSamples, noise: Noise) -> tuple[str, ...]:
    """Say what light is taken for one that is not given, and whether it is likely wrong.

    Before one colour, and not black, what moves is smoke, and its brightness says something of its light: there what
    the light leaves unexplained is its own fault.
    """
    if light.thickness is None or light.sunny:
        return ()
    shadows = light.scattering in SHADOWED
    if shadows:
        amount = "comes from behind the smoke"
    elif light.origin == "measured":
        amount = "the smoke adds for what it hides"
    else:
        amount = "the thickest smoke shows" if samples.smoky else "makes thick smoke white"
    irradiance = np.sum([each.irradiance for each in light.lights if isinstance(each, DirectionalLight)], 0)
    note = (
        f"Light not given: as much from everywhere as {amount}, "
        f"irradiance {', '.join(f'{v:.2f}' for v in irradiance)}, {'with' if shadows else 'without'} shadows."
    )
    scattered = next((choice for choice in light.measured if choice.what == "scattering"), None)
    error = 0.0 if scattered is None else scattered.measured.get(f"error_{scattered.chosen}", 0.0)
    if error < DOUBTFUL or not len(samples.behind) or noise.total.max() > QUIET:
        return (note,)
    low, high = np.percentile(samples.behind.max(-1), (5, 95))
    if high < FAINTEST or high - low > EVEN * high:
        return (note,)
    return (
        note,
        "The light that is taken is likely wrong, and the smoke too thick or too thin by half and more: it leaves "
        f"{error:.0%} of what the smoke changes unexplained. Give [[lights]] in a scene file.",
    )


def _with_directions(
    lights: tuple[Light, ...], frames: Sequence[CoarseFrame], settings: DensitySettings
) -> tuple[tuple[Light, ...], tuple[Choice[Any], ...]]:
    """Give every environment as many directions as change the picture of the clip's own smoke."""
    if not any(isinstance(light, EnvironmentLight) for light in lights):
        return lights, ()
    # without shadows the fewest do, since only the sum of the light counts
    few = tuple(
        replace(light, directions=light.directions or MIN_LIGHTS) if isinstance(light, EnvironmentLight) else light
        for light in lights
    )
    fitted = fit_half([frame.lit_by(few).scattered_by("unshadowed") for frame in frames], settings)
    scattering = frames[0].scene.scattering
    choices = {light: _directions(light, fitted, scattering) for light in lights if isinstance(light, EnvironmentLight)}
    found = (replace(light, directions=choices[light].chosen) if light in choices else light for light in lights)
    return tuple(found), tuple(choices.values())


def _directions(light: EnvironmentLight, fitted: HalfFit, scattering: Scattering) -> Choice[int]:
    """How many directions stand for an environment: their number doubles until the picture hardly changes."""
    if light.directions is not None:
        reason = f"Environment by hand: {light.directions} directions."
        return Choice("environment directions", light.directions, reason, by_hand=True)

    def picture(lights: tuple[DirectionalLight, ...]) -> Image:
        return np.concatenate(fitted.lit(lights, scattering)).astype(np.float32)

    count, change = lights_needed(light, picture)
    reason = f"Environment: {count} directions; the last doubling changed the picture by {change:.1%}."
    return Choice("environment directions", count, reason, {"change": change}, TOLERANCE)


def _strengthened(
    lights: tuple[Light, ...], frames: Sequence[CoarseFrame], settings: DensitySettings
) -> tuple[tuple[Light, ...], float, tuple[Choice[Any], ...]]:
    """Given lights as strong as the clip needs, and what multiple scattering leaves in them.

    Given lights are measured or tracked, and a picture hardly contradicts them: stronger light with thinner smoke fits
    it as well or better, since thin smoke is the simpler one to fit. So lights are too weak only where even the
    densities that fit best are too dark, and stronger light leaves less dark: more smoke would only hide what is behind
    it. Then the weakest light that leaves nothing dark is taken. Densities of thin smoke that are wrong otherwise stay
    as dark in any light.
    """

    def measured(factor: float) -> HeldOut:
        stronger = tuple(light.scaled(factor) for light in lights)
        return held_out([frame.lit_by(stronger) for frame in frames], "multiple", "multiple", settings)

    factor, found = 1.0, measured(1.0)
    given = found
    while found.light > 1 + MISSING and factor * STEP <= STRONGEST:
        stronger = measured(factor * STEP)
        if stronger.error >= found.error or stronger.light >= found.light:
            break
        factor, found = factor * STEP, stronger
    if factor == 1.0:
        return lights, given.error, ()
    reason = (
        f"Light: {factor:.2f} times as strong as given, since the smoke is brighter than the given light can make it: "
        f"the densities that come nearest ask for {given.light:.2f} times as much, and now for {found.light:.2f}."
    )
    figures = {"factor": factor, "asked_for": found.light, "asked_for_as_given": given.light, "error": found.error}
    choice = Choice("light strength", f"{factor:.3g}", reason, figures, 1 + MISSING)
    return tuple(light.scaled(factor) for light in lights), found.error, (choice,)


def _surroundings(
    frames: Sequence[CoarseFrame], scattered: Choice[str], settings: DensitySettings
) -> tuple[tuple[Light, ...], Choice[str]] | None:
    """Light from everywhere that casts shadows, where it explains the clip clearly better; None where it does not.

    Thick smoke has a lit side and a shaded one, which a light without shadows explains by thin smoke. What is behind
    the smoke is known, though, and it is a light as well: if as much comes from all sides, thin smoke is as bright as
    its background, and the thicker it is the darker by its own shadow. How strong it is no clip shows: weaker light
    finds thinner smoke with the same error. This is no richer model than smoke without
    shadows, so errors are compared as a ratio. Dark smoke before a bright sky stays dark
    (docs/experiments/surroundings.md).
    """
    error, tolerance = scattered.measured[f"error_{scattered.chosen}"], scattered.tolerance or 0.0
    views = [frame.views[0] for frame in frames]
    behind = np.concatenate([view.plate.image[view.smoke] for view in views]).mean(0, dtype=np.float64)
    if error <= tolerance or behind.max() < FAINTEST:
        return None

    def left(radiance: NDArray[np.float64]) -> HeldOut:
        return held_out([frame.lit_by(light_around(radiance)) for frame in frames], "single", "single", settings)

    radiance = behind / max(frames[0].scene.medium.albedos)
    # as bright, but of the colour that the clip asks for
    wanted = radiance * left(radiance).colours[0]
    coloured = wanted * radiance.mean() / max(wanted.mean(), 1e-30)
    found = left(coloured).error
    if not found < min(NEARER * error, error - tolerance):
        return None
    reason = (
        f"Scattering: {WORDS['single']}, in light from everywhere, for want of a known one; with "
        f"{WORDS[scattered.chosen]} held-out pixels differ by {error:.1%} of the smoke's contrast instead of "
        f"{found:.1%}."
    )
    measured = {**scattered.measured, "error_single": found}
    return light_around(coloured), Choice("scattering", "single", reason, measured, tolerance)
