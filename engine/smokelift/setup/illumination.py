"""The light of a shot and how its smoke scatters it, each question asked once, in the order in which they need answers.

    what the scene gives, or the smoke's source radiance -> a light, the richest scattering it allows   first_light
    coarse densities in it -> the model of scattering, shadows without a known light                    measured_light

The second is judged by `coarse.held_out`. Figures: docs/selection.md.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from smokelift.checks import Doubt, Figures, Remark
from smokelift.checks.array_types import Doubles
from smokelift.density import DensitySettings
from smokelift.footage.noise import Noise
from smokelift.render.environment_count import environment_count
from smokelift.scene import SHADOWED, DirectionalLight, EnvironmentLight, Light, Medium, Scattering
from smokelift.setup.coarse import CoarseFrame, HeldOut, held_out
from smokelift.setup.estimate import Estimate, given, measured
from smokelift.setup.first_estimate import SmokeSamples
from smokelift.setup.geometry import Geometry
from smokelift.setup.medium import MIN_SOURCE_VALUE, source_radiance
from smokelift.setup.settings import Settings
from smokelift.setup.thickness import smoke_thickness

MODELS: tuple[Scattering, ...] = ("absorption", "unshadowed", "single", "multiple")
"""Models of scattering, from the cheapest to the richest."""

MAX_ERROR_RATIO = 0.75
"""Error of one model over that of another of which it is no special case, below which it is taken. Multiple over single
scattering: 0.01 to 0.63 where paths were traced, but for smoke that either model fits, and 0.82 and more where light
is scattered once (docs/experiments/scattering-selection.md)."""

MAX_DESCENT_STEPS = 64
"""Steps of descent that a fit may take where models are distinguished that differ little: enough for every fit to end
by itself. One that is cut off has the error of the steps which it lacks (docs/experiments/scattering-selection.md)."""

DOUBTFUL = 0.12
"""Error of held-out pixels, as a share of the smoke's contrast, from which the light that is taken before one colour is
likely wrong: from there on the mass was off by 1.5 and more in 38 of 42 clips, below in 34 of 86
(docs/experiments/surroundings.md)."""

MAX_COLOUR_SPREAD = 0.1
"""Spread of a background of one colour at most, as a share of its mean."""

MAX_QUIET_NOISE = 2 / 255
"""Noise up to which what is left is not the noise's (docs/experiments/surroundings.md)."""

