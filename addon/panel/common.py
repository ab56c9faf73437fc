"""What operators, panels and settings share: when they can be used, and how operators say what is in the way."""

from collections.abc import Callable
from typing import Any, ClassVar

import bpy
from bpy.props import BoolProperty, EnumProperty, StringProperty

from ..core.contract import SIDES
from ..core.job import EngineMissingError
from ..core.take import TakeError
from ..result.side_job import Request, writing_job
from ..scene import volume
from ..scene.blender import ShotError
from ..scene.smoke import active_smoke

EDITORS = {"view": "VIEW_3D", "clip": "CLIP_EDITOR"}
"""The editors that have the tab in their sidebar."""


def refuse(cls: type, why: str) -> bool:
    """Have Blender say why an operator cannot be used; False, for its `poll`. A panel is left out in silence."""
    if issubclass(cls, bpy.types.Operator):
        cls.poll_message_set(why)
    return False


class RequiresClip:
    """For what reads the clip."""

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        smoke = active_smoke(context.scene)
        return (smoke is not None and smoke.smokelift.clip is not None) or refuse(cls, "Choose a clip first")


class RequiresResult:
    """For what does something with the result on show."""

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        smoke = active_smoke(context.scene)
        return (smoke is not None and volume.shown_take(smoke) is not None) or refuse(cls, "Make smoke first")


class RequiresClipAndResult(RequiresClip, RequiresResult):
    """For what brings the two together."""

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        return super().poll(context) and super(RequiresClip, cls).poll(context)


class ActsOnSmoke:
    """An operator on the active smoke, which reports what is in the way. Its identifier is that of its class."""

    bl_idname: str

    def __init_subclass__(cls) -> None:
        cls.bl_idname = cls.__name__.replace("SMOKELIFT_OT_", "smokelift.")

    def act(self, context: bpy.types.Context, smoke: bpy.types.Object) -> None:
        """Do it; ShotError or TakeError if something is in the way."""
        raise NotImplementedError

    def execute(self, context: bpy.types.Context) -> set[str]:
        try:
            self.act(context, active_smoke(context.scene))
        except (ShotError, TakeError, EngineMissingError) as error:
            self.report({"ERROR"}, str(error))
            return {"CANCELLED"}
        return {"FINISHED"}


class ChangesScene(ActsOnSmoke):
    """One that can be undone, and adjusted."""

    bl_options: ClassVar = {"REGISTER", "UNDO"}


class _OpensFileBrowser:
    filter_folder: BoolProperty(default=True, options={"HIDDEN", "SKIP_SAVE"})

    def invoke(self, context: bpy.types.Context, _event: bpy.types.Event) -> set[str]:
        context.window_manager.fileselect_add(self)
        return {"RUNNING_MODAL"}


class ChoosesFile(_OpensFileBrowser):
    """An operator that asks for a picture or a video."""

    filepath: StringProperty(subtype="FILE_PATH", options={"SKIP_SAVE"})
    filter_movie: BoolProperty(default=True, options={"HIDDEN", "SKIP_SAVE"})
    filter_image: BoolProperty(default=True, options={"HIDDEN", "SKIP_SAVE"})


class ChoosesFolder(_OpensFileBrowser):
    """An operator that asks for a folder."""

    directory: StringProperty(subtype="DIR_PATH", options={"SKIP_SAVE"})


class WritesFiles(ActsOnSmoke):
    """An operator that has the engine write files; without a window it waits for them."""

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        if writing_job.writing:
            return refuse(cls, "Other files are being written: wait for them, or cancel that")
        return super().poll(context)

    def request(self, smoke: bpy.types.Object) -> Request:
        """The engine's arguments, and what is done at the end; ShotError or TakeError if something is in the way."""
        raise NotImplementedError

    def act(self, context: bpy.types.Context, smoke: bpy.types.Object) -> None:
        writing_job.start(smoke, self.request(smoke), type(self).bl_idname)
        if bpy.app.background:
            job = writing_job.job
            writing_job.wait()
            if job.outcome != "done":
                raise ShotError(job.sentence)


Draw = Callable[[bpy.types.UILayout, bpy.types.Context, bpy.types.Object], None]
"""Draws a part of the tab for the active smoke."""


def sub_panels(name: str, label: str, draw: Draw, requires: type) -> tuple[type, ...]:
    """The panels SMOKELIFT_PT_view_NAME and SMOKELIFT_PT_clip_NAME of a part of the tab, closed at first.

    Parameters
    ----------
    name, label
        Of the part, for Blender and for the user.
    draw
        Draws it, with the names of settings on their left.
    requires
        A class with the `poll` that says when it is shown.
    """

    def draw_panel(panel: bpy.types.Panel, context: bpy.types.Context) -> None:
        panel.layout.use_property_split = True
        panel.layout.use_property_decorate = False
        draw(panel.layout, context, active_smoke(context.scene))

    both = {
        "__module__": draw.__module__,
        "bl_category": "Smokelift",
        "bl_region_type": "UI",
        "bl_options": {"DEFAULT_CLOSED"},
        "bl_label": label,
    }
    return tuple(
        type(
            f"SMOKELIFT_PT_{editor}_{name}",
            (requires, bpy.types.Panel),
            {**both, "bl_space_type": space, "bl_parent_id": f"SMOKELIFT_PT_{editor}", "draw": draw_panel},
        )
        for editor, space in EDITORS.items()
    )


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


def closed_sides(description: str, **options: Any) -> Any:
    """A row of buttons, one for each side of the box."""
    items = [(side, f"{side[1]}{side[0].upper()}", "", 1 << place) for place, side in enumerate(SIDES)]
    return EnumProperty(
        name="Closed Sides", description=description, items=items, options={"ANIMATABLE", "ENUM_FLAG"}, **options
    )


def speed_changed(_settings: bpy.types.PropertyGroup, _context: bpy.types.Context) -> None:
    """Play at the new speed."""
    volume.synchronize_playback()
