"""The sub-panel Results: the files of all runs, which are shown, compared, named and deleted there."""

from pathlib import Path

import bpy
from bpy.app.translations import pgettext_iface as iface_
from bpy.app.translations import pgettext_rpt as rpt_
from bpy.props import StringProperty

from ..core.sentences import disk_size
from ..core.take import Take, TakeError
from ..result import smoke_takes
from ..result.smoke_takes import consequences, directories_in_use, earlier_takes
from ..scene import volume
from ..scene.blender import redraw
from ..scene.smoke import active_smoke
from .layout import OfClip, RequiresClip, RequiresResult, draw_text


class SMOKELIFT_OT_show_take(RequiresClip, bpy.types.Operator):
    """Show this result in the smoke. Its place and its material stay as they are"""

    bl_idname = "smokelift.show_take"
    bl_label = "Show Result"
    bl_options = {"REGISTER", "UNDO"}

    take: StringProperty(options={"SKIP_SAVE", "HIDDEN"})

    def execute(self, context: bpy.types.Context) -> set[str]:
        take = Take(Path(self.take))
        if not take.read().frames:
            self.report({"ERROR"}, rpt_("There is no finished frame in {:s}.").format(str(take.directory)))
            return {"CANCELLED"}
        smoke_takes.choose(active_smoke(context.scene), take)
        return {"FINISHED"}


class SMOKELIFT_OT_switch_take(RequiresResult, bpy.types.Operator):
    """Show the result that was shown before. Press again to come back"""

    bl_idname = "smokelift.switch_take"
    bl_label = "Previous Result"
    bl_options = {"REGISTER", "UNDO"}

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        if not super().poll(context):
            return False
        if volume.take_before(active_smoke(context.scene)) is None:
            cls.poll_message_set("Show another result first")
            return False
        return True

    def execute(self, context: bpy.types.Context) -> set[str]:
        smoke = active_smoke(context.scene)
        smoke_takes.choose(smoke, volume.take_before(smoke))
        return {"FINISHED"}


class SMOKELIFT_OT_show_beside(RequiresResult, bpy.types.Operator):
    """Show this result beside the smoke, in a Volume object of its own that can be deleted like any other"""

    bl_idname = "smokelift.show_beside"
    bl_label = "Show Beside"
    bl_options = {"REGISTER", "UNDO"}

    take: StringProperty(options={"SKIP_SAVE", "HIDDEN"})

    def execute(self, context: bpy.types.Context) -> set[str]:
        take = Take(Path(self.take))
        if volume.show_beside(active_smoke(context.scene), take) is None:
            self.report({"ERROR"}, rpt_("There is no finished frame in {:s}.").format(str(take.directory)))
            return {"CANCELLED"}
        return {"FINISHED"}


class SMOKELIFT_OT_name_take(bpy.types.Operator):
    """Give this result a name"""

    bl_idname = "smokelift.name_take"
    bl_label = "Name Result"

    take: StringProperty(options={"SKIP_SAVE", "HIDDEN"})
    title: StringProperty(name="Name", options={"SKIP_SAVE"})

    def invoke(self, context: bpy.types.Context, _event: bpy.types.Event) -> set[str]:
        self.title = Take(Path(self.take)).read().title
        return context.window_manager.invoke_props_dialog(self)

    def execute(self, context: bpy.types.Context) -> set[str]:
        try:
            Take(Path(self.take)).give_title(self.title)
        except TakeError as error:
            self.report({"ERROR"}, str(error))
            return {"CANCELLED"}
        redraw(context.window_manager)
        return {"FINISHED"}


class SMOKELIFT_OT_remove_take(bpy.types.Operator):
    """Delete the files of this result"""

    bl_idname = "smokelift.remove_take"
    bl_label = "Delete Result?"

    take: StringProperty(options={"SKIP_SAVE", "HIDDEN"})

    def invoke(self, context: bpy.types.Context, event: bpy.types.Event) -> set[str]:
        take = Take(Path(self.take))
        message = " ".join([_frees([take]), *consequences(context, take)])
        return _confirm(self, context, event, message)

    def execute(self, context: bpy.types.Context) -> set[str]:
        take = Take(Path(self.take))
        if take.directory.resolve() in directories_in_use(context):
            self.report({"ERROR"}, "A Volume shows this result, or a run needs it: show another one first.")
            return {"CANCELLED"}
        take.remove()
        return {"FINISHED"}


