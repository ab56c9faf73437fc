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

from smokelift.checks import Doubt, Figures, Remark
from smokelift.density import DensitySettings
from smokelift.footage.noise import Noise
from smokelift.render import Image
from smokelift.render.environment_count import MIN_LIGHTS, TOLERANCE, lights_needed
from smokelift.scene import SHADOWED, DirectionalLight, EnvironmentLight, Light, Medium, Scattering
from smokelift.setup.coarse import CoarseClip, CoarseFrame
from smokelift.setup.estimate import UNDETERMINED, Estimate, given, measured, undetermined
from smokelift.setup.held_out import HalfFit, HeldOut, fit_half, held_out
from smokelift.setup.scattering import MAX_ERROR_RATIO, choose_scattering, tries_multiple
from smokelift.setup.settings import Settings
from smokelift.setup.sky import AMBIENT, directional, find_sky, light_around
from smokelift.setup.smoke import SmokeSamples
from smokelift.setup.source import MIN_SOURCE_VALUE, source_radiance
from smokelift.setup.thickness import smoke_thickness

STEP = 1.25
"""Ratio of one strength of given lights to the next that is tried: smoke nearly as bright as its light allows differs
by as much in optical depth."""

MAX_STRENGTH = 8.0
"""Largest strength that is tried. Light given in other units than the picture's is a mistake, not a measurement."""

MAX_MISSING_LIGHT = 0.05
"""Light that may be missing before the given one is contradicted: blocks of multiple scattering are themselves up to as
much too dark (docs/experiments/multiple-scattering.md)."""

DOUBTFUL = 0.12
"""Error of held-out pixels, as a share of the smoke's contrast, from which the light that is taken before one colour is
likely wrong: from there on the mass was off by 1.5 and more in 38 of 42 clips, below in 34 of 86
(docs/experiments/surroundings.md)."""

MAX_COLOUR_SPREAD = 0.1
"""Spread of a background of one colour at most, as a share of its mean."""

MAX_QUIET_NOISE = 2 / 255
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
    measured: tuple[Estimate[Any], ...] = ()
    thickness: Estimate[str] | None = None
    direction: Estimate[str] | None = None

    @property
    def sunny(self) -> bool:
        """Whether the lights are those of a sun that was found."""
        return self.direction is not None and self.direction.value != UNDETERMINED

    @property
    def estimates(self) -> tuple[Estimate[Any], ...]:
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
            f'Scattering "{scattering}" needs a light that casts the shadows; give one, or leave scattering to "auto".'
        )
    richest = scattering or ("absorption" if medium.albedo == 0 else "single" if given else "unshadowed")
    by_hand = scattering is not None
    if given or richest == "absorption":
        return Illumination(given, richest, "given", by_hand)
    source, thickness = smoke_thickness(samples.textures)
    radiance = source_radiance(samples, source)
    share = np.array(medium.albedos) / (4 * np.pi)
    sun = directional(np.array((0.0, 0.0, 1.0)), np.divide(radiance, share, out=np.zeros(3), where=share > 0))
    unknown = undetermined("light direction undetermined by one view", "light direction")
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
    lights, found = _with_directions(lights, seen, fit)
    known: dict[Scattering, float] = {}
    # what single scattering lacks would be taken for light that is missing
    if richest == "multiple" or (richest == "single" and tries_multiple(clip.scene) and not light.by_hand):
        lights, known["multiple"], strength = _strengthened(lights, seen, fit)
        found += strength
    if light.by_hand:
        return replace(light, lights=lights, measured=(*found, given("scattering", richest)))
    seen = [frame.lit_by(lights) for frame in seen]

    def finer() -> CoarseFrame | None:
        return clip.frame(next(iter(frames)), times=2)

    chosen, scattered = choose_scattering(seen, richest, fit, tolerance, known, finer)
    around = _surroundings(seen, scattered, fit) if light.origin == "assumed" else None
    if around is not None:
        lights, scattered = around
        chosen = "single"
    return replace(light, lights=lights, scattering=chosen, measured=(*found, scattered))


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
    figures = {
        "views": len(clip.views),
        "ambient_share": sky.ambient_share,
        "shading": sky.shading,
        "explained": sky.explained,
    }
    if not sky.determined:
        kind = "light direction undetermined by several views"
        unknown = undetermined(kind, "light direction", figures, spread=sky.spread, tolerance=AMBIENT)
        return replace(light, direction=unknown)
    named = ", ".join(f"{value:.2f}" for value in -sky.towards)
    direction = measured("light direction", named, figures, spread=sky.spread, tolerance=AMBIENT)
    return Illumination(sky.lights(), "single", "measured", False, (), light.thickness, direction)


