"""What the parts of the tab share: where they stand, when they and their buttons work, and how they draw."""

import textwrap
from collections.abc import Callable
from typing import Any

import bpy
from bpy.app.translations import pgettext_iface as iface_
from bpy.props import BoolProperty

from ..core.sentences import duration
from ..result.side_job import side_job
from ..scene import volume
from ..scene.smoke import active_smoke


def automatic_unless(name: str, label: str, start: float | Callable[[Any], float]) -> Any:
    """A tick for a number that is chosen automatically where it is 0; ticked, the number begins with ``start``.

    It keeps nothing of its own, so it cannot contradict the number.
    """
    return BoolProperty(
        name=label,
        description=f"Choose {label} by hand; otherwise it is automatic",
        get=lambda settings: getattr(settings, name) > 0,
        set=lambda settings, on: setattr(settings, name, (start(settings) if callable(start) else start) if on else 0),
    )


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


class RequiresClip:
    """For operators that read the clip."""

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        smoke = active_smoke(context.scene)
        if smoke is None or smoke.smokelift.clip is None:
            cls.poll_message_set("Choose a clip first")
            return False
        return True


class RequiresResult:
    """For operators that do something with the result on show."""

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        smoke = active_smoke(context.scene)
        if smoke is None or volume.shown_take(smoke) is None:
            cls.poll_message_set("Make smoke first")
            return False
        return True


class RequiresClipAndResult(RequiresClip, RequiresResult):
    """For operators that bring the two together."""

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        return super().poll(context) and super(RequiresClip, cls).poll(context)


class OfClip:
    """A part that is shown for a smoke with a clip."""

    bl_category = "Smokelift"
    bl_region_type = "UI"
    bl_options = {"DEFAULT_CLOSED"}

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        smoke = active_smoke(context.scene)
        return smoke is not None and smoke.smokelift.clip is not None


class OfResult(OfClip):
    """A part that is shown for a smoke with a result."""

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        smoke = active_smoke(context.scene)
        return smoke is not None and volume.shown_take(smoke) is not None


POINTS_A_LETTER = 6.5
"""Mean width of a letter in Blender's interface font at scale 1; Blender does not wrap labels."""

MASKED = ("not all may be smoke", "not all is smoke", "hardly any smoke fitted")
"""Doubts that a mask may end."""


def draw_closed(layout: bpy.types.UILayout, settings: bpy.types.PropertyGroup) -> None:
    """A button for each side of the box, below the name of the row: beside it their names would be cut off."""
    column = layout.column(align=True)
    column.use_property_split = False
    column.label(text=settings.bl_rna.properties["closed"].name)
    column.row(align=True).prop(settings, "closed")


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


def draw_work(
    layout: bpy.types.UILayout, context: bpy.types.Context, smoke: bpy.types.Object, operator: str, icon: str
) -> None:
    """The button that has files written; their progress while that is at work, and what it said at its end."""
    own = operator == side_job.operator
    if own and side_job.writing:
        job = side_job.job
        text = iface_("{:d} of {:d}").format(job.done, job.total) if job.total else iface_("Reading the clip")
        layout.progress(factor=job.done / job.total if job.total else 0.0, text=text, translate=False)
        layout.operator("smokelift.stop_writing", text="Cancel", icon="CANCEL")
    else:
        layout.operator(operator, icon=icon)
    if own and side_job.smoke == smoke.session_uid and side_job.sentence:
        draw_text(layout, context, side_job.sentence, "INFO")
        for kind, words in side_job.doubts:
            draw_doubt(layout, context, kind, words)


def draw_ticked(layout: bpy.types.UILayout, settings: bpy.types.PropertyGroup, tick: str, *names: str) -> None:
    """Settings that a tick makes count."""
    row = layout.row(heading=settings.bl_rna.properties[tick].name)
    row.prop(settings, tick, text="")
    values = row.row(align=True)
    values.active = getattr(settings, tick)
    for name in names:
        values.prop(settings, name, text="")
