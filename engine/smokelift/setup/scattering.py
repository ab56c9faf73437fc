"""How light is scattered: the cheapest model that finds as good a density as the richest.

    absorption -> unshadowed -> single (with self-shadowing) -> multiple

The richest model, which holds the others as special cases, judges the densities of all (`smokelift.setup.held_out`).
Single scattering is no special case of multiple scattering, which makes the same smoke brighter. Of these two multiple
scattering is the richest only where its own picture of its own density is clearly nearer: smoke whose picture both
models fit is twice as dense in one as in the other (docs/experiments/multiple-scattering.md). Neither is the cheaper
answer, so that the tolerance of cheaper models says nothing here: errors are compared as a ratio, in which what no
model fits counts for both.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace

from smokelift.checks import Figures
from smokelift.density import DensitySettings
from smokelift.scene import CompleteScene, Scattering
from smokelift.setup.coarse import CoarseFrame
from smokelift.setup.estimate import Estimate, measured
from smokelift.setup.held_out import held_out

MODELS: tuple[Scattering, ...] = ("absorption", "unshadowed", "single", "multiple")
"""Models of scattering, from the cheapest to the richest."""

MAX_ERROR_RATIO = 0.75
"""Error of one model over that of another of which it is no special case, below which it is taken. Multiple over single
scattering: 0.01 to 0.63 where paths were traced, but for smoke that either model fits, and 0.82 and more where light
is scattered once (docs/experiments/scattering-selection.md)."""

MAX_DESCENT_STEPS = 64
"""Steps of descent that a fit may take where models are distinguished that differ little: enough for every fit to end
by itself. One that is cut off has the error of the steps which it lacks (docs/experiments/scattering-selection.md)."""


def choose_scattering(
    frames: Sequence[CoarseFrame],
    richest: Scattering,
    settings: DensitySettings,
    tolerance: float,
    known: Mapping[Scattering, float],
    finer: Callable[[], CoarseFrame | None],
) -> tuple[Scattering, Estimate[str]]:
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
    finer
        Returns one of the frames on twice the voxels, for models that are nearly alike on these; None if there is none.
    """

    def error(model: Scattering, judge: Scattering) -> float:
        if model == judge and model in known:
            return known[model]
        return held_out(frames, model, judge, settings).error

    errors = {richest: error(richest, richest)}
    if richest == "single" and tries_multiple(frames[0].scene):
        errors["multiple"] = error("multiple", "multiple")
        if errors["multiple"] < MAX_ERROR_RATIO * errors["single"]:
            richest = "multiple"
        # else the errors may be those of the coarse grid: either model seems to fit the smoke, or neither does
        elif (larger := finer()) is not None and larger.scene.domain != frames[0].scene.domain:
            frames, known = [larger.lit_by(frames[0].scene.lights)], {}
            settings = replace(settings, descent_iterations=max(MAX_DESCENT_STEPS, settings.descent_iterations))
            return choose_scattering(frames, "single", settings, tolerance, known, lambda: None)
    chosen = richest
    for model in MODELS[: MODELS.index(richest)]:
        errors[model] = min(error(model, richest), 1.0)  # which no smoke at all leaves
        if errors[model] <= errors[richest] + tolerance:
            chosen = model
            break
    return chosen, _estimate(chosen, richest, errors, tolerance)


def tries_multiple(scene: CompleteScene) -> bool:
    """Whether multiple scattering is tried where single scattering is allowed: smoke that is isotropic has it."""
    return scene.medium.anisotropy == 0.0


def _estimate(
    chosen: Scattering, richest: Scattering, errors: Mapping[Scattering, float], tolerance: float
) -> Estimate[str]:
    """The choice of a model beside the one that it is compared with: the richest, or of that the next cheaper one."""
    other = MODELS[MODELS.index(richest) - 1] if chosen == richest else richest
    figures = {f"error_{name}": value for name, value in errors.items()}
    if len(errors) == 1:
        return measured("scattering", chosen, figures, tolerance=tolerance)
    compared: Figures = {"error": errors[chosen], "other": other, "other_error": errors[other]}
    kind = "compared scattering"
    return measured(kind, chosen, {**figures, **compared}, what="scattering", tolerance=tolerance)
