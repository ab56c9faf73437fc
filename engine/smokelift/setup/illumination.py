"""The light of a shot, and how its smoke scatters it.

    what the scene gives, or the smoke's source radiance -> a light, the richest scattering it allows   first_light
    coarse densities in it -> the cheapest scattering that is as good                                   find_scattering

The second is judged by `coarse.held_out`. Figures: docs/selection.md.
"""

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np

from smokelift.checks import UNDETERMINED, Figures, Finding
from smokelift.extraction.element import SOURCE_SIDE, extract_element
from smokelift.extraction.fire import MIN_COLORED_VALUE
from smokelift.footage.images import Picture, channel_mean, reduced_size
from smokelift.footage.noise import Noise
from smokelift.render.environment import environment_count
from smokelift.scene import SCATTERINGS, SHADOWED, DirectionalLight, EnvironmentLight, Light, Medium, Scattering
from smokelift.setup.coarse import SCATTERING_TOLERANCE, CoarseFrame, held_out
from smokelift.setup.first_estimate import FirstEstimate, SmokeSamples
from smokelift.setup.geometry import Geometry
from smokelift.setup.medium import source_radiance
from smokelift.setup.settings import Settings

MAX_ERROR_RATIO = 0.75
"""Error of multiple over single scattering, below which multiple is taken. It is 0.01 to 0.63 for traced paths, unless
either model fits, and from 0.82 for light scattered once (docs/experiments/scattering.md)."""

MAX_DESCENT_STEPS = 64
"""Steps of descent of a fit where models differ little: enough for every fit to end by itself. One that is cut off has
the error of the steps that it lacks (docs/experiments/scattering.md)."""

MAX_LIGHT_ERROR = 0.12
"""Error of held-out pixels, as a fraction of the smoke's contrast, from which an assumed light before one color is
likely wrong: from there the mass was off by 1.5 and more in 38 of 42 clips, below in 34 of 86
(docs/experiments/unknown-light.md)."""

MAX_COLOR_SPREAD = 0.1
"""Largest spread of a background of one color, as a fraction of its brightness."""

MAX_QUIET_NOISE = 2 / 255
"""Largest noise, in sRGB values, that does not explain the error itself (docs/experiments/unknown-light.md)."""

LIT_PERCENTILE = 90
"""Percentile of what thick smoke sends that an assumed light has to reach: with 99 T of three composed clips is off by
.02 to .04 more, with 75 the picture of a real one loses 2 dB (measured)."""


def first_light(
    lights: tuple[Light, ...],
    scattering: Scattering | None,
    geometry: Geometry,
    medium: Medium,
    estimate: FirstEstimate,
) -> tuple[tuple[Light, ...], Scattering, list[Finding]]:
    """Return the lights of a scene, or one from everywhere without shadows, as strong as the clip shows.

    An environment gets the number of directions that stand for it. Returned next is the given model of scattering, or
    the richest that the lights allow. Where light is needed but not given, the findings say how bright it is.
    Shadows without a light to cast them are a ValueError.
    """
    if scattering in SHADOWED and not lights:
        raise ValueError(
            f'Scattering "{scattering}" needs a light that casts the shadows; give one, or leave scattering to "auto".'
        )
    richest = scattering or ("absorption" if medium.albedo == 0 else "single" if lights else "unshadowed")
    if lights or richest == "absorption":
        still, whole = geometry.camera.at(0), list(lights)
        for number, each in enumerate(lights):
            if isinstance(each, EnvironmentLight) and each.directions is None:
                count = environment_count(each, still, geometry.domain, medium)
                whole[number] = replace(each, directions=count)
        return tuple(whole), richest, []
    found, about = estimate.source, "source radiance"
    if found is None:
        source = source_radiance(estimate.samples)
        shown = Finding(f"undetermined {about}", about=about, value=UNDETERMINED, source="assumed")
    else:
        source = found * max(1.0, brightest_smoke(estimate, found) / float(found.mean()))
        red, green, blue = map(float, found)
        figures: Figures = {"red": red, "green": green, "blue": blue}
        shown = Finding(about, figures, about=about, value=(red, green, blue), source="measured")
    shown = replace(shown, figures={"taken": tuple(source.tolist()), **shown.figures})
    scattered = np.array(medium.albedos) / (4 * np.pi)
    red, green, blue = np.divide(source, scattered, out=np.zeros(3), where=scattered > 0).tolist()
    light = DirectionalLight((0.0, 0.0, -1.0), (red, green, blue))
    assumed = Finding("assumed light", {"irradiance": light.irradiance}, source="assumed")
    return (light,), richest, [assumed, shown]


