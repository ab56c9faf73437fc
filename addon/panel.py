"""The tab Smokelift in the sidebar of the 3D View and of the Movie Clip Editor."""

import textwrap

import bpy
from bpy.app.translations import pgettext_iface as iface_

from . import presets, shot_check, smoke_takes, volume
from .automatic import draw_automatic
from .blender_scene import frame_rate
from .box_table import box_of, has_inlet
from .clip_table import clip_path, unseen_pictures
from .job import ENDED
from .proxy import lacks_proxy
from .smoke import active_smoke, find_smoke, smokes
from .undistort import is_distorted

POINTS_A_LETTER = 6.5
"""Mean width of a letter in Blender's interface font at scale 1; Blender does not wrap labels."""

MASKED = ("not all may be smoke", "not all is smoke", "hardly any smoke fitted")
"""Doubts that a mask may end."""

CELLS = 0.245, 0.215, 0.18, 0.18
"""Shares of a line of the table of qualities: button, time, memory, disk; the rest is what is lost."""


class _Main:
    bl_label = "Smokelift"
    bl_category = "Smokelift"
    bl_region_type = "UI"

    def draw_header_preset(self, context: bpy.types.Context) -> None:
        presets.draw_header(self.layout, context)

    def draw(self, context: bpy.types.Context) -> None:
        layout = self.layout
        layout.use_property_split = True
        layout.use_property_decorate = False
        smoke = active_smoke(context.scene)
        _draw_smokes(layout, context, smoke)
        if smoke is None:
            draw_text(layout, context, "Choose a video or an image sequence of smoke. If its camera moves, track it.")
            return
        settings = smoke.smokelift
        layout.template_ID(settings, "clip", open="clip.open")
        if settings.clip is None:
            return
        _draw_clip(layout, context, smoke)
        _draw_shot(layout, context, smoke)
        _draw_qualities(layout, context, smoke)
        column = layout.column()
        column.prop(settings, "detail")
        row = column.row()
        row.active = settings.detail > 0.0
        row.prop(settings, "seed")
        layout.prop(settings, "output", placeholder=str(smoke_takes.output_folder(smoke)))
        _draw_run(layout, context, smoke)


def _draw_smokes(layout: bpy.types.UILayout, context: bpy.types.Context, active: bpy.types.Object | None) -> None:
    """The smokes of the scene if there are several, and the button that adds one."""
    column = layout.column(align=True)
    found = smokes(context.scene)
    if len(found) > 1:
        for smoke in found:
            row = column.operator("smokelift.show_smoke", text=smoke.name, icon="VOLUME_DATA", depress=smoke == active)
            row.smoke = smoke.name
    column.operator("smokelift.add", text="Smoke from Video...", icon="ADD")


def _draw_clip(layout: bpy.types.UILayout, context: bpy.types.Context, smoke: bpy.types.Object) -> None:
    scene, settings = context.scene, smoke.smokelift
    clip = settings.clip
    if not clip_path(clip).is_file():
        draw_text(
            layout, context, iface_("{:s} is not there: choose the clip again.").format(str(clip_path(clip))), "ERROR"
        )
    row = layout.row(align=True)
    row.prop(settings, "first", text="Frames")
    row.prop(settings, "last", text="")
    _draw_gaps(layout, context, settings)
    if is_distorted(clip):
        column = layout.column(align=True)
        draw_text(
            column,
            context,
            "The clip's lens bends lines, and smoke is made for one that does not: undistort it.",
            "INFO",
        )
        column.operator("smokelift.undistort")
    size = (scene.render.resolution_x, scene.render.resolution_y)
    other_rate = clip.source == "MOVIE" and abs(clip.fps - frame_rate(scene)) > 0.01
    if size != tuple(clip.size) or other_rate:
        column = layout.column(align=True)
        if clip.source == "MOVIE":
            text = iface_("The clip has {:d} x {:d} pixels at {:g} frames a second, the scene {:d} x {:d} at {:g}.")
            text = text.format(*clip.size, clip.fps, *size, frame_rate(scene))
            if size == tuple(clip.size):
                text = iface_("The clip has {:g} frames a second, the scene {:g}.").format(clip.fps, frame_rate(scene))
        else:  # pictures have no frame rate of their own
            text = iface_("The clip has {:d} x {:d} pixels, the scene {:d} x {:d}.").format(*clip.size, *size)
        draw_text(column, context, text, "INFO")
        column.operator("smokelift.match_clip")


