"""The tab Smokelift in the sidebar of the 3D View and of the Movie Clip Editor, with the runs in it.

Its buttons make smoke and stop that; below them is the queue.
"""

import bpy

from ..core import ShotError
from ..result import run_queue, smoke_takes
from ..result.shot_check import settings_text
from ..result.smoke_takes import Run, runs
from ..scene import volume
from ..scene.blender import iface_, rpt_
from ..scene.modifiers import lacks_proxy
from ..scene.smoke import activate, find_smoke, smokes
from .camera_panel import draw_shot
from .clip_panel import draw_clip
from .common import HIDDEN, UNDO, Need, needs_clip, needs_smoke, operator, panels
from .layout import draw_doubts, draw_failure, draw_hint, draw_progress, draw_settings, draw_text
from .properties import draw_header
from .quality_panel import SEEDS, draw_check, draw_qualities


@operator("Select Smoke", needs_smoke, bl_options=UNDO, given={"smoke": HIDDEN})
def show_smoke(context: bpy.types.Context, _active: bpy.types.Object, smoke: str) -> None:
    """Select this smoke, and show its settings in the tab"""
    found = next((obj for obj in smokes(context.scene) if obj.name == smoke), None)
    if found is None:
        raise ShotError(rpt_("The scene has no smoke of the name {:s}.").format(smoke))
    activate(found, context.scene)


@panels("", "Smokelift", draw_header_preset=draw_header)
def _draw_tab(layout: bpy.types.UILayout, context: bpy.types.Context, smoke: bpy.types.Object | None) -> None:
    column, found = layout.column(align=True), smokes(context.scene)
    for other in found if len(found) > 1 else ():
        row = column.operator("smokelift.show_smoke", text=other.name, icon="VOLUME_DATA", depress=other == smoke)
        row.smoke = other.name
    column.operator("smokelift.add", text="Smoke from Video...", icon="ADD")
    if smoke is None:
        draw_text(layout, "Choose a video or an image sequence of smoke. If its camera moves, track it.")
        return
    settings = smoke.smokelift
    layout.template_ID(settings, "clip", open="clip.open")
    if settings.clip is None:
        return
    draw_clip(layout, context, smoke)
    draw_shot(layout, smoke)
    draw_qualities(layout, context, smoke)
    layout.prop(settings, "detail")
    draw_settings(layout, settings, "seed", active=settings.detail > 0.0)
    layout.prop(settings, "output", placeholder=str(smoke_takes.output_folder(smoke)))
    layout.prop(settings, "start_number")
    _draw_runs(layout, context, smoke)


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


def _draw_runs(layout: bpy.types.UILayout, context: bpy.types.Context, smoke: bpy.types.Object) -> None:
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
        _draw_one(layout, smoke, run, said)
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
        if known := smoke.data.get(volume.PROVENANCE):
            draw_text(layout, known, "INFO")
        if now.complete and lacks_proxy(smoke, now.scene["domain"]):
            text = "This smoke is large: a proxy keeps the viewport fast."
            draw_hint(layout, text, "smokelift.make_proxy", "MOD_REMESH")
    elif (take := volume.shown_take(smoke)) is not None:
        text = "The files of the smoke in {:s} are missing: make it again, or choose their folder."
        draw_text(layout, text, "ERROR", str(take.directory))
        layout.operator("smokelift.choose_results", icon="FILE_FOLDER")


def _draw_one(layout: bpy.types.UILayout, shown: bpy.types.Object, run: Run, said: set[str]) -> None:
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