def brightest_smoke(estimate: FirstEstimate, source: Picture) -> float:
    """Return the radiance that the brightest thick smoke of a frame sends, S of its element; 0 without any.

    ``source`` (3,) is the usual one. Without shadows no smoke is brighter than the light makes all of it.
    """
    clip, frame = estimate.clip, estimate.samples.smoky[0]
    picture, plate = clip.stored(frame).linear(), estimate.plate.at(frame)
    element = extract_element(picture, plate, source, reduced_size(*clip.size, SOURCE_SIDE))
    sent = channel_mean(element.radiance)[element.transmittance < 0.5]
    return float(np.percentile(sent, LIT_PERCENTILE)) if sent.size else 0.0


def light_doubts(scattering: Finding, samples: SmokeSamples, noise: Noise, *, burns: bool) -> list[Finding]:
    """A doubt if an assumed light leaves much unexplained; ``burns`` if there is fire.

    It is said only before one color that is not black. What moves there is smoke, and its brightness shows its light,
    so the light itself is at fault.
    """
    error = scattering.figures.get(f"error_{scattering.value}", 0.0)
    assert isinstance(error, float)
    if error < MAX_LIGHT_ERROR or not len(samples.behind) or noise.total.max() > MAX_QUIET_NOISE:
        return []
    low, high = np.percentile(samples.behind.max(-1), (5, 95))
    if high < MIN_COLORED_VALUE or high - low > MAX_COLOR_SPREAD * high:
        return []
    return [Finding("light of fire" if burns else "likely wrong light", {"error": error}, doubt=True)]


def find_scattering(
    frames: Sequence[CoarseFrame], finer: Callable[[], CoarseFrame | None], settings: Settings
) -> tuple[Scattering, Finding]:
    """Return the cheapest model of scattering that finds as good a density as the richest, which judges all.

    Single scattering is no special case of multiple scattering, which makes the same smoke brighter. Where both fit a
    picture, one is twice as dense as the other (docs/experiments/scattering.md). So multiple scattering is the
    richest only if it fits its own picture clearly better. Neither is the cheaper answer, so the tolerance of cheaper
    models does not apply. Errors are compared as a ratio, in which what no model fits counts for both.

    ``frames`` (one at least) have the richest model that their light allows. ``finer`` returns one of them on twice the
    voxels, or None; it is asked if the models are nearly alike on these.
    """
    fit, tolerance = settings.density, SCATTERING_TOLERANCE
    richest, isotropic = frames[0].scene.scattering, frames[0].scene.medium.anisotropy == 0.0
    candidates: tuple[Scattering, ...] = ("single", "multiple") if richest == "single" and isotropic else (richest,)
    errors = {each: held_out(frames, each, each, fit).error for each in candidates}
    if len(candidates) > 1:
        alike = errors["multiple"] >= MAX_ERROR_RATIO * errors["single"]
        # the errors may be the coarse grid's: either model seems to fit, or neither
        if alike and (larger := finer()) is not None and larger.scene.domain != frames[0].scene.domain:
            frames = [larger]
            fit = replace(fit, descent_iterations=max(MAX_DESCENT_STEPS, fit.descent_iterations))
            errors = {each: held_out(frames, each, each, fit).error for each in candidates}
        if errors["multiple"] < MAX_ERROR_RATIO * errors["single"]:
            richest = "multiple"
    chosen = richest
    cheaper = SCATTERINGS[SCATTERINGS.index(richest) + 1 :]
    for model in reversed(cheaper):
        errors[model] = min(held_out(frames, model, richest, fit).error, 1.0)  # which no smoke at all leaves
        if errors[model] <= errors[richest] + tolerance:
            chosen = model
            break
    figures: Figures = {**{f"error_{name}": value for name, value in errors.items()}, "tolerance": tolerance}
    found = Finding("scattering", figures, about="scattering", value=chosen, source="measured")
    if len(errors) == 1:
        return chosen, found
    # the one that it is compared with is the richest, or the next cheaper one if it is the richest itself
    other = cheaper[0] if chosen == richest else richest
    figures = {**figures, "error": errors[chosen], "other": other, "other_error": errors[other]}
    return chosen, replace(found, kind="compared scattering", figures=figures)