def light_remarks(light: Illumination, samples: SmokeSamples, noise: Noise, *, burns: bool) -> tuple[Remark, ...]:
    """What light is taken for one that is not given, and whether it is likely wrong; ``burns`` says if fire does.

    Before one colour, and not black, what moves is smoke, and its brightness says something of its light: there what
    the light leaves unexplained is its own fault.
    """
    if light.thickness is None or light.sunny:
        return ()
    if light.scattering in SHADOWED:
        kind = "light as behind the smoke"
    elif light.origin == "measured":
        kind = "light as the smoke hides"
    else:
        kind = "light as the thickest smoke" if samples.smoky else "light without smoke"
    red, green, blue = np.sum([each.irradiance for each in light.lights if isinstance(each, DirectionalLight)], 0)
    taken = Remark(kind, {"irradiance": (float(red), float(green), float(blue))})
    scattered = next((each for each in light.measured if each.what == "scattering"), None)
    error = 0.0 if scattered is None else scattered.figures.get(f"error_{scattered.value}", 0.0)
    assert isinstance(error, float)
    if error < DOUBTFUL or not len(samples.behind) or noise.total.max() > MAX_QUIET_NOISE:
        return (taken,)
    low, high = np.percentile(samples.behind.max(-1), (5, 95))
    if high < MIN_SOURCE_VALUE or high - low > MAX_COLOUR_SPREAD * high:
        return (taken,)
    return taken, Doubt("light of fire" if burns else "likely wrong light", {"error": error})


def _with_directions(
    lights: tuple[Light, ...], frames: Sequence[CoarseFrame], settings: DensitySettings
) -> tuple[tuple[Light, ...], tuple[Estimate[Any], ...]]:
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
    found = {light: _directions(light, fitted, scattering) for light in lights if isinstance(light, EnvironmentLight)}
    taken = (replace(light, directions=found[light].value) if light in found else light for light in lights)
    return tuple(taken), tuple(found.values())


def _directions(light: EnvironmentLight, fitted: HalfFit, scattering: Scattering) -> Estimate[int]:
    """How many directions stand for an environment: their number doubles until the picture hardly changes."""
    if light.directions is not None:
        return given("environment directions", light.directions)

    def picture(lights: tuple[DirectionalLight, ...]) -> Image:
        return np.concatenate(fitted.lit(lights, scattering)).astype(np.float32)

    count, change = lights_needed(light, picture)
    return measured("environment directions", count, {"change": change}, tolerance=TOLERANCE)


def _strengthened(
    lights: tuple[Light, ...], frames: Sequence[CoarseFrame], settings: DensitySettings
) -> tuple[tuple[Light, ...], float, tuple[Estimate[Any], ...]]:
    """Given lights as strong as the clip needs, and what multiple scattering leaves in them.

    Given lights are measured or tracked, and a picture hardly contradicts them: stronger light with thinner smoke fits
    it as well or better, since thin smoke is the simpler one to fit. So lights are too weak only where even the
    densities that fit best are too dark, and stronger light leaves less dark: more smoke would only hide what is behind
    it. Then the weakest light that leaves nothing dark is taken. Densities of thin smoke that are wrong otherwise stay
    as dark in any light.
    """

    def tried(factor: float) -> HeldOut:
        stronger = tuple(light.scaled(factor) for light in lights)
        return held_out([frame.lit_by(stronger) for frame in frames], "multiple", "multiple", settings)

    factor, found = 1.0, tried(1.0)
    as_given = found
    while found.light > 1 + MAX_MISSING_LIGHT and factor * STEP <= MAX_STRENGTH:
        stronger = tried(factor * STEP)
        if stronger.error >= found.error or stronger.light >= found.light:
            break
        factor, found = factor * STEP, stronger
    if factor == 1.0:
        return lights, as_given.error, ()
    figures = {"factor": factor, "asked_for": found.light, "asked_for_as_given": as_given.light, "error": found.error}
    strength = measured("light strength", f"{factor:.3g}", figures, tolerance=1 + MAX_MISSING_LIGHT)
    return tuple(light.scaled(factor) for light in lights), found.error, (strength,)


def _surroundings(
    frames: Sequence[CoarseFrame], scattered: Estimate[str], settings: DensitySettings
) -> tuple[tuple[Light, ...], Estimate[str]] | None:
    """Light from everywhere that casts shadows, where it explains the clip clearly better; None where it does not.

    Thick smoke has a lit side and a shaded one, which a light without shadows explains by thin smoke. What is behind
    the smoke is known, though, and it is a light as well: if as much comes from all sides, thin smoke is as bright as
    its background, and the thicker it is the darker by its own shadow. How strong it is no clip shows: weaker light
    finds thinner smoke with the same error. This is no richer model than smoke without
    shadows, so errors are compared as a ratio. Dark smoke before a bright sky stays dark
    (docs/experiments/surroundings.md).
    """
    error, tolerance = scattered.figures[f"error_{scattered.value}"], scattered.tolerance or 0.0
    assert isinstance(error, float)
    views = [frame.views[0] for frame in frames]
    behind = np.concatenate([view.plate.image[view.smoke] for view in views]).mean(0, dtype=np.float64)
    if error <= tolerance or behind.max() < MIN_SOURCE_VALUE:
        return None

    def left(radiance: NDArray[np.float64]) -> HeldOut:
        return held_out([frame.lit_by(light_around(radiance)) for frame in frames], "single", "single", settings)

    radiance = behind / max(frames[0].scene.medium.albedos)
    # as bright, but of the colour that the clip asks for
    wanted = radiance * left(radiance).colours[0]
    coloured = wanted * radiance.mean() / max(wanted.mean(), 1e-30)
    found = left(coloured).error
    if not found < min(MAX_ERROR_RATIO * error, error - tolerance):
        return None
    compared: Figures = {"error": found, "error_single": found, "other": scattered.value, "other_error": error}
    return light_around(coloured), replace(
        scattered,
        kind="scattering in light from everywhere",
        figures={**scattered.figures, **compared},
        value="single",
    )
