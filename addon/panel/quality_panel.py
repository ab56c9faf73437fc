"""The qualities in the tab, with what each takes and loses."""

import bpy
from bpy.app.translations import pgettext_iface as iface_

from ..core.sentences import duration
from ..result import run_queue, shot_check
from ..scene.smoke import active_smoke
from .layout import RequiresClip, draw_doubt, draw_text


class SMOKELIFT_OT_check(RequiresClip, bpy.types.Operator):
    """Estimate time, memory and disk space of the run, and list its assumptions"""

    bl_idname = "smokelift.check"
    bl_label = "Check Shot"
    bl_options = {"INTERNAL"}

    def execute(self, context: bpy.types.Context) -> set[str]:
        state = context.window_manager.smokelift
        smoke = active_smoke(context.scene)
        state.check_smoke, state.check_place = smoke.session_uid, shot_check.place(smoke)
        state.check_ticks = shot_check.TICKS
        run_queue.work(context)
        return {"FINISHED"}


CELLS = 0.245, 0.215, 0.18, 0.18
"""Shares of a line of the table of qualities: button, time, memory, disk; the rest is what is lost."""


def draw_qualities(layout: bpy.types.UILayout, context: bpy.types.Context, smoke: bpy.types.Object) -> None:
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


register, unregister = bpy.utils.register_classes_factory((SMOKELIFT_OT_check,))