def _draw_gaps(layout: bpy.types.UILayout, context: bpy.types.Context, settings: bpy.types.PropertyGroup) -> None:
    """Pictures that are missing in a sequence, and the button that uses those after them."""
    found = unseen_pictures(settings)
    if found is None:
        return
    column = layout.column(align=True)
    if found.missing:
        draw_text(column, context, iface_("Missing: {:s}.").format(found.missing_names()), "ERROR")
    if settings.last < found.count:
        text = iface_("Blender sees {:d} of {:d} frames.").format(settings.clip.frame_duration, found.count)
        draw_text(column, context, text, "BLANK1" if found.missing else "INFO")
        column.operator("smokelift.use_all_files")
    else:
        draw_text(column, context, "A neighboring picture stands in for each.", "BLANK1")


def _draw_shot(layout: bpy.types.UILayout, context: bpy.types.Context, smoke: bpy.types.Object) -> None:
    settings = smoke.smokelift
    row = layout.row(align=True)
    row.prop(settings, "plate_mode")
    row.operator("smokelift.plate_from_frame", text="", icon="IMAGE_BACKGROUND")
    if settings.plate_mode == "FILE":
        layout.prop(settings, "plate", text=" ")
    elif settings.plate_mode == "FRAMES":
        row = layout.row(align=True)
        row.prop(settings, "plate_frames", text=" ")
        row.operator("smokelift.clear_plate_frames", text="", icon="X")
    _draw_mask(layout, context, settings)
    layout.prop(settings, "camera_mode")
    if settings.camera_mode == "SCENE":
        layout.prop(settings, "box")
        known = box_of(smoke) is not None
        layout.operator("smokelift.make_box", text="Frame Box" if known else "Make Box", icon="MESH_CUBE")
        layout.prop(settings, "inlet")
    row = layout.row()
    row.active = not has_inlet(smoke)  # that says it
    draw_automatic(row, settings, "distance").operator("smokelift.place", text="", icon="EYEDROPPER")
    layout.prop(settings, "light_mode")
    draw_closed(layout, settings)


def _draw_mask(layout: bpy.types.UILayout, context: bpy.types.Context, settings: bpy.types.PropertyGroup) -> None:
    """The mask that is drawn, and which side of it is smoke; without one, the field for a file."""
    drawn = settings.drawn_mask is not None
    row = layout.row(align=True)
    row.prop(settings, "drawn_mask")
    row.operator("smokelift.new_mask", text="" if drawn else "New", icon="GREASEPENCIL" if drawn else "ADD")
    if drawn:
        draw_text(layout, context, "Smoke may be inside its lines; outside, if its layer is inverted.", "INFO")
    else:
        layout.prop(settings, "mask", text=" ", placeholder=iface_("white is smoke"))


def draw_closed(layout: bpy.types.UILayout, settings: bpy.types.PropertyGroup) -> None:
    """A button for each side of the box, below the name of the row: beside it their names would be cut off."""
    column = layout.column(align=True)
    column.use_property_split = False
    column.label(text=settings.bl_rna.properties["closed"].name)
    column.row(align=True).prop(settings, "closed")