AXES = ((1.0, 0.0, 0.0), (-1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, -1.0, 0.0), (0.0, 0.0, 1.0), (0.0, 0.0, -1.0))
"""Directions of travel that stand for all: 14 find no other density (docs/experiments/surroundings.md)."""


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
        Of the lights: the scene gives them (or none is needed), texture behind the smoke shows how strong they are, or
        nothing does.
    by_hand
        Whether the user gives the model of scattering.
    thickness
        What is known of the smoke's, where no light is given.
    chosen
        The model of scattering as an estimate, once it is measured.
    """

    lights: tuple[Light, ...]
    scattering: Scattering
    origin: Literal["given", "texture", "assumed"]
    by_hand: bool
    thickness: Estimate[str] | None = None
    chosen: Estimate[str] | None = None

    @property
    def estimates(self) -> tuple[Estimate[str], ...]:
        """All that was measured of it, if its model of scattering asks for light."""
        known = (self.chosen, None if self.scattering == "absorption" else self.thickness)
        return tuple(each for each in known if each is not None)


def first_light(
    lights: tuple[Light, ...], scattering: Scattering | None, geometry: Geometry, medium: Medium, samples: SmokeSamples
) -> Illumination:
    """Return the light of a scene, or one from everywhere without shadows as strong as the clip shows.

    Every environment gets the number of directions that stand for it.

    Raises
    ------
    ValueError
        If the user wants shadows without a light to cast them.
    """
    if scattering in SHADOWED and not lights:
        raise ValueError(
            f'Scattering "{scattering}" needs a light that casts the shadows; give one, or leave scattering to "auto".'
        )
    richest = scattering or ("absorption" if medium.albedo == 0 else "single" if lights else "unshadowed")
    by_hand = scattering is not None
    if lights or richest == "absorption":
        return Illumination(tuple(_countable(each, geometry, medium) for each in lights), richest, "given", by_hand)
    source, thickness = smoke_thickness(samples.textures)
    share = np.array(medium.albedos) / (4 * np.pi)
    red, green, blue = np.divide(source_radiance(samples, source), share, out=np.zeros(3), where=share > 0).tolist()
    sun = DirectionalLight((0.0, 0.0, -1.0), (red, green, blue))
    return Illumination((sun,), richest, "assumed" if source is None else "texture", by_hand, thickness)


def _countable(light: Light, geometry: Geometry, medium: Medium) -> Light:
    """The light, as so many directions if it is an environment."""
    if not isinstance(light, EnvironmentLight) or light.directions is not None:
        return light
    return replace(light, directions=environment_count(light, geometry.camera.at(0), geometry.domain, medium))


def measured_light(
    light: Illumination,
    frames: Sequence[CoarseFrame],
    finer: Callable[[], CoarseFrame | None],
    settings: Settings,
) -> Illumination:
    """Measure on coarse densities how light is scattered, and whether light that is not given casts shadows.

    Parameters
    ----------
    light
        With the richest model that is allowed, or the one that the user gives.
    frames
        Those that models are tried on, one at least, in that light and with that model.
    finer
        Returns one of them on twice the voxels, for models that are nearly alike on these; None if there is none.
    settings
        How to fit, and what errors a cheaper model may have.
    """
    if light.by_hand:
        return replace(light, chosen=given("scattering", light.scattering))
    scattering, chosen = _cheapest(frames, light.scattering, finer, settings)
    around = _surroundings(frames, chosen, settings.density) if light.origin == "assumed" else None
    if around is not None:
        return replace(light, lights=around[0], scattering="single", chosen=around[1])
    return replace(light, scattering=scattering, chosen=chosen)


def light_around(radiance: Doubles) -> tuple[DirectionalLight, ...]:
    """Return light from everywhere of a radiance (3,), in W/m^2/sr."""
    red, green, blue = (4 * np.pi * radiance / len(AXES)).tolist()
    return tuple(DirectionalLight(way, (red, green, blue)) for way in AXES)


def light_remarks(light: Illumination, samples: SmokeSamples, noise: Noise, *, burns: bool) -> tuple[Remark, ...]:
    """What light is taken for one that is not given, and whether it is likely wrong; ``burns`` says if fire does.

    Before one colour, and not black, what moves is smoke, and its brightness says something of its light: there what
    the light leaves unexplained is its own fault.
    """
    if light.origin == "given":
        return ()
    red, green, blue = np.sum([each.irradiance for each in light.lights if isinstance(each, DirectionalLight)], 0)
    taken = Remark("assumed light", {"irradiance": (float(red), float(green), float(blue))})
    error = 0.0 if light.chosen is None else light.chosen.figures.get(f"error_{light.chosen.value}", 0.0)
    assert isinstance(error, float)
    if error < DOUBTFUL or not len(samples.behind) or noise.total.max() > MAX_QUIET_NOISE:
        return (taken,)
    low, high = np.percentile(samples.behind.max(-1), (5, 95))
    if high < MIN_SOURCE_VALUE or high - low > MAX_COLOUR_SPREAD * high:
        return (taken,)
    return taken, Doubt("light of fire" if burns else "likely wrong light", {"error": error})


def _cheapest(
    frames: Sequence[CoarseFrame],
    richest: Scattering,
    finer: Callable[[], CoarseFrame | None],
    settings: Settings,
) -> tuple[Scattering, Estimate[str]]:
    """The cheapest model of scattering that finds as good a density as the richest, which judges all.

    Single scattering is no special case of multiple scattering, which makes the same smoke brighter. Of these two
    multiple scattering is the richest only where its own picture of its own density is clearly nearer: smoke whose
    picture both models fit is twice as dense in one as in the other (docs/experiments/multiple-scattering.md). Neither
    is the cheaper answer, so that the tolerance of cheaper models says nothing here: errors are compared as a ratio, in
    which what no model fits counts for both.
    """
    fit, tolerance = settings.density, settings.selection.scattering_error
    isotropic = frames[0].scene.medium.anisotropy == 0.0
    rivals: tuple[Scattering, ...] = ("single", "multiple") if richest == "single" and isotropic else (richest,)
    errors = {each: held_out(frames, each, each, fit).error for each in rivals}
    if len(rivals) > 1:
        alike = errors["multiple"] >= MAX_ERROR_RATIO * errors["single"]
        # the errors may be those of the coarse grid: either model seems to fit the smoke, or neither does
        if alike and (larger := finer()) is not None and larger.scene.domain != frames[0].scene.domain:
            frames = [larger]
            fit = replace(fit, descent_iterations=max(MAX_DESCENT_STEPS, fit.descent_iterations))
            errors = {each: held_out(frames, each, each, fit).error for each in rivals}
        if errors["multiple"] < MAX_ERROR_RATIO * errors["single"]:
            richest = "multiple"
    chosen = richest
    for model in MODELS[: MODELS.index(richest)]:
        errors[model] = min(held_out(frames, model, richest, fit).error, 1.0)  # which no smoke at all leaves
        if errors[model] <= errors[richest] + tolerance:
            chosen = model
            break
    figures: Figures = {f"error_{name}": value for name, value in errors.items()}
    if len(errors) == 1:
        return chosen, measured("scattering", chosen, figures, tolerance=tolerance)
    # beside the one that it is compared with: the richest, or of that the next cheaper one
    other = MODELS[MODELS.index(richest) - 1] if chosen == richest else richest
    figures = {**figures, "error": errors[chosen], "other": other, "other_error": errors[other]}
    return chosen, measured("compared scattering", chosen, figures, what="scattering", tolerance=tolerance)


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

    def left(radiance: Doubles) -> HeldOut:
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
