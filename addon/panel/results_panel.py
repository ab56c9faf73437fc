"""The sub-panel Results: the files of all runs, which are shown, compared, named and deleted there."""

from pathlib import Path

import bpy
from bpy.app.translations import pgettext_iface as iface_
from bpy.app.translations import pgettext_rpt as rpt_
from bpy.props import StringProperty

from ..core import ShotError
from ..core.sentences import disk_size
from ..core.take import Take
from ..result import smoke_takes
from ..result.smoke_takes import consequences, directories_in_use, earlier_takes
from ..scene import volume
from ..scene.blender import absolute, redraw
from .common import FOLDER, HIDDEN, ActsOnSmoke, ChangesScene, OpensBrowser, needs_clip, needs_result, operator, panels
from .layout import draw_text


def _finished(directory: str) -> Take:
    """The result in a directory; ShotError if it has no finished frame."""
    take = Take(Path(directory))
    if not take.read().frames:
        raise ShotError(rpt_("There is no finished frame in {:s}.").format(directory))
    return take


@operator("Show Result", needs_clip, base=ChangesScene, given={"take": HIDDEN})
def show_take(_context: bpy.types.Context, smoke: bpy.types.Object, take: str) -> None:
    """Show this result in the smoke. Its place and its material stay as they are"""
    smoke_takes.choose(smoke, _finished(take))


@operator("Show Beside", needs_result, base=ChangesScene, given={"take": HIDDEN})
def show_beside(_context: bpy.types.Context, smoke: bpy.types.Object, take: str) -> None:
    """Show this result beside the smoke, in a Volume object of its own that can be deleted like any other"""
    volume.show_beside(smoke, _finished(take))


@operator(
    "Choose Moved Folder",
    needs_result,
    base=OpensBrowser,
    given={"directory": FOLDER},
    bl_options=ChangesScene.bl_options,
)
def choose_results(_context: bpy.types.Context, smoke: bpy.types.Object, directory: str) -> None:
    """Choose the folder that the smoke's results were moved to"""
    smoke_takes.move_results(smoke, absolute(directory))


class SMOKELIFT_OT_name_take(ActsOnSmoke, bpy.types.Operator):
    """Give this result a name"""

    bl_label = "Name Result"

    take: HIDDEN
    title: StringProperty(name="Name", options={"SKIP_SAVE"})

    def invoke(self, context: bpy.types.Context, _event: bpy.types.Event) -> set[str]:
        self.title = Take(Path(self.take)).read().title
        return context.window_manager.invoke_props_dialog(self)

    def act(self, context: bpy.types.Context, smoke: bpy.types.Object) -> None:
        Take(Path(self.take)).give_title(self.title)
        redraw()


class SMOKELIFT_OT_remove_take(ActsOnSmoke, bpy.types.Operator):
    """Delete the files of this result"""

    bl_label = "Delete Result?"

    take: HIDDEN

    def invoke(self, context: bpy.types.Context, event: bpy.types.Event) -> set[str]:
        take = Take(Path(self.take))
        return _confirm(self, context, event, [take], *consequences(context, take))

    def act(self, context: bpy.types.Context, smoke: bpy.types.Object) -> None:
        take = Take(Path(self.take))
        if take.directory.resolve() in directories_in_use():
            raise ShotError("A Volume shows this result, or a run needs it: show another one first.")
        take.remove()


class SMOKELIFT_OT_remove_takes(ActsOnSmoke, bpy.types.Operator):
    """Delete results that nothing needs."""

    bl_description = (
        "Delete the files of the results before the one on show. What a Volume of this file shows, what another result "
        "was made of and what other files may show stays"
    )
    bl_label = "Delete Earlier Results?"
    needs = (needs_clip,)

    asked: HIDDEN

    def invoke(self, context: bpy.types.Context, event: bpy.types.Event) -> set[str]:
        removable = earlier_takes(context)
        self.asked = "\n".join(str(take.directory) for take in removable)
        return _confirm(self, context, event, removable)

    def act(self, context: bpy.types.Context, smoke: bpy.types.Object) -> None:
        for take in earlier_takes(context):
            if not self.asked or str(take.directory) in self.asked.split("\n"):
                take.remove()


def _confirm(
    operator: bpy.types.Operator, context: bpy.types.Context, event: bpy.types.Event, removable: list[Take], *said: str
) -> set[str]:
    """Ask before takes are deleted: their names, how large they are, and what else there is to be said."""
    named = rpt_("{:s}: {:s}.").format(", ".join(take.read().title for take in removable), _size(removable))
    options = {"message": " ".join([named, *said]), "confirm_text": "Delete", "icon": "WARNING"}
    return context.window_manager.invoke_confirm(operator, event, **options)


def _size(takes: list[Take]) -> str:
    return disk_size(sum(take.size() for take in takes))


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


PANELS = panels("results", "Results", _draw_results, needs_clip)