def _draw_qualities(layout: bpy.types.UILayout, context: bpy.types.Context, smoke: bpy.types.Object) -> None:
    """A button for each quality with what it takes and loses; the first drawing of the tab starts the estimate.

    While a change is estimated, the figures of before stay, grayed.
    """
    state, settings = context.window_manager.smokelift, smoke.smokelift
    checked = shot_check.is_checked(state, smoke)
    done = checked and state.check_done
    costs = state.costs if state.costs_smoke == smoke.session_uid and not (checked and state.check_error) else {}
    column = layout.column(align=True)
    column.use_property_split = False
    title = settings.bl_rna.properties["quality"].name
    for cell, word in zip(_cells(column), (title, "Time", "RAM", "Disk", "Lost"), strict=True):
        cell.label(text=word)
    for item in settings.bl_rna.properties["quality"].enum_items:
        button, *cells = _cells(column)
        button.prop_enum(settings, "quality", item.identifier)
        cost = costs.get(item.identifier)
        if cost is not None:
            words = (
                _brief_time(cost.seconds),
                _brief(cost.memory, "G"),
                _brief_disk(cost.disk),
                _brief_share(cost.lost),
            )
            for cell, word in zip(cells, words, strict=True):
                cell.active = done
                cell.alert = cost.memory > state.memory_free
                cell.label(text=word, translate=False)
    if not checked:
        layout.operator("smokelift.check", icon="VIEWZOOM")
        shot_check.check_soon(context)
    elif state.check_error:
        draw_text(layout, context, state.check_error, "ERROR")
    elif not done:
        text = iface_("Reading the clip: {:s}").format(duration(state.check_seconds))
        layout.label(text=text if state.check_seconds else iface_("Reading the clip"), translate=False, icon="TIME")
    elif (own := costs.get(settings.quality)) is not None:
        text = iface_("{} x {} x {} voxels").format(*own.resolution)
        layout.label(text=text, translate=False, icon="MESH_GRID")
        if own.memory > state.memory_free:
            text = iface_("Only {:.1f} GiB are free: choose a lower quality.")
            draw_text(layout, context, text.format(state.memory_free), "ERROR")
    if done:
        for doubt in state.doubts:
            draw_doubt(layout, context, doubt.kind, doubt.sentence)


def _cells(column: bpy.types.UILayout) -> list[bpy.types.UILayout]:
    """The cells of a line of the table of qualities."""
    cells, left = [], 1.0
    for share in CELLS:
        column = column.split(factor=share / left, align=True)
        cells.append(column.row(align=True))
        left -= share
    return [*cells, column.row(align=True)]


def _brief_time(seconds: float) -> str:
    return duration(seconds) if seconds < 3570.0 else _brief(seconds / 3600.0, "h")


def _brief_disk(megabytes: float) -> str:
    return f"{megabytes:.0f} M" if megabytes < 99.5 else _brief(megabytes / 1000.0, "G")


def _brief_share(share: float) -> str:
    """A share in percent; nothing below 0, where it is unknown."""
    if share < 0.0:
        return ""
    return f"{share:.1%}" if 0.0005 <= share < 0.00995 else f"{share:.0%}"


def _brief(value: float, unit: str) -> str:
    """To two digits at least: a cell of the table holds six letters."""
    return f"{value:.1f} {unit}" if value < 9.95 else f"{value:.0f} {unit}"


def _draw_run(layout: bpy.types.UILayout, context: bpy.types.Context, smoke: bpy.types.Object) -> None:
    jobs = context.window_manager.smokelift.jobs
    own = [row for row in jobs if row.smoke_uid == smoke.session_uid]
    column = layout.column()
    column.scale_y = 1.5
    if all(row.outcome in ENDED for row in own):
        begun = smoke_takes.unfinished(smoke)
        if begun is not None and begun.read().frames:
            last = volume.frames_before_take(smoke, begun) + begun.read().frames
            text = iface_("Resume after Frame {:d}").format(last)
            column.operator("smokelift.resume", text=text, translate=False, icon="FILE_REFRESH")
            column.operator("smokelift.run", text="Start Again", icon="PLAY")
        else:
            column.operator("smokelift.run", text="Make Smoke", icon="PLAY")
    else:
        column.operator("smokelift.run", text="Make Another After This", icon="PLAY")
    for row in jobs:
        _draw_job(layout, context, smoke, row)
    if volume.shown_take(smoke) is not None:
        layout.operator("smokelift.set_up", icon="CAMERA_DATA")
        seen = volume.shown_range(smoke)
        if seen and smoke.data.sequence_mode == "CLIP" and not seen[0] <= context.scene.frame_current <= seen[1]:
            text = iface_("The smoke is seen in frames {:d} to {:d}.")
            draw_text(layout, context, text.format(*seen), "INFO")
        known = volume.provenance_note(smoke)
        if known:
            draw_text(layout, context, known, "INFO")
        index = volume.shown_take(smoke).read().index
        if index and index["complete"]:
            layout.operator("smokelift.vary", icon="MOD_NOISE")
            if lacks_proxy(smoke, index):
                column = layout.column(align=True)
                draw_text(column, context, "This smoke is large: a proxy keeps the viewport fast.", "INFO")
                column.operator("smokelift.make_proxy", icon="MOD_REMESH")


