"""How the parts of the tab draw what they have in common."""

import textwrap
from collections.abc import Iterable
from typing import Any

import bpy

from ..core.contract import MOVING_CAMERA
from ..core.job import Job
from ..core.sentences import REMEDIES, advice, duration, repeats
from ..result.side_job import writing_job
from ..scene.blender import iface_

POINTS_PER_LETTER = 6.5  # mean width of a letter in Blender's interface font at scale 1; Blender does not wrap labels
NEW_WIDTH = 258  # points of the sidebar in a new window; those of a sidebar that is not drawn


def draw_automatic(layout: bpy.types.UILayout, settings: bpy.types.bpy_struct, name: str) -> bpy.types.UILayout:
    """Draw a number with a cross that makes it automatic, or that it is; returns its row."""
    if getattr(settings, f"use_{name}"):
        row = layout.row(align=True)
        row.prop(settings, name)
        row.prop(settings, f"use_{name}", text="", icon="X", invert_checkbox=True)
    else:  # ticked, as an empty box before the word would read as off
        row = layout.row(heading=settings.bl_rna.properties[name].name)
        row.prop(settings, f"use_{name}", text="Automatic", invert_checkbox=True)
    return row


def draw_settings(layout: bpy.types.UILayout, settings: bpy.types.bpy_struct, *names: str, active: bool = True) -> None:
    """Settings one below the other, gray where they count for nothing."""
    column = layout.column()
    column.active = active
    for name in names:
        column.prop(settings, name)


def draw_closed(layout: bpy.types.UILayout, settings: bpy.types.PropertyGroup) -> None:
    """A button for each side of the box, below the name of the row: beside it their names would be cut off."""
    column = layout.column(align=True)
    column.use_property_split = False
    column.label(text=settings.bl_rna.properties["closed"].name)
    column.row(align=True).prop(settings, "closed")


def draw_progress(layout: bpy.types.UILayout, work: Job, operator: str) -> bpy.types.OperatorProperties:
    """How far a run or a job has come, and beside it the cross that cancels it, whose properties are returned."""
    row = layout.row(align=True)
    text = iface_("{:d} of {:d}").format(work.done, work.total) if work.total else iface_("Reading the clip")
    if work.stopping:
        text = iface_("Stopping")
    elif work.total and work.seconds_left is not None:
        text = iface_("{:s}, {:s} left").format(text, duration(work.seconds_left))
    row.progress(factor=work.done / work.total if work.total else 0.0, text=text, translate=False)
    return row.operator(operator, text="", icon="X")


def draw_doubts(
    layout: bpy.types.UILayout, smoke: bpy.types.Object, doubts: Iterable[tuple[str, str]], said: set[str]
) -> None:
    """Why a result may be wrong (kinds and words), what is left to do about it, and the button that does it.

    Kinds that are ``said`` elsewhere in the tab are left out, and these are added to them.
    """
    settings = smoke.smokelift
    given = {
        "mask": settings.mask or settings.drawn_mask is not None,
        "plate": settings.plate_mode in ("FILE", "FRAMES"),
        "strokes": settings.strokes is not None,
        "light": settings.light_mode == "SCENE",
        "medium": settings.use_medium,
    }
    for kind, words in doubts:
        if repeats(kind, said):
            continue
        said.add(kind)
        draw_text(layout, words, "ERROR")
        if left := advice(kind, [name for name, is_given in given.items() if is_given]):
            draw_text(layout, left, "BLANK1")
        if "mask" in dict(REMEDIES.get(kind, ())):
            text = "New Mask" if settings.drawn_mask is None else "Edit Mask"
            layout.operator("smokelift.new_mask", text=text, icon="MOD_MASK")


def draw_failure(layout: bpy.types.UILayout, words: str) -> None:
    """Why a check or a run ended without a result, and the button that helps."""
    draw_text(layout, words, "ERROR")
    if MOVING_CAMERA in words:
        layout.operator("smokelift.show_clip", text="Track or Stabilize", icon="TRACKER")


def draw_hint(layout: bpy.types.UILayout, words: str, operator: str, icon: str = "NONE") -> None:
    """A sentence, and right below it the button that does what it says."""
    column = layout.column(align=True)
    draw_text(column, words, "INFO")
    column.operator(operator, icon=icon)


def draw_text(layout: bpy.types.UILayout, text: str, icon: str = "NONE", *figures: Any) -> None:
    """A label in the user's language, into which the figures are put, wrapped to the sidebar's width."""
    text = iface_(text).format(*figures) if figures else iface_(text)
    region = bpy.context.region
    width = NEW_WIDTH if region is None else region.width / bpy.context.preferences.system.ui_scale
    lines = textwrap.wrap(text, max(16, int((width - (50.0 if icon == "NONE" else 70.0)) / POINTS_PER_LETTER)))
    column = layout.column(align=True)
    column.scale_y = 0.8
    for number, line in enumerate(lines):
        column.label(text=line, translate=False, icon=icon if number == 0 or icon == "NONE" else "BLANK1")


def draw_work(layout: bpy.types.UILayout, smoke: bpy.types.Object, operator: str, icon: str) -> None:
    """The button that has files written; their progress while that is at work, and what it said at its end."""
    own = operator == writing_job.operator
    if own and writing_job.writing:
        draw_progress(layout, writing_job.job, "smokelift.stop_writing")
    else:
        layout.operator(operator, icon=icon)
    if own and writing_job.smoke == smoke.session_uid and writing_job.sentence:
        draw_text(layout, writing_job.sentence, "INFO")
        draw_doubts(layout, smoke, writing_job.doubts, set())


def draw_ticked(layout: bpy.types.UILayout, settings: bpy.types.PropertyGroup, tick: str, *names: str) -> None:
    """Settings that a tick makes count."""
    row = layout.row(heading=settings.bl_rna.properties[tick].name)
    row.prop(settings, tick, text="")
    values = row.row(align=True)
    for name in names if getattr(settings, tick) else ():  # else they may be of another result
        values.prop(settings, name, text="")
