"""How light is scattered: the cheapest model that finds as good a density as the richest.

    absorption -> unshadowed -> single (with self-shadowing) -> multiple

A wrong model can still reproduce its own picture: before black, unshadowed smoke fits any picture by being too thin in
shadow. So every model fits a coarse density to one half of the clip's pixels, and the
richest one, which holds the others as special cases, shows that density; the error of the other half says how good it
is. Where smoke is brighter than its background, absorption is not even tried.

Single scattering is no special case of multiple scattering, which makes the same smoke brighter. Of these two multiple
scattering is the richest only where its own picture of its own density is clearly nearer: smoke whose picture both
models meet is twice as dense in one as in the other (docs/experiments/multiple-scattering.md). Neither is the cheaper
answer, so that the tolerance of cheaper models says nothing here: errors are compared as a ratio, in which what no
model meets counts for both.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from smokelift.density import DensitySettings, reconstruct_density
from smokelift.density.hull import project_voxels, reached
from smokelift.footage.matte import matte
from smokelift.render import scene_optics
from smokelift.scene import CompleteScene, Scattering
from smokelift.setup.choice import Choice
from smokelift.setup.coarse import CoarseFrame

MODELS: tuple[Scattering, ...] = ("absorption", "unshadowed", "single", "multiple")
"""From the cheapest to the richest."""

NEARER = 0.75
"""Error of multiple scattering over that of single scattering, below which light is scattered many times: 0.01 to 0.63
where paths were traced, but for smoke that either model meets, and 0.82 and more where light is scattered once
(docs/experiments/scattering-selection.md)."""

CLEAR = 0.5
"""The same ratio, above which the errors may be those of the coarse grid: then either model seems to meet the smoke, or
neither does (docs/experiments/scattering-selection.md)."""

SETTLED = 64
"""Steps of descent that a fit may take where models are told apart that differ little: enough for every fit to end by
itself. One that is cut off has the error of the steps which it lacks (docs/experiments/scattering-selection.md)."""

WORDS: Mapping[str, str] = {
    "absorption": "absorption only",
    "unshadowed": "scattering without shadows",
    "single": "single scattering with shadows",
    "multiple": "multiple scattering",
}


def choose_scattering(
    frames: Sequence[CoarseFrame],
    richest: Scattering,
    settings: DensitySettings,
    tolerance: float,
    known: Mapping[Scattering, float],
) -> tuple[Scattering, Choice[str]]:
    """Choose the model of scattering.

    Parameters
    ----------
    frames
        At least one; the lights of their scenes are finite.
    richest
        What the light that is known allows: shadows need its direction. Where it is single scattering by isotropic
        smoke, multiple scattering is tried too.
    settings
        How to fit.
    tolerance
        Error, as a share of what the smoke changes in the picture, that a cheaper model may add.
    known
        `HeldOut.error` of models, each of its own densities, as far as it is measured already.
    """

    def own_error(model: Scattering) -> float:
        if model in known:
            return known[model]
        return held_out(frames, model, model, settings).error

    errors = {richest: own_error(richest)}
    if richest == "single" and tries_multiple(frames[0].scene):
        errors["multiple"] = own_error("multiple")
        if errors["multiple"] < NEARER * errors["single"]:
            richest = "multiple"
    chosen = richest
    for model in MODELS[: MODELS.index(richest)]:
        if model == "absorption" and (brightened := _brightened(frames)) > errors[richest] + tolerance:
            errors[model] = brightened
            continue
        errors[model] = held_out(frames, model, richest, settings).error
        if errors[model] <= errors[richest] + tolerance:
            chosen = model
            break
    return chosen, _choice(chosen, richest, errors, tolerance)


def unclear(choice: Choice[str]) -> bool:
    """Whether single and multiple scattering were so nearly alike that finer frames have to tell them apart."""
    errors = choice.measured
    return "error_multiple" in errors and errors["error_multiple"] > CLEAR * errors["error_single"]


def settled(settings: DensitySettings) -> DensitySettings:
    """Settings for fits that are compared with each other where they differ little."""
    return replace(settings, descent_iterations=max(SETTLED, settings.descent_iterations))


def tries_multiple(scene: CompleteScene) -> bool:
    """Whether multiple scattering is tried where single scattering is allowed: smoke that is isotropic has it."""
    return scene.medium.anisotropy == 0.0


def _choice(
    chosen: Scattering, richest: Scattering, errors: Mapping[Scattering, float], tolerance: float
) -> Choice[str]:
    said = f"Scattering: {WORDS[chosen]}"
    if chosen != richest:
        reason = (
            f"{said}; held-out pixels differ by {errors[chosen]:.1%} of the smoke's contrast, with {WORDS[richest]} "
            f"by {errors[richest]:.1%}."
        )
    elif len(errors) > 1:
        cheaper = MODELS[MODELS.index(richest) - 1]
        reason = (
            f"{said}; with {WORDS[cheaper]} held-out pixels differ by {errors[cheaper]:.1%} of the smoke's contrast "
            f"instead of {errors[richest]:.1%}."
        )
    else:
        reason = f"{said}."
    return Choice("scattering", chosen, reason, {f"error_{name}": value for name, value in errors.items()}, tolerance)


def _brightened(frames: Sequence[CoarseFrame]) -> float:
    """Share of what the smoke changes that is brighter than the background: the least error of absorption."""
    brighter = change = 0.0
    for frame in frames:
        smoke = matte(frame.picture, frame.plate).mask
        difference = (frame.halves.held_out - frame.plate.image)[smoke]
        brighter += float(np.sum(np.square(np.maximum(difference, 0), dtype=np.float64)))
        change += float(np.sum(np.square(difference, dtype=np.float64)))
    return float(np.sqrt(brighter / max(change, 1e-30)))


@dataclass(frozen=True)
class HeldOut:
    """What the judge shows of a model's densities, beside the other half of the pixels.

    Attributes
    ----------
    error
        Root mean square of the difference, in shares of what the smoke changes there.
    light
        Strength of the light, in multiples of the scene's, that brings the same densities nearest to them: more than 1
        where the densities are too dark. 1 without scattered light.
    colour : (3,)
        The same for red, green and blue alone.
    """

    error: float
    light: float
    colour: NDArray[np.float64] = field(default_factory=lambda: np.ones(3))


def held_out(frames: Sequence[CoarseFrame], model: Scattering, judge: Scattering, settings: DensitySettings) -> HeldOut:
    """Fit a model's densities to one half of the pixels, and let the judge show them to the other half."""
    wrong = change = 0.0
    asked, power = np.zeros((2, 3))
    for frame in frames:
        scene, plate, halves = frame.scattered_by(model).scene, frame.plate, frame.halves
        fitted = reconstruct_density(halves.fitted, scene, settings=settings, plate=plate)
        optics = replace(scene_optics(scene), scattering=judge)
        renderer = optics.renderer(scene.camera, plate.image, fitted.hull)
        shown = renderer.image(fitted.density)
        seen = reached(matte(frame.picture, plate).mask, project_voxels(scene.camera, scene.domain))
        # the light that the smoke scatters itself, and what it should be beside what it lets through
        behind = renderer.transmittance[..., None] * plate.image
        own, wanted = ((image - behind)[seen].astype(np.float64) for image in (shown, halves.held_out))
        wrong += float(np.sum(np.square(shown - halves.held_out, dtype=np.float64)[seen]))
        change += float(np.sum(np.square(halves.held_out - plate.image, dtype=np.float64)[seen]))
        asked += np.sum(own * wanted, 0)
        power += np.sum(np.square(own), 0)
    error = float(np.sqrt(wrong / max(change, 1e-30)))
    if judge == "absorption" or not power.sum() > 0:
        return HeldOut(error, 1.0)
    colour = np.divide(asked, power, out=np.ones(3), where=power > 0)
    return HeldOut(error, float(asked.sum() / power.sum()), colour)
