"""How operators and panels are declared, when they can be used, and how operators say what is in the way."""

from collections.abc import Callable, Mapping, Sequence
from typing import Any, NamedTuple

import bpy
from bpy import props

from ..core import ShotError
from ..result.side_job import writing_job
from ..scene import volume
from ..scene.smoke import active_smoke

EDITORS = {"view": "VIEW_3D", "clip": "CLIP_EDITOR"}  # the editors that have the tab in their sidebar
UNDO = {"REGISTER", "UNDO"}  # options of an operator that can be undone, and adjusted
FILE = props.StringProperty(subtype="FILE_PATH", options={"SKIP_SAVE"})  # what a file browser gives its operator
FOLDER = props.StringProperty(subtype="DIR_PATH", options={"SKIP_SAVE"})
HIDDEN = props.StringProperty(options={"SKIP_SAVE", "HIDDEN"})  # a text that a button gives its operator

Act = Callable[..., str | None]
"""Does something in a context with the active smoke; ShotError if something is in the way. What it returns is said."""


class Need(NamedTuple):
    """What something needs that is done with the active smoke, or without one."""

    why: str  # it cannot be done otherwise
    is_there: Callable[[bpy.types.Context, bpy.types.Object | None], Any]


needs_smoke = Need("Add smoke first", lambda _, smoke: smoke)
needs_clip = Need("Choose a clip first", lambda _, smoke: smoke and smoke.smokelift.clip)
needs_result = Need("Make smoke first", lambda _, smoke: smoke and volume.shown_take(smoke))
needs_rest = Need("Other files are being written: wait for them, or cancel that", lambda *_: not writing_job.writing)


class Needing:
    """What Blender offers only where nothing that it needs is missing; the first that is says so."""

    needs: Sequence[Need] = ()

    def __init_subclass__(cls) -> None:
        cls.bl_idname = cls.__name__.replace("SMOKELIFT_OT_", "smokelift.")

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        smoke = active_smoke(context.scene)
        why = next((need.why for need in cls.needs if not need.is_there(context, smoke)), "")
        if why and issubclass(cls, bpy.types.Operator):  # a panel is left out in silence
            cls.poll_message_set(why)
        return not why


def operator(
    label: str, *needs: Need, base: type = Needing, given: Mapping[str, Any] | None = None, **attributes: Any
) -> Callable[[Act], type]:
    """Make an operator of what it does: the class SMOKELIFT_OT_NAME, whose tooltip is the function's docstring.

    Its button says the label, and it can be used where nothing is missing that it needs. It has the base and
    further attributes. What it is ``given``, Blender's properties, the function gets by their names.
    """

    def made(act: Act) -> type:
        def execute(this: bpy.types.Operator, context: bpy.types.Context) -> set[str]:
            values = {name: getattr(this, name) for name in given or ()}
            try:
                said = act(context, active_smoke(context.scene), **values)
            except ShotError as error:
                this.report({"ERROR"}, str(error))
                return {"CANCELLED"}
            if said:
                this.report({"INFO"}, said)
            return {"FINISHED"}

        tooltip = " ".join((act.__doc__ or "").split())
        own = {"__module__": act.__module__, "__doc__": tooltip, "__annotations__": given or {}, **attributes}
        own |= {"bl_label": label, "needs": needs, "execute": execute}
        return type(f"SMOKELIFT_OT_{act.__name__}", (base, bpy.types.Operator), own)

    return made


class OpensBrowser(Needing):
    """One that asks for a folder, or a file."""

    filter_folder: props.BoolProperty(default=True, options={"HIDDEN", "SKIP_SAVE"})

    def invoke(self, context: bpy.types.Context, _event: bpy.types.Event) -> set[str]:
        context.window_manager.fileselect_add(self)
        return {"RUNNING_MODAL"}


class ChoosesFile(OpensBrowser):
    """One that asks for a picture or a video."""

    filter_movie: props.BoolProperty(default=True, options={"HIDDEN", "SKIP_SAVE"})
    filter_image: props.BoolProperty(default=True, options={"HIDDEN", "SKIP_SAVE"})


Draw = Callable[[bpy.types.UILayout, bpy.types.Context, bpy.types.Object], None]  # draws the tab or a part of it


def panels(name: str, label: str, *needs: Need, **attributes: Any) -> Callable[[Draw], tuple[type, ...]]:
    """Make of what draws it a panel of the tab in both editors, SMOKELIFT_PT_view_NAME and SMOKELIFT_PT_clip_NAME.

    Without a name it is the tab itself, with one a part of it, closed at first, and shown where nothing that it needs
    is missing. Names of settings are drawn on their left. Its classes have further attributes.
    """

    def made(draw: Draw) -> tuple[type, ...]:
        def draw_panel(panel: bpy.types.Panel, context: bpy.types.Context) -> None:
            panel.layout.use_property_split = True
            panel.layout.use_property_decorate = False
            draw(panel.layout, context, active_smoke(context.scene))

        classes = []
        for editor, space in EDITORS.items():
            tab = f"SMOKELIFT_PT_{editor}"
            own = {"__module__": draw.__module__, "draw": draw_panel, "needs": needs, **attributes}
            own |= {"bl_space_type": space, "bl_region_type": "UI", "bl_category": "Smokelift", "bl_label": label}
            if name:
                own |= {"bl_parent_id": tab, "bl_options": {"DEFAULT_CLOSED"}}
            classes.append(type(f"{tab}_{name}" if name else tab, (Needing, bpy.types.Panel), own))
        return tuple(classes)

    return made
