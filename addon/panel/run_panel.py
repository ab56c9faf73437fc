"""Runs in the tab: the buttons that make smoke and stop that, and the queue."""

import bpy
from bpy.app.translations import pgettext_iface as iface_

from ..core import ShotError
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
    idle, now = all(run.job.ended for run in own), volume.shown(smoke)
    begun = smoke_takes.unfinished(smoke) if idle else None
    text = "Start Again" if begun is not None and begun.read().frames else "Make Smoke"
    column = layout.column()
    column.scale_y = 1.5
    column.operator("smokelift.run", text=text if idle else "Make Another After This", icon="PLAY")
    column = layout.column()
    column.enabled = now is not None
    column.operator("smokelift.set_up", icon="CAMERA_DATA")
    row = column.row()
    row.enabled = now is not None and now.complete
    row.operator("smokelift.vary", icon="MOD_NOISE")
    jobs = [run.job for run in own]
    draw_check(layout, smoke, {job.sentence for job in jobs} | {kind for job in jobs for kind, _ in job.doubts})
    said: set[str] = set()
    for run in runs:
        _draw_run(layout, smoke, run, said)
    if begun is not None:
        frames, title = begun.read().frames, begun.read().title
        if all(run.take != begun for run in own):  # the end of another session interrupted it
            text = "{:s} was interrupted." if frames else "{:s} was interrupted before its first frame."
            draw_text(layout, text, "ERROR", title)
        if frames:
            text = iface_("Resume {:s} after Frame {:d}").format(title, volume.frames_before(smoke, begun) + frames)
            layout.operator("smokelift.resume", text=text, translate=False, icon="FILE_REFRESH")
    if now is not None:
        first, last = volume.shown_range(smoke)
        if smoke.data.sequence_mode == "CLIP" and not first <= context.scene.frame_current <= last:
            draw_text(layout, "The smoke is seen in frames {:d} to {:d}.", "INFO", first, last)
        if known := volume.provenance_note(smoke):
            draw_text(layout, known, "INFO")
        if now.complete and lacks_proxy(smoke, now.scene["domain"]):
            text = "This smoke is large: a proxy keeps the viewport fast."
            draw_hint(layout, text, "smokelift.make_proxy", "MOD_REMESH")
    elif (take := volume.shown_take(smoke)) is not None:
        text = "The files of the smoke in {:s} are missing: make it again, or choose their folder."
        draw_text(layout, text, "ERROR", str(take.directory))
        layout.operator("smokelift.choose_results", icon="FILE_FOLDER")


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
