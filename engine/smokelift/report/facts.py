"""What is known of a shot before it is reconstructed: what its set-up found, and what the rest of the page says."""

from collections.abc import Sequence
from dataclasses import asdict, replace
from typing import Any

import numpy as np

from smokelift.checks import Figure, Figures, Finding, Source
from smokelift.footage.noise import shows_exposure, small
from smokelift.report.cost import Cost, Workload, estimate_cost
from smokelift.report.sentences import fact
from smokelift.scene import CompleteScene, Scene
from smokelift.setup.geometry import PICTURE_HEIGHT
from smokelift.setup.shot import Shot

CLEAN_NOISE, HEAVY_NOISE = 2.0, 6.0
"""Noise in 8 bit codes up to which a clip is clean, and from which it hides thin smoke
(docs/experiments/background.md)."""


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