def _draw_job(
    layout: bpy.types.UILayout, context: bpy.types.Context, shown: bpy.types.Object, row: bpy.types.PropertyGroup
) -> None:
    box = layout.box()
    smoke = find_smoke(row.smoke_uid)
    if smoke is not None and smoke != shown:
        box.label(text=smoke.name, icon="VOLUME_DATA")
    if row.outcome == "waiting":
        box.label(text="Queued", icon="SORTTIME")
    elif row.outcome == "running":
        draw_progress(box, row)
    else:
        draw_text(box, context, row.sentence, "ERROR" if row.outcome == "failed" else "INFO")
    if row.icon:
        box.template_icon(icon_value=row.icon, scale=8.0)
    if row.outcome in ENDED:
        for doubt in row.doubts:
            draw_doubt(box, context, doubt.kind, doubt.sentence)
        box.operator("smokelift.open_log", icon="TEXT").take = row.take
    else:
        box.operator("smokelift.cancel", text="Cancel", icon="CANCEL").take = row.take


def draw_progress(layout: bpy.types.UILayout, row: bpy.types.PropertyGroup) -> None:
    """How far a run has come."""
    layout.progress(factor=row.done / row.total if row.total else 0.0, text=_progress(row))


def _progress(row: bpy.types.PropertyGroup) -> str:
    if row.cancel:
        return "Stopping"
    if not row.total:
        return "Reading the clip"
    text = iface_("{:d} of {:d}").format(row.done, row.total)
    return text if row.seconds_left < 0.0 else iface_("{:s}, {:s} left").format(text, duration(row.seconds_left))


def duration(seconds: float) -> str:
    """A time in words, to the second below a minute and to the minute above."""
    if seconds < 60.0:
        return f"{max(1, round(seconds))} s"
    minutes = round(seconds / 60.0)
    return f"{minutes} min" if minutes < 60 else f"{minutes // 60} h {minutes % 60:02d} min"


def size(megabytes: float) -> str:
    """An amount of disk in words."""
    return f"{megabytes:.0f} MB" if megabytes < 1000.0 else f"{megabytes / 1000.0:.1f} GB"


def draw_doubt(layout: bpy.types.UILayout, context: bpy.types.Context, kind: str, words: str) -> None:
    """Why a result may be wrong, and the button that helps."""
    draw_text(layout, context, words, "ERROR")
    if kind in MASKED:
        smoke = active_smoke(context.scene)
        drawn = smoke is not None and smoke.smokelift.drawn_mask is not None
        layout.operator("smokelift.new_mask", text="Edit Mask" if drawn else "New Mask", icon="MOD_MASK")


def draw_text(layout: bpy.types.UILayout, context: bpy.types.Context, text: str, icon: str = "NONE") -> None:
    """A label in the user's language, wrapped to the sidebar's width."""
    text = iface_(text)
    points = context.region.width / context.preferences.system.ui_scale - (50.0 if icon == "NONE" else 70.0)
    lines = textwrap.wrap(text, max(16, int(points / POINTS_A_LETTER)))
    column = layout.column(align=True)
    column.scale_y = 0.8
    for number, line in enumerate(lines):
        column.label(text=line, translate=False, icon=icon if number == 0 or icon == "NONE" else "BLANK1")


class SMOKELIFT_PT_view(_Main, bpy.types.Panel):
    """The panel in the 3D View."""

    bl_space_type = "VIEW_3D"


class SMOKELIFT_PT_clip(_Main, bpy.types.Panel):
    """The panel in the Movie Clip Editor."""

    bl_space_type = "CLIP_EDITOR"


register, unregister = bpy.utils.register_classes_factory((SMOKELIFT_PT_view, SMOKELIFT_PT_clip))