class SMOKELIFT_OT_remove_takes(RequiresClip, bpy.types.Operator):
    """Delete results that nothing needs."""

    bl_idname = "smokelift.remove_takes"
    bl_description = (
        "Delete the files of the results before the one on show. What a Volume of this file shows, what another result "
        "was made of and what other files may show stays"
    )
    bl_label = "Delete Earlier Results?"

    asked: StringProperty(options={"SKIP_SAVE", "HIDDEN"})

    def invoke(self, context: bpy.types.Context, event: bpy.types.Event) -> set[str]:
        doomed = earlier_takes(context)
        self.asked = "\n".join(str(take.directory) for take in doomed)
        return _confirm(self, context, event, _frees(doomed))

    def execute(self, context: bpy.types.Context) -> set[str]:
        for take in earlier_takes(context):
            if not self.asked or str(take.directory) in self.asked.split("\n"):
                take.remove()
        return {"FINISHED"}


def _confirm(
    operator: bpy.types.Operator, context: bpy.types.Context, event: bpy.types.Event, message: str
) -> set[str]:
    """Ask before files are deleted."""
    manager = context.window_manager
    return manager.invoke_confirm(operator, event, message=message, confirm_text="Delete", icon="WARNING")


def _frees(doomed: list[Take]) -> str:
    """What is deleted, by its names, and how large that is."""
    return rpt_("{:s}: {:s}.").format(", ".join(take.read().title for take in doomed), freed(doomed))


def freed(doomed: list[Take]) -> str:
    """How much disk takes occupy, in words."""
    return disk_size(sum(take.size() for take in doomed))


class _Results(OfClip):
    bl_label = "Results"

    def draw(self, context: bpy.types.Context) -> None:
        layout = self.layout
        smoke = active_smoke(context.scene)
        shown = volume.shown_take(smoke)
        found = smoke_takes.own_takes(smoke)
        column = layout.column(align=True)
        for take in found:
            row = column.row(align=True)
            text = iface_("{:s}, {:d} fr., {:s}").format(take.read().title, take.read().frames, disk_size(take.size()))
            row.operator("smokelift.show_take", text=text, depress=take == shown).take = str(take.directory)
            row.operator("smokelift.name_take", text="", icon="GREASEPENCIL").take = str(take.directory)
            row.operator("smokelift.remove_take", text="", icon="TRASH").take = str(take.directory)
        if len(found) > 1:
            column = layout.column()
            column.operator("smokelift.switch_take", icon="FILE_REFRESH")
            other = volume.take_before(smoke)
            if other is not None:
                text = iface_("Show {:s} Beside").format(other.read().title)
                column.operator("smokelift.show_beside", text=text, icon="MOD_MIRROR").take = str(other.directory)
        if found:
            draw_text(layout, context, iface_("In {:s}").format(str(smoke_takes.output_folder(smoke))), "FILE_FOLDER")
        doomed = earlier_takes(context)
        row = layout.row()
        row.enabled = bool(doomed)
        text = iface_("Delete Earlier Results: {:s}").format(freed(doomed))
        row.operator("smokelift.remove_takes", text=text, translate=False)


class SMOKELIFT_PT_view_results(_Results, bpy.types.Panel):
    """The panel in the 3D View."""

    bl_space_type = "VIEW_3D"
    bl_parent_id = "SMOKELIFT_PT_view"


class SMOKELIFT_PT_clip_results(_Results, bpy.types.Panel):
    """The panel in the Movie Clip Editor."""

    bl_space_type = "CLIP_EDITOR"
    bl_parent_id = "SMOKELIFT_PT_clip"


_CLASSES = (
    SMOKELIFT_OT_show_take,
    SMOKELIFT_OT_switch_take,
    SMOKELIFT_OT_show_beside,
    SMOKELIFT_OT_name_take,
    SMOKELIFT_OT_remove_take,
    SMOKELIFT_OT_remove_takes,
    SMOKELIFT_PT_view_results,
    SMOKELIFT_PT_clip_results,
)

register, unregister = bpy.utils.register_classes_factory(_CLASSES)
