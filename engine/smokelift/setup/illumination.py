"""The light of a shot and how its smoke scatters it, each question asked once, in the order in which they need answers.

    what the scene gives, or the smoke's source radiance -> a light, the richest scattering it allows   first_light
    coarse densities in it -> the cheapest scattering that is as good                                   find_scattering

The second is judged by `coarse.held_out`. Figures: docs/selection.md.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np

from smokelift.checks import Doubt, Figures, Remark
from smokelift.footage.noise import Noise
from smokelift.render.environment_count import environment_count
from smokelift.scene import SHADOWED, DirectionalLight, EnvironmentLight, Light, Medium, Scattering
from smokelift.setup.coarse import CoarseFrame, held_out
from smokelift.setup.estimate import Estimate
from smokelift.setup.first_estimate import SmokeSamples
from smokelift.setup.geometry import Geometry
from smokelift.setup.medium import MIN_SOURCE_VALUE, source_radiance
from smokelift.setup.settings import Settings
from smokelift.setup.thickness import smoke_thickness

MODELS: tuple[Scattering, ...] = ("absorption", "unshadowed", "single", "multiple")
"""Models of scattering, from the cheapest to the richest."""

MAX_ERROR_RATIO = 0.75
"""Error of multiple over single scattering below which it is taken: 0.01 to 0.63 where paths were traced, but for smoke
that either model fits, and 0.82 and more where light is scattered once (docs/experiments/scattering-selection.md)."""

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


def first_light(
    lights: tuple[Light, ...], scattering: Scattering | None, geometry: Geometry, medium: Medium, samples: SmokeSamples
) -> tuple[tuple[Light, ...], Scattering, tuple[Estimate[str], ...], tuple[Remark, ...]]:
    """Return the light of a scene, or one from everywhere without shadows as strong as the clip shows.

    Every environment gets the number of directions that stand for it.

    Returns
    -------
    The lights, the richest model of scattering that they allow, or the one that is given, and where light is needed and
    not given what is known of the smoke's thickness, and what is assumed.

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
    if lights or richest == "absorption":
        return tuple(_countable(each, geometry, medium) for each in lights), richest, (), ()
    source, thickness = smoke_thickness(samples.textures)
    share = np.array(medium.albedos) / (4 * np.pi)
    red, green, blue = np.divide(source_radiance(samples, source), share, out=np.zeros(3), where=share > 0).tolist()
    light = DirectionalLight((0.0, 0.0, -1.0), (red, green, blue))
    return (light,), richest, (thickness,), (Remark("assumed light", {"irradiance": light.irradiance}),)


def _countable(light: Light, geometry: Geometry, medium: Medium) -> Light:
    """The light, as so many directions if it is an environment."""
    if not isinstance(light, EnvironmentLight) or light.directions is not None:
        return light
    return replace(light, directions=environment_count(light, geometry.camera.at(0), geometry.domain, medium))


def light_doubts(scattering: Estimate[str], samples: SmokeSamples, noise: Noise, *, burns: bool) -> tuple[Doubt, ...]:
    """Whether a light that is not given is likely wrong, by what it leaves unexplained; ``burns`` says if fire does.

    Before one colour, and not black, what moves is smoke, and its brightness says something of its light: there what
    the light leaves unexplained is its own fault.
    """
    error = scattering.figures.get(f"error_{scattering.value}", 0.0)
    assert isinstance(error, float)
    if error < DOUBTFUL or not len(samples.behind) or noise.total.max() > MAX_QUIET_NOISE:
        return ()
    low, high = np.percentile(samples.behind.max(-1), (5, 95))
    if high < MIN_SOURCE_VALUE or high - low > MAX_COLOUR_SPREAD * high:
        return ()
    return (Doubt("light of fire" if burns else "likely wrong light", {"error": error}),)


def find_scattering(
    frames: Sequence[CoarseFrame], finer: Callable[[], CoarseFrame | None], settings: Settings
) -> tuple[Scattering, Estimate[str]]:
    """Return the cheapest model of scattering that finds as good a density as the richest, which judges all.

    Single scattering is no special case of multiple scattering, which makes the same smoke brighter. Of these two
    multiple scattering is the richest only where its own picture of its own density is clearly nearer: smoke whose
    picture both models fit is twice as dense in one as in the other (docs/experiments/multiple-scattering.md). Neither
    is the cheaper answer, so that the tolerance of cheaper models says nothing here: errors are compared as a ratio, in
    which what no model fits counts for both.

    Parameters
    ----------
    frames
        Those that models are tried on, one at least, with the richest model that their light allows.
    finer
        Returns one of them on twice the voxels, for models that are nearly alike on these; None if there is none.
    settings
        How to fit, and what errors a cheaper model may have.
    """
    fit, tolerance = settings.density, settings.selection.scattering_error
    richest, isotropic = frames[0].scene.scattering, frames[0].scene.medium.anisotropy == 0.0
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
    found: Estimate[str] = Estimate(
        "scattering", figures, what="scattering", value=chosen, source="measured", tolerance=tolerance
    )
    if len(errors) == 1:
        return chosen, found
    # beside the one that it is compared with: the richest, or of that the next cheaper one
    other = MODELS[MODELS.index(richest) - 1] if chosen == richest else richest
    figures = {**figures, "error": errors[chosen], "other": other, "other_error": errors[other]}
    return chosen, replace(found, kind="compared scattering", figures=figures)
