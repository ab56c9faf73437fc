"""Further calibrated cameras: their clips in step with the input's, their backgrounds, and whether they agree."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from smokelift.checks import Doubt, Figures, Remark
from smokelift.density import ViewSet
from smokelift.density.hull import agreement
from smokelift.footage.backdrop import find_backdrop
from smokelift.footage.clip import Clip, is_video
from smokelift.footage.plate import NOISE_FRAMES
from smokelift.footage.steady import steady
from smokelift.footage.working_picture import CameraError, working_picture
from smokelift.scene import ClipSource, CompleteScene
from smokelift.setup.backdrop_remarks import backdrop_remarks, exposure_change, exposure_remarks
from smokelift.setup.geometry import fitting
from smokelift.setup.shot import Shot, ShotView

AGREEMENT_SAMPLES = 4
"""Frames in which the views are compared."""

MIN_AGREED_SHARE = 0.9
"""Share of the smoke's pixels that the views agree on below which something is wrong. True views agree on all of it,
cameras upside down on a tenth to nine tenths (docs/experiments/view-agreement.md)."""

SAME_RATE = 0.01
"""Relative difference of two frame rates that are the same."""


def open_view(number: int, clip: Clip, scene: CompleteScene) -> tuple[ShotView, list[Remark]]:
    """Open a further view of a complete scene and find its background; with remarks on it.

    Parameters
    ----------
    number
        Of the view among the further ones.
    clip
        The input.
    scene
        What both show.

    Raises
    ------
    ValueError
        If its clip or its camera does not fit the input's.
    """
    view, name = scene.views[number], f"View {number + 1}"
    opened = _opened(view.clip, clip, scene)
    if abs(opened.fps - clip.fps) > SAME_RATE * clip.fps:
        raise ValueError(
            f"{opened.path}: has {opened.fps:g} frames a second, the input {clip.fps:g}; all views need the same, so "
            "convert one, or give the frame rate of the clip whose file says it wrongly."
        )
    camera = fitting(view.camera, opened)
    try:
        working = working_picture(camera, scene.domain)
    except CameraError as error:
        raise ValueError(f"{name}: {error}") from error
    background = view.background
    if background is None and scene.background.color is not None:
        background = scene.background
    opened.expect(opened.spread(NOISE_FRAMES))
    defects = opened.remarks()
    found = find_backdrop(opened, camera, background)
    axes = [np.array(each.matrix)[:3, 2] for each in (scene.camera, camera)]
    angle = np.degrees(np.arccos(np.clip(axes[0] @ axes[1], -1, 1)))
    last = opened.first + len(opened) - 1
    which: Figures = {"name": opened.path.name, "degrees": float(angle), "first": opened.first, "last": last}
    remarks = [
        *defects,
        Remark("further view", which),
        *backdrop_remarks(found),
        *exposure_remarks(exposure_change(found.clip, found.plates)),
    ]
    of_view = [replace(remark, figures={**remark.figures, "view": number + 1}) for remark in remarks]
    return ShotView(steady(found.clip, found.plates), camera, found.plates, working), of_view


def disagreement(shot: Shot) -> tuple[Doubt, ...]:
    """A doubt if the views do not agree about where the smoke is."""
    shares = []
    for frame in shot.spread(AGREEMENT_SAMPLES):
        views = ViewSet.of(shot.observe(frame), shot.optics).views
        shares.append(agreement([view.mask for view in views], [view.projection for view in views]))
    agreed = float(np.median(shares))
    return () if agreed >= MIN_AGREED_SHARE else (Doubt("disagreeing views", {"agreed": agreed}),)


def _opened(source: ClipSource, clip: Clip, scene: CompleteScene) -> Clip:
    """The part of a view's clip that shows what the input does."""
    first = clip.first
    if source.frames is not None:
        first += source.first - (scene.clip.first if scene.clip is not None else clip.first)
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
