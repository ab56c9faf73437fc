"""What is known of a shot: before a run, what was found or assumed; after it, where its parts come from, and doubts."""

from collections.abc import Mapping, Sequence
from dataclasses import asdict, replace
from functools import partial
from typing import Any

import numpy as np

from smokelift.checks import Figure, Figures, Finding, Source
from smokelift.density.synthesis import unseen_sides
from smokelift.density.turntable import Turntable
from smokelift.footage.noise import shows_exposure, small
from smokelift.report.cost import Cost, Workload, estimate_cost
from smokelift.report.sentences import fact
from smokelift.scene import CompleteScene, Scene
from smokelift.setup.geometry import PICTURE_HEIGHT
from smokelift.setup.shot import Shot

CLEAN_NOISE, HEAVY_NOISE = 2.0, 6.0
"""Noise in 8 bit codes up to which a clip is clean, and from which it hides thin smoke
(docs/experiments/background.md)."""

MAX_FITTED_ERROR = 0.7
"""Root mean square of what a fit leaves, as a fraction of what the smoke changes: half of the change's energy."""

MAX_SMOKE_ERROR = 0.3
"""Fraction left above which some of the change may be no smoke. Good results leave less; those that take labels,
leaves, a head or the light for smoke leave more (docs/clips.md)."""

MAX_COARSE_ERROR = 0.25
"""Fraction that a coarse fit leaves of the pixels that it leaves out, above which a run is likely to leave more than
`MAX_SMOKE_ERROR` (measured: the example as it is, with leaves and with light that flickers leaves .04 to .07, a run .05
to .12; with a person in it .12, .16, .29 and .35, a run .14, .23, .37 and .39; with labels .10, a run .27)."""


def facts(shot: Shot, given: Scene, cost: Cost) -> list[Finding]:
    """Return what is known of a shot, one finding for each line of a table; ``given`` is the user's scene."""
    found = {each.about: each for each in reversed(shot.findings) if "view" not in each.figures}
    scene, medium, plate = shot.scene, shot.scene.medium, shot.views[0].plate.at(0)

    def known(about: str, value: Figure, is_given: bool = True) -> Finding:
        """What the set-up found, or else what is given or, if it is not, assumed."""
        return found.get(about) or _line(about, value, "given" if is_given else "assumed")

    has_scale = given.domain is not None or shot.settings.distance is not None
    scale: Figures = {"size": scene.domain.size, "height": PICTURE_HEIGHT}
    has_medium = "medium" not in found
    color = "gray" if medium.is_gray else ", ".join(f"{v:.2f}" for v in medium.color)
    spent = {"seconds": cost.seconds, "memory": cost.memory / 2**30, "disk": cost.disk / 1e6}
    lines = [known("background", "as given")]
    seen, mask = shot.clip.seen(0, *shot.clip.size), shot.clip.mask
    if seen is not None and mask is not None and mask.files:
        lines.append(Finding("mask", {"hidden": 1 - float(seen.mean())}, about="mask", source="given"))
    steady = Finding("exposure unseen", about="exposure", source="assumed")
    if shows_exposure(small(plate.image)):
        steady = replace(steady, kind="steady exposure", source="measured")
    codes, lasting = (255 * float(noise.max()) for noise in (plate.noise.total, plate.noise.lasting))
    level = "clean" if codes <= CLEAN_NOISE else "noisy: thin smoke is lost in it" if codes >= HEAVY_NOISE else "usual"
    noise: Figures = {"level": level, "codes": codes, "lasting": lasting}
    return [
        *lines,
        found.get("exposure", steady),
        Finding("noise", noise, about="noise", source="measured"),
        known("camera", f"{scene.camera.type}, {'moves' if scene.camera.moves else 'stands still'}"),
        Finding("scale", scale, about="scale", source="given" if has_scale else "assumed"),
        known("box", "as given"),
        known("resolution", scene.domain.resolution),
        known("extinction", medium.extinction, has_medium),
        known("albedo", medium.albedo, has_medium),
        known("smoke color", color),
        *_light(scene, given, found.get("source radiance")),
        known("scattering", scene.scattering, given.scattering is not None),
        found.get("axis depth") or _place(shot),
        Finding("cost", {**spent, "free": cost.memory_free / 2**30}, about="cost", source="estimated"),
    ]


def _light(scene: CompleteScene, given: Scene, brightness: Finding | None) -> list[Finding]:
    """How strong the light is, and what one picture does not show of it."""
    if scene.scattering == "absorption":
        return [_line("light", "none is needed", "estimated" if given.scattering is None else "given")]
    if brightness is None:
        return [_line("light", "as given", "given")]
    return [
        brightness,
        _line("sun's direction", "no sun", "assumed"),
        _line("sun's color", "that of all light", "assumed"),
        _line("ambient fraction", "all light is from everywhere", "assumed"),
    ]


