"""Runs in the tab: the buttons that make smoke and stop that, and the queue."""

from typing import Any

import bpy
from bpy.app.translations import pgettext_iface as iface_

from ..core import ShotError
from ..core.take import Take
from ..result import run_queue, smoke_takes
from ..result.shot_check import settings_text
from ..result.smoke_takes import Run, runs
from ..scene import volume
from ..scene.modifiers import lacks_proxy
from ..scene.smoke import find_smoke
from .common import Need, needs_clip, operator
from .layout import draw_doubts, draw_failure, draw_hint, draw_progress, draw_text
from .quality_panel import SEEDS, draw_check


@operator("Make Smoke", needs_clip, bl_options={"UNDO"})
def run(_context: bpy.types.Context, smoke: bpy.types.Object) -> None:
    """Turn the clip into a volume of smoke. Blender stays usable meanwhile"""
    run_queue.enqueue(smoke, smoke_takes.write_take(smoke), settings_text(smoke))


_needs_detail = Need(
    "Without detail in depth there is only one smoke: raise Depth Detail first",
    lambda _, smoke: smoke.smokelift.detail > 0.0,
)


@operator("Another Variation", needs_clip, _needs_detail, bl_options={"UNDO"})
def vary(_context: bpy.types.Context, smoke: bpy.types.Object) -> None:
    """Make the smoke again with the next variation: it looks the same from the camera, and different from the side"""
    before = smoke.smokelift.seed
    smoke.smokelift.seed = (before + 1) % SEEDS
    try:
        take = smoke_takes.write_take(smoke)
    except ShotError:
        smoke.smokelift.seed = before
        raise
    run_queue.enqueue(smoke, take, settings_text(smoke))


@operator("Resume", needs_clip)
def resume(_context: bpy.types.Context, smoke: bpy.types.Object) -> None:
    """Resume the stopped run after its last finished frame, with its own settings"""
    take = smoke_takes.unfinished(smoke)
    if take is None or smoke_takes.busy(take):
        raise ShotError("No stopped run to resume: press Make Smoke.")
    smoke_takes.update_moved_files(smoke, take)
    run_queue.enqueue(smoke, take)


def draw_run(layout: bpy.types.UILayout, context: bpy.types.Context, smoke: bpy.types.Object) -> None:
    """The buttons, whose places do not change; below them the warnings, the runs, and what is known of the result."""
    own = [run for run in runs if run.smoke == smoke.session_uid]
    idle, index = all(run.job.ended for run in own), volume.shown_index(smoke)
    begun = smoke_takes.unfinished(smoke) if idle else None
    text = "Start Again" if begun is not None and begun.read().frames else "Make Smoke"
    column = layout.column()
    column.scale_y = 1.5
    column.operator("smokelift.run", text=text if idle else "Make Another After This", icon="PLAY")
    column = layout.column()
    column.enabled = index is not None
    column.operator("smokelift.set_up", icon="CAMERA_DATA")
    row = column.row()
    row.enabled = index is not None and index["complete"]
    row.operator("smokelift.vary", icon="MOD_NOISE")
    jobs = [run.job for run in own]
    of_runs = {job.sentence for job in jobs} | {kind for job in jobs for kind, _ in job.doubts}
    draw_check(layout, smoke, of_runs)
    said: set[str] = set()
    for run in runs:
        _draw_run(layout, smoke, run, said)
    if begun is not None:
        _draw_begun(layout, smoke, begun, any(run.take == begun for run in own))
    if index is not None:
        _draw_shown(layout, context, smoke, index)
    elif (take := volume.shown_take(smoke)) is not None:
        text = "The files of the smoke in {:s} are missing: make it again, or choose their folder."
        draw_text(layout, text, "ERROR", str(take.directory))
        layout.operator("smokelift.choose_results", icon="FILE_FOLDER")


def _draw_begun(layout: bpy.types.UILayout, smoke: bpy.types.Object, take: Take, known: bool) -> None:
    """A run that can go on; one that this session does not know was interrupted by the end of another."""
    frames = take.read().frames
    if not known:
        text = "{:s} was interrupted." if frames else "{:s} was interrupted before its first frame."
        draw_text(layout, text, "ERROR", take.read().title)
    if frames:
        last = volume.frames_before_take(smoke, take) + frames
        text = iface_("Resume {:s} after Frame {:d}").format(take.read().title, last)
        layout.operator("smokelift.resume", text=text, translate=False, icon="FILE_REFRESH")


def _draw_shown(
    layout: bpy.types.UILayout, context: bpy.types.Context, smoke: bpy.types.Object, index: dict[str, Any]
) -> None:
    """When the result on show is seen, what of it is measured, and a proxy where it is large."""
    seen = volume.shown_range(smoke)
    if seen and smoke.data.sequence_mode == "CLIP" and not seen[0] <= context.scene.frame_current <= seen[1]:
        draw_text(layout, "The smoke is seen in frames {:d} to {:d}.", "INFO", *seen)
    if known := volume.provenance_note(smoke):
        draw_text(layout, known, "INFO")
    if index["complete"] and lacks_proxy(smoke, index):
        text = "This smoke is large: a proxy keeps the viewport fast."
        draw_hint(layout, text, "smokelift.make_proxy", "MOD_REMESH")


def _draw_run(layout: bpy.types.UILayout, shown: bpy.types.Object, run: Run, said: set[str]) -> None:
    """A run, also of another smoke; that one's warnings stand in its own tab. Doubts that are ``said`` stand above."""
    box, job, own = layout.box(), run.job, run.smoke == shown.session_uid
    smoke, name = find_smoke(run.smoke), str(run.take.directory)
    if smoke is not None and not own:
        box.label(text=smoke.name, icon="VOLUME_DATA")
    if job.outcome == "waiting":
        line = box.row(align=True)
        line.label(text="Queued", icon="SORTTIME")
        line.operator("smokelift.cancel", text="", icon="X").take = name
    elif job.outcome == "running":
        draw_progress(box, job, "smokelift.cancel").take = name
    elif job.outcome == "failed":
        (draw_failure if own else draw_text)(box, job.sentence)
    else:
        draw_text(box, job.sentence, "INFO")
    if run.icon:
        box.template_icon(icon_value=run.icon, scale=8.0)
    if own:
        draw_doubts(box, shown, job.doubts, said)
    if not job.ended:
        return
    if own and job.outcome == "done" and run.take != volume.shown_take(shown):  # after an undo to before it
        box.operator("smokelift.show_take", icon="HIDE_OFF").take = name
    box.operator("smokelift.open_log", icon="TEXT").take = name
