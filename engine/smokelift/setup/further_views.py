"""Further calibrated cameras: their clips in step with the input's, their backgrounds and exposures, their agreement.

Cameras have exposures and white balances of their own. But every slice across two cameras holds as much smoke in one
picture as in the other. So one density is fitted to both, on coarse frames. A camera's gain is how much brighter than
that density it shows the smoke, over how much brighter the input does. Both are fitted again with the gain evened out,
until little is left. Figures: docs/experiments/further-views.md.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from smokelift.checks import Array, Figures, Finding
from smokelift.density import ViewSet
from smokelift.density.hull import agreement
from smokelift.extraction.find_background import find_background
from smokelift.footage.clip import Clip
from smokelift.footage.frame_source import is_video
from smokelift.scene import ClipSource, CompleteScene
from smokelift.setup.coarse import SCATTERING_TOLERANCE, HeldOut, coarse_frames, held_out
from smokelift.setup.first_estimate import background_findings, sample_smoke, with_source
from smokelift.setup.geometry import fitting
from smokelift.setup.settings import Settings
from smokelift.setup.shot import Shot, ShotView

AGREEMENT_SAMPLES = 4
"""Frames in which the views are compared: a wrong one does not decide their median."""

MIN_AGREED_FRACTION = 0.9
"""Smallest fraction of the smoke's pixels that right views agree on: true views agree on all, cameras upside down on a
tenth to nine tenths (docs/experiments/further-views.md)."""

MAX_RATE_DIFFERENCE = 0.01
"""Relative difference of two frame rates that are the same: 30 and 29.97 are, 25 and 24 are not."""

GAIN_ROUNDS = 3
"""Fits from which a gain is found: a fourth changes it by .3 % at most (docs/experiments/further-views.md)."""

MIN_OWN_RATIO = 1.35
"""Smallest ratio of brightness that is the cameras' own, where light is assumed to come from everywhere. Smoke lit from
one side is brighter there: cameras exposed alike differ by up to 1.30 (docs/experiments/further-views.md)."""

MAX_GAIN = 8.0
"""Largest gain, and the inverse of the smallest: three stops. What asks for more has another background."""


def open_views(
    first: ShotView, scene: CompleteScene, numbers: Sequence[int], lit: bool, settings: Settings
) -> tuple[tuple[ShotView, ...], list[Finding]]:
    """Open the further views of a lit scene at the input's exposure; return what was found of them too.

    Brightness is compared in frames ``numbers``. It says more where lights are given (``lit``). A clip or a camera that
    does not fit the input's is a ValueError.
    """
    views: list[ShotView] = []
    found: list[Finding] = []
    for number in range(len(scene.views)):
        view, noticed = _open_view(number, first.clip, scene, not lit)
        found += noticed
        if settings.measure and scene.scattering != "absorption":
            view, gain = _match_exposure(number + 1, first, view, scene, numbers, lit, settings)
            found += gain
        views.append(view)
    return tuple(views), found


def disagreement(shot: Shot) -> list[Finding]:
    """A doubt if the views disagree about where the smoke is."""
    fractions = []
    for frame in shot.spread(AGREEMENT_SAMPLES):
        views = ViewSet.of(shot.observe(frame), shot.optics).views
        fractions.append(agreement([view.mask for view in views], [view.projection for view in views]))
    agreed = float(np.median(fractions))
    return [] if agreed >= MIN_AGREED_FRACTION else [Finding("disagreeing views", {"agreed": agreed}, doubt=True)]


def _open_view(number: int, clip: Clip, scene: CompleteScene, light_assumed: bool) -> tuple[ShotView, list[Finding]]:
    """A further view of a scene, from 0, with its background; and what was found of it."""
    view = scene.views[number]
    view_clip = _open_clip(view.clip, clip, scene)
    if abs(view_clip.fps - clip.fps) > MAX_RATE_DIFFERENCE * clip.fps:
        raise ValueError(
            f"{view_clip.path}: has {view_clip.fps:g} frames per second, the input {clip.fps:g}; all views need the "
            "same, so convert one, or give the frame rate of the clip whose file says it wrongly."
        )
    camera, background = fitting(view.camera, view_clip), view.background
    if background is None and scene.background.color is not None:
        background = replace(scene.background, strokes=None)
    found = find_background(view_clip, camera, background)
    samples = sample_smoke(found.clip, found.plate)
    plate, source, _ = with_source(found, found.clip, samples, by_hue=light_assumed)
    try:
        shown = ShotView.facing(scene.domain, found.clip, camera, plate, source, light_assumed)
    except ValueError as error:
        raise ValueError(f"View {number + 1}: {error}") from error
    axes = [np.array(each.matrix)[:3, 2] for each in (scene.camera, camera)]
    angle = np.degrees(np.arccos(np.clip(axes[0] @ axes[1], -1, 1)))
    first, last = view_clip.numbers[0], view_clip.numbers[-1]
    which: Figures = {"name": view_clip.path.name, "degrees": float(angle), "first": first, "last": last}
    said = (*view_clip.findings(), Finding("further view", which), *background_findings(found))
    return shown, [replace(each, figures={**each.figures, "view": number + 1}) for each in said]


def _open_clip(source: ClipSource, clip: Clip, scene: CompleteScene) -> Clip:
    """The part of a view's clip that shows what the input does."""
    first = clip.numbers[0]
    if source.frames is not None:
        first += source.first - (scene.clip.first if scene.clip is not None else clip.numbers[0])
    # pictures carry no rate of their own
    fps = clip.fps if source.fps is None and not is_video(source.path) else source.fps
    with Clip.open(replace(source, fps=fps, frames=None, mask=None)) as whole:
        have = len(whole)
    last = first + len(clip) - 1
    if first < 0 or last >= have:
        raise ValueError(
            f"{source.path}: has frames 0 to {have - 1}, but {first} to {last} are those of the input's moments; use "
            "fewer frames of the input, or say which frames of the view belong to them."
        )
    return Clip.open(source, fps=fps, frames=(first, last))