def _place(shot: Shot) -> Finding:
    """Where in depth the smoke stands if it was not searched for."""
    if len(shot.views) > 1:
        return _line("axis depth", "as the cameras show it", "estimated")
    if shot.settings.distance is not None:
        return _line("axis depth", f"{shot.settings.distance:.2f} m from the camera", "given")
    return _line("axis depth", "the middle of the box", "assumed")


def _line(about: str, value: Figure, source: Source) -> Finding:
    """What is taken without a search; its kind is what it is about."""
    return Finding(about, about=about, value=value, source=source)


def boundaries(scene: CompleteScene) -> list[Finding]:
    """Return how smoke gets into the box and out of it."""
    inflow = scene.inflow()
    entry = Finding("no inlets")
    if inflow is not None:
        entry = Finding("inlets", {"inlets": len(scene.inlets), "voxels": int(inflow.sum())})
    closed = Finding("closed sides", {"sides": ", ".join(scene.closed)}) if scene.closed else Finding("open box")
    return [entry, closed]


def forecast_of(shot: Shot, known: Sequence[Finding], work: Workload) -> dict[str, Any]:
    """Return what a program shows of a shot beside its findings, as JSON holds it.

    Those are the facts, the median color of what is behind the smoke (linear), and grid and cost of each quality.
    """
    plate = shot.views[0].plate.at(0).image
    return {
        "facts": [fact(line) for line in known],
        "background_color": [float(value) for value in np.median(plate.reshape(-1, 3), axis=0)],
        "qualities": {
            quality: {**asdict(grid), **asdict(estimate_cost(grid.resolution, work))}
            for quality, grid in shot.qualities.items()
        },
    }


def provenance(shot: Shot) -> list[Finding]:
    """Return where the parts of a shot's result come from, the best known first."""
    settings, cameras = shot.settings, {"cameras": len(shot.views)}
    taken = "thin fog" if len(shot.views) > 1 else "the view from the side"
    if settings.method != "paper":
        taken = "the smoke's width"
    depth = f"depth by {taken} in {'several views' if len(shot.views) > 1 else 'one view'}"
    parts = [
        *(found for found in shot.clip.findings() if found.about),
        Finding("pictures that are fitted", cameras, about="optical depth of every ray", source="measured"),
        Finding("velocity between frames", about="velocity", source="estimated"),
        Finding(depth, cameras, about="distribution along the rays", source="assumed"),
    ]
    if shot.fire is not None:
        parts.append(Finding("emission along the rays", about="emission of fire", source="assumed"))
    return [*parts, *made_up(shot)]


def made_up(shot: Shot) -> list[Finding]:
    """Return what a run will make up, with the settings that choose it: if there is a side without a camera near it."""
    settings, cameras = shot.settings, [view.working.camera for view in shot.views]
    if settings.detail == 0 or not unseen_sides(Turntable.facing(cameras[0], shot.optics.domain), cameras):
        return []
    chosen = {"detail": settings.detail, "seed": settings.seed}
    return [Finding("texture of the clip", chosen, about="fine structure along the rays", source="made up")]


def expected_shortcomings(shot: Shot) -> list[Finding]:
    """Return the doubts about a run that the set-up of its shot gives reason for."""
    named = {"likely wrong light", "given background never seen", "smoke in the given frame"}
    if shot.fire is not None or any(found.kind in named for found in shot.findings):
        return []
    figures = next((found.figures for found in shot.findings if found.about == "scattering"), {})
    error = figures.get("error", 0.0)
    assert isinstance(error, float)
    return [Finding("not all may be smoke", {"error": error}, doubt=True)] if error > MAX_COARSE_ERROR else []


def count_empty(figures: Sequence[Mapping[str, Any]]) -> int:
    """Return how many frames show no smoke."""
    return sum(not (of_frame.get("hull_share") or 0) > 0 for of_frame in figures)


def shortcomings(figures: Sequence[Mapping[str, Any]], *, burns: bool = False) -> list[Finding]:
    """Return doubts about a finished run by its frames' figures; ``burns`` if there is fire."""
    doubt, doubts = partial(Finding, doubt=True), []
    empty = count_empty(figures)
    if empty:
        doubts.append(doubt("empty frames", {"empty": empty, "frames": len(figures)}))
    errors = [of_frame["relative_error"] for of_frame in figures if of_frame.get("relative_error") is not None]
    typical = float(np.median(errors)) if errors else 0.0
    if burns and typical > MAX_SMOKE_ERROR:
        doubts.append(doubt("fire beside what is fitted", {"error": typical}))
    elif typical > MAX_FITTED_ERROR:
        doubts.append(doubt("hardly any smoke fitted", {"error": typical}))
    elif typical > MAX_SMOKE_ERROR:
        doubts.append(doubt("not all is smoke", {"error": typical}))
    return doubts
