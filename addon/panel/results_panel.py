"""The sub-panel Results: the files of all runs, which are shown, compared, named and deleted there."""

from pathlib import Path

import bpy
from bpy.props import StringProperty

from ..core import ShotError
from ..core.sentences import disk_size
from ..core.take import Take
from ..result import smoke_takes
from ..result.smoke_takes import consequences, directories_in_use, earlier_takes
from ..scene import volume
from ..scene.blender import absolute, iface_, redraw, rpt_
from .common import FOLDER, HIDDEN, UNDO, OpensBrowser, needs_clip, needs_result, needs_smoke, operator, panels
from .layout import draw_text


def _finished(directory: str) -> Take:
    """The result in a directory; ShotError if it has no finished frame."""
    take = Take(Path(directory))
    if not take.read().frames:
        raise ShotError(rpt_("There is no finished frame in {:s}.").format(directory))
    return take


@operator("Show Result", needs_clip, bl_options=UNDO, given={"take": HIDDEN})
def show_take(_context: bpy.types.Context, smoke: bpy.types.Object, take: str) -> None:
    """Show this result in the smoke. Its place and its material stay as they are"""
    smoke_takes.choose(smoke, _finished(take))


@operator("Show Beside", needs_result, bl_options=UNDO, given={"take": HIDDEN})
def show_beside(_context: bpy.types.Context, smoke: bpy.types.Object, take: str) -> None:
    """Show this result beside the smoke, in a Volume object of its own that can be deleted like any other"""
    volume.show_beside(smoke, _finished(take))


@operator("Choose Moved Folder", needs_result, base=OpensBrowser, given={"directory": FOLDER}, bl_options=UNDO)
def choose_results(_context: bpy.types.Context, smoke: bpy.types.Object, directory: str) -> None:
    """Choose the folder that the smoke's results were moved to"""
    smoke_takes.move_results(smoke, absolute(directory))


def _ask_name(this: bpy.types.Operator, context: bpy.types.Context, _event: bpy.types.Event) -> set[str]:
    this.title = Take(Path(this.take)).read().title
    return context.window_manager.invoke_props_dialog(this)


NAMED = {"take": HIDDEN, "title": StringProperty(name="Name", options={"SKIP_SAVE"})}


@operator("Name Result", needs_smoke, given=NAMED, invoke=_ask_name)
def name_take(_context: bpy.types.Context, _smoke: bpy.types.Object, take: str, title: str) -> None:
    """Give this result a name"""
    Take(Path(take)).give_title(title)
    redraw()


def _confirm(
    this: bpy.types.Operator, context: bpy.types.Context, event: bpy.types.Event, removable: list[Take], *said: str
) -> set[str]:
    """Ask before takes are deleted: their names, how large they are, and what else there is to be said."""
    named = rpt_("{:s}: {:s}.").format(", ".join(take.read().title for take in removable), _size(removable))
    options = {"message": " ".join([named, *said]), "confirm_text": "Delete", "icon": "WARNING"}
    return context.window_manager.invoke_confirm(this, event, **options)


def _confirm_one(this: bpy.types.Operator, context: bpy.types.Context, event: bpy.types.Event) -> set[str]:
    take = Take(Path(this.take))
    return _confirm(this, context, event, [take], *consequences(context, take))


@operator("Delete Result?", needs_smoke, given={"take": HIDDEN}, invoke=_confirm_one)
def remove_take(_context: bpy.types.Context, _smoke: bpy.types.Object, take: str) -> None:
    """Delete the files of this result"""
    if Take(Path(take)).directory.resolve() in directories_in_use():
        raise ShotError("A Volume shows this result, or a run needs it: show another one first.")
    Take(Path(take)).remove()


def _confirm_earlier(this: bpy.types.Operator, context: bpy.types.Context, event: bpy.types.Event) -> set[str]:
    removable = earlier_takes(context)
    this.asked = "\n".join(str(take.directory) for take in removable)
    return _confirm(this, context, event, removable)


@operator("Delete Earlier Results?", needs_clip, given={"asked": HIDDEN}, invoke=_confirm_earlier)
def remove_takes(context: bpy.types.Context, _smoke: bpy.types.Object, asked: str) -> None:
    """Delete the files of the results before the one on show. What a Volume of this file shows, what another result
    was made of and what other files may show stays
    """
    for take in earlier_takes(context):
        if not asked or str(take.directory) in asked.split("\n"):
            take.remove()


def _size(takes: list[Take]) -> str:
    return disk_size(sum(take.size() for take in takes))


@panels("results", "Results", needs_clip)
def _draw_results(layout: bpy.types.UILayout, context: bpy.types.Context, smoke: bpy.types.Object) -> None:
    shown = volume.shown_take(smoke)
    found = [take for take in smoke_takes.own_takes(smoke) if take.read().frames]
    column = layout.column(align=True)
    for take in found:
        row = column.row(align=True)
        text = iface_("{:s}, {:d} fr., {:s}").format(take.read().title, take.read().frames, disk_size(take.size()))
        row.operator("smokelift.show_take", text=text, depress=take == shown).take = str(take.directory)
        row.operator("smokelift.name_take", text="", icon="GREASEPENCIL").take = str(take.directory)
        row.operator("smokelift.remove_take", text="", icon="TRASH").take = str(take.directory)
    other = volume.take_before(smoke)
    if other is not None:
        column, name = layout.column(), str(other.directory)
        column.operator("smokelift.show_take", text="Previous Result", icon="FILE_REFRESH").take = name
        text = iface_("Show {:s} Beside").format(other.read().title)
        column.operator("smokelift.show_beside", text=text, icon="MOD_MIRROR").take = name
    if found:
        draw_text(layout, "In {:s}", "FILE_FOLDER", str(smoke_takes.output_folder(smoke)))
    removable = earlier_takes(context)
    row = layout.row()
    row.enabled = bool(removable)
    text = iface_("Delete Earlier Results: {:s}").format(_size(removable))
    row.operator("smokelift.remove_takes", text=text, translate=False)