def _match_exposure(
    number: int,
    front: ShotView,
    view: ShotView,
    scene: CompleteScene,
    numbers: Sequence[int],
    lit: bool,
    settings: Settings,
) -> tuple[ShotView, list[Finding]]:
    """View ``number``, from 1, divided by its gain; as it is if no gain fits clearly better."""
    frames = coarse_frames((front, view), numbers, scene)
    if not frames:
        return view, []

    def compare(gain: Array) -> HeldOut:
        evened = [replace(frame, views=(frame.views[0], frame.views[1].divided(gain))) for frame in frames]
        return held_out(evened, scene.scattering, scene.scattering, settings.density)

    errors: list[float] = []
    ratio = np.ones(3)
    for _ in range(GAIN_ROUNDS):
        found = compare(ratio.astype(np.float32))
        own, other = np.maximum(found.gains, 1e-6)
        errors, ratio = [*errors, found.error], np.clip(ratio * other / own, 1 / MAX_GAIN, MAX_GAIN)
    as_it_is, tolerance = errors[0], SCATTERING_TOLERANCE
    brightness = float(np.exp(np.mean(np.log(ratio))))
    if not lit and 1 / MIN_OWN_RATIO < brightness < MIN_OWN_RATIO:
        ratio = ratio / brightness
    gain = ratio.astype(np.float32)
    error = compare(gain).error
    if error >= as_it_is - tolerance:
        return view, []
    red, green, blue = map(float, gain)
    figures = {"view": number, "error": error, "error_as_it_is": as_it_is, "tolerance": tolerance}
    clip = view.clip.changed(lambda _, picture: picture / gain)
    source = None if view.source is None else view.source / gain
    plate = view.plate.through(lambda part: part / gain if part.ndim == 3 else part)
    view = replace(view, clip=clip, plate=plate, source=source)
    about, value = f"gain of view {number}", (red, green, blue)
    return view, [Finding("gain of a view", figures, about=about, value=value, source="measured")]
