"""The buttons of the tab."""

from contextlib import suppress
from pathlib import Path

import bpy
from bpy.app.translations import pgettext_rpt as rpt_
from bpy.props import BoolProperty, StringProperty
from mathutils import Vector

from . import run, shot_setup, volume
from .properties import SEEDS
from .scene_file import ShotError, box_of
from .smoke import activate, active_smoke, hide_default_cube, new_smoke, smokes
from .take import Take, TakeError, takes

LOG_TEXT = "Smokelift Log"
BOX_SHARE = 0.9
"""Width and height of a new box over those of the picture."""


class _NeedsClip:
    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        smoke = active_smoke(context.scene)
        if smoke is None or smoke.smokelift.clip is None:
            cls.poll_message_set("Choose a clip first")
            return False
        return True


class NeedsResult(_NeedsClip):
    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        if not super().poll(context):
            return False
        if volume.shown_take(active_smoke(context.scene)) is None:
            cls.poll_message_set("Make smoke first")
            return False
        return True


class SMOKELIFT_OT_add(bpy.types.Operator):
    """Add smoke that is made from a video or an image sequence"""

    bl_idname = "smokelift.add"
    bl_label = "Smoke from Video"
    bl_options = {"REGISTER", "UNDO"}

    filepath: StringProperty(subtype="FILE_PATH", options={"SKIP_SAVE"})
    filter_movie: BoolProperty(default=True, options={"HIDDEN", "SKIP_SAVE"})
    filter_image: BoolProperty(default=True, options={"HIDDEN", "SKIP_SAVE"})
    filter_folder: BoolProperty(default=True, options={"HIDDEN", "SKIP_SAVE"})

    def invoke(self, context: bpy.types.Context, _event: bpy.types.Event) -> set[str]:
        if self.filepath:  # of a video that was dropped
            return self.execute(context)
        context.window_manager.fileselect_add(self)
        return {"RUNNING_MODAL"}

    def execute(self, context: bpy.types.Context) -> set[str]:
        try:
            clip = bpy.data.movieclips.load(self.filepath, check_existing=True)
        except RuntimeError:
            text = rpt_("{:s} is no video and no picture that Blender can read: choose another.")
            self.report({"ERROR"}, text.format(self.filepath))
            return {"CANCELLED"}
        new_smoke(context.scene, clip)
        if not bpy.app.background:
            _open_tab(context)
        return {"FINISHED"}


def _open_tab(context: bpy.types.Context) -> None:
    """Show the tab in the 3D View that the operator was called from."""
    if context.area is None or context.area.type != "VIEW_3D":
        return
    context.space_data.show_region_ui = True
    sidebar = next(region for region in context.area.regions if region.type == "UI")
    with suppress(AttributeError, TypeError):  # a sidebar that was never open has no tabs yet
        sidebar.active_panel_category = "Smokelift"


def _draw_add(menu: bpy.types.Menu, _context: bpy.types.Context) -> None:
    menu.layout.operator(SMOKELIFT_OT_add.bl_idname, icon="FILE_MOVIE")


class SMOKELIFT_OT_run(_NeedsClip, bpy.types.Operator):
    """Turn the clip into a volume of smoke. Blender stays usable meanwhile"""

    bl_idname = "smokelift.run"
    bl_label = "Make Smoke"
    bl_options = {"UNDO"}

    def execute(self, context: bpy.types.Context) -> set[str]:
        return _make_smoke(self, context)


class SMOKELIFT_OT_vary(_NeedsClip, bpy.types.Operator):
    """Make the smoke again with the next variation: it looks the same from the camera, and different from the side"""

    bl_idname = "smokelift.vary"
    bl_label = "Another Variation"
    bl_options = {"UNDO"}

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        if not super().poll(context):
            return False
        if active_smoke(context.scene).smokelift.detail == 0.0:
            cls.poll_message_set("Without detail in depth there is only one smoke: raise Depth Detail first")
            return False
        return True

    def execute(self, context: bpy.types.Context) -> set[str]:
        settings = active_smoke(context.scene).smokelift
        before = settings.seed
        settings.seed = (before + 1) % SEEDS
        outcome = _make_smoke(self, context)
        if outcome == {"CANCELLED"}:
            settings.seed = before
        return outcome


def _make_smoke(operator: bpy.types.Operator, context: bpy.types.Context) -> set[str]:
    """Write a take and queue it; the operator reports what is in the way."""
    smoke = active_smoke(context.scene)
    try:
        take = run.write_take(smoke)
    except (ShotError, TakeError) as error:
        operator.report({"ERROR"}, str(error))
        return {"CANCELLED"}
    if smoke.smokelift.camera_mode == "GUESS":
        hide_default_cube(context.scene)
    run.enqueue(context, smoke, take)
    return {"FINISHED"}


class SMOKELIFT_OT_resume(_NeedsClip, bpy.types.Operator):
    """Resume the stopped run after its last finished frame, with its own settings"""

    bl_idname = "smokelift.resume"
    bl_label = "Resume"

    def execute(self, context: bpy.types.Context) -> set[str]:
        smoke = active_smoke(context.scene)
        take = run.unfinished(smoke)
        if take is None or run.busy(context.window_manager, take):
            self.report({"ERROR"}, "No stopped run to resume: press Make Smoke.")
            return {"CANCELLED"}
        try:
            run.find_again(smoke, take)
        except TakeError as error:
            self.report({"ERROR"}, str(error))
            return {"CANCELLED"}
        run.enqueue(context, smoke, take)
        return {"FINISHED"}


class SMOKELIFT_OT_cancel(bpy.types.Operator):
    """Stop the run. Finished frames stay, and Resume continues after them"""

    bl_idname = "smokelift.cancel"
    bl_label = "Stop Making Smoke?"
    bl_options = {"INTERNAL"}

    take: StringProperty(options={"SKIP_SAVE", "HIDDEN"})

    def invoke(self, context: bpy.types.Context, event: bpy.types.Event) -> set[str]:
        if self.take:
            return self.execute(context)
        return context.window_manager.invoke_confirm(self, event)

    def execute(self, context: bpy.types.Context) -> set[str]:
        for row in context.window_manager.smokelift.jobs:
            if row.take == self.take or (not self.take and row.outcome == "running"):
                row.cancel = True
                if row.outcome == "waiting":
                    row.outcome, row.sentence = "cancelled", "Cancelled before it began."
        return {"FINISHED"}


class SMOKELIFT_OT_check(_NeedsClip, bpy.types.Operator):
    """Estimate time, memory and disk space of the run, and list its assumptions"""

    bl_idname = "smokelift.check"
    bl_label = "Check Shot"
    bl_options = {"INTERNAL"}

    def execute(self, context: bpy.types.Context) -> set[str]:
        state = context.window_manager.smokelift
        state.check_smoke = active_smoke(context.scene).session_uid
        state.check_ticks = run.CHECK_TICKS
        run.work(context)
        return {"FINISHED"}


class SMOKELIFT_OT_make_box(bpy.types.Operator):
    """Fit the box to the camera's picture at the distance of the 3D cursor; make one if there is none"""

    bl_idname = "smokelift.make_box"
    bl_label = "Frame Box"
    bl_options = {"REGISTER", "UNDO"}

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        if active_smoke(context.scene) is None:
            cls.poll_message_set("Add smoke first")
            return False
        if context.scene.camera is None:
            cls.poll_message_set("The scene has no camera: add one where the clip was filmed from")
            return False
        return True

    def execute(self, context: bpy.types.Context) -> set[str]:
        scene, smoke = context.scene, active_smoke(context.scene)
        low, high = framed_box(scene)
        box = box_of(smoke)
        if box is None:
            box = _new_box()
            scene.collection.objects.link(box)
            smoke.smokelift.box = box
        box.parent = None
        box.rotation_euler = (0.0, 0.0, 0.0)
        box.location = (low + high) / 2
        box.scale = (high - low) / 2
        return {"FINISHED"}


def framed_box(scene: bpy.types.Scene) -> tuple[Vector, Vector]:
    """Lowest and highest corner of an upright box that nearly fills the picture at the 3D cursor's depth."""
    camera = scene.camera
    frame = [camera.matrix_world @ corner for corner in camera.data.view_frame(scene=scene)]
    eye = camera.matrix_world.translation
    ahead = -camera.matrix_world.to_3x3().col[2].normalized()
    near = (frame[0] - eye).dot(ahead)
    depth = (scene.cursor.location - eye).dot(ahead)
    if depth < 2 * near:  # the cursor is behind the camera or close to it
        depth = 10 * near
    if camera.data.type == "ORTHO":
        corners = [corner + ahead * (depth - near) for corner in frame]
    else:
        corners = [eye + (corner - eye) * (depth / near) for corner in frame]
    middle = sum(corners, Vector()) / 4
    width = BOX_SHARE * (corners[0] - corners[3]).length
    height = BOX_SHARE * (corners[0] - corners[1]).length
    half = Vector((width, min(width, height), height)) / 2
    return middle - half, middle + half


def _new_box() -> bpy.types.Object:
    mesh = bpy.data.meshes.new("Smoke Box")
    corners = [(x, y, z) for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)]
    faces = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
    mesh.from_pydata(corners, [], faces)
    box = bpy.data.objects.new("Smoke Box", mesh)
    box.display_type = "WIRE"
    box.hide_render = True
    return box


class SMOKELIFT_OT_match_clip(_NeedsClip, bpy.types.Operator):
    """Set the scene's resolution, frame rate and length to the clip's"""

    bl_idname = "smokelift.match_clip"
    bl_label = "Match Scene to Clip"
    bl_options = {"REGISTER", "UNDO"}

    def execute(self, context: bpy.types.Context) -> set[str]:
        shot_setup.match_clip(active_smoke(context.scene))
        return {"FINISHED"}


class SMOKELIFT_OT_set_up(_NeedsClip, bpy.types.Operator):
    """Make a render from the camera match the clip."""

    bl_idname = "smokelift.set_up"
    bl_description = (
        "Make a Cycles render from the camera match the clip: resolution, frame rate, background, estimated light "
        "and colours. The old world stays in the file"
    )
    bl_label = "Set Up Shot"
    bl_options = {"REGISTER", "UNDO"}

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        if not super().poll(context):
            return False
        if volume.shown_take(active_smoke(context.scene)) is None:
            cls.poll_message_set("Make smoke first")
            return False
        return True

    def execute(self, context: bpy.types.Context) -> set[str]:
        smoke = active_smoke(context.scene)
        take = volume.shown_take(smoke)
        index = take.index()
        if index is None:
            text = rpt_("The files of the smoke in {:s} are missing: make it again.")
            self.report({"ERROR"}, text.format(str(take.directory)))
            return {"CANCELLED"}
        settings = smoke.smokelift
        if settings.set_up_camera and settings.camera_mode == "SCENE" and context.scene.camera is None:
            self.report({"ERROR"}, "The scene has no camera: choose the one that the smoke was made for.")
            return {"CANCELLED"}
        shot_setup.set_up(smoke, take, index)
        volume.show(smoke, take)  # the frame rate may have changed
        return {"FINISHED"}


class SMOKELIFT_OT_open_log(bpy.types.Operator):
    """Show the log of the run in a text editor"""

    bl_idname = "smokelift.open_log"
    bl_label = "Open Log"

    take: StringProperty(options={"SKIP_SAVE", "HIDDEN"})

    def execute(self, context: bpy.types.Context) -> set[str]:
        log = Take(Path(self.take)).log_file
        if not log.is_file():
            self.report({"ERROR"}, rpt_("There is no log at {:s}: the engine never started.").format(str(log)))
            return {"CANCELLED"}
        text = bpy.data.texts.get(LOG_TEXT) or bpy.data.texts.new(LOG_TEXT)
        text.from_string(log.read_text(encoding="utf-8", errors="replace"))
        if not bpy.app.background:
            editor = _editor(context, "TEXT_EDITOR")
            editor.text, editor.top = text, 0
        return {"FINISHED"}


class SMOKELIFT_OT_show_page(_NeedsClip, bpy.types.Operator):
    """Show on a page what was found in the clip: box and light, background, smoke, and what stays undetermined"""

    bl_idname = "smokelift.show_page"
    bl_label = "Inspect Clip"

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        if not super().poll(context):
            return False
        state = context.window_manager.smokelift
        own = state.check_done and state.check_smoke == active_smoke(context.scene).session_uid
        if not (own and run.page_file().is_file()):
            cls.poll_message_set("Check the shot first")
            return False
        return True

    def execute(self, context: bpy.types.Context) -> set[str]:
        page = bpy.data.images.load(str(run.page_file()), check_existing=True)
        page.reload()
        if not bpy.app.background:
            _editor(context, "IMAGE_EDITOR").image = page
        return {"FINISHED"}


def _editor(context: bpy.types.Context, kind: str) -> bpy.types.Space:
    """An editor of a kind, in a window of its own if there is none."""
    areas = [area for window in context.window_manager.windows for area in window.screen.areas]
    found = next((area for area in areas if area.type == kind), None)
    if found is None:
        bpy.ops.wm.window_new()
        found = context.window_manager.windows[-1].screen.areas[0]
        found.type = kind
    return found.spaces.active


class SMOKELIFT_OT_show_smoke(bpy.types.Operator):
    """Select this smoke, and show its settings in the tab"""

    bl_idname = "smokelift.show_smoke"
    bl_label = "Select Smoke"
    bl_options = {"REGISTER", "UNDO"}

    smoke: StringProperty(options={"SKIP_SAVE", "HIDDEN"})

    def execute(self, context: bpy.types.Context) -> set[str]:
        found = next((obj for obj in smokes(context.scene) if obj.name == self.smoke), None)
        if found is None:
            self.report({"ERROR"}, rpt_("The scene has no smoke of the name {:s}.").format(self.smoke))
            return {"CANCELLED"}
        activate(found, context.scene)
        return {"FINISHED"}


class SMOKELIFT_OT_show_take(_NeedsClip, bpy.types.Operator):
    """Show this result in the smoke. Its place and its material stay as they are"""

    bl_idname = "smokelift.show_take"
    bl_label = "Show Result"
    bl_options = {"REGISTER", "UNDO"}

    take: StringProperty(options={"SKIP_SAVE", "HIDDEN"})

    def execute(self, context: bpy.types.Context) -> set[str]:
        take = Take(Path(self.take))
        if not take.frames():
            self.report({"ERROR"}, rpt_("There is no finished frame in {:s}.").format(str(take.directory)))
            return {"CANCELLED"}
        run.present(active_smoke(context.scene), take)
        return {"FINISHED"}


class SMOKELIFT_OT_switch_take(NeedsResult, bpy.types.Operator):
    """Show the result that was shown before; again to come back"""

    bl_idname = "smokelift.switch_take"
    bl_label = "Switch"
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
        run.present(smoke, volume.take_before(smoke))
        return {"FINISHED"}


class SMOKELIFT_OT_show_beside(NeedsResult, bpy.types.Operator):
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
        self.title = Take(Path(self.take)).title()
        return context.window_manager.invoke_props_dialog(self)

    def execute(self, context: bpy.types.Context) -> set[str]:
        try:
            Take(Path(self.take)).give_title(self.title)
        except TakeError as error:
            self.report({"ERROR"}, str(error))
            return {"CANCELLED"}
        run.redraw(context.window_manager)
        return {"FINISHED"}


class SMOKELIFT_OT_remove_take(bpy.types.Operator):
    """Delete the files of this result"""

    bl_idname = "smokelift.remove_take"
    bl_label = "Delete Result?"

    take: StringProperty(options={"SKIP_SAVE", "HIDDEN"})

    def invoke(self, context: bpy.types.Context, event: bpy.types.Event) -> set[str]:
        return context.window_manager.invoke_confirm(self, event)

    def execute(self, context: bpy.types.Context) -> set[str]:
        take = Take(Path(self.take))
        if take.directory.resolve() in _in_use(context):
            self.report({"ERROR"}, "A Volume shows this result, or a run needs it: show another one first.")
            return {"CANCELLED"}
        take.remove()
        return {"FINISHED"}


def _in_use(context: bpy.types.Context) -> set[Path]:
    """Directories of the takes that Volumes of this file show or that runs write; a link may lead to the same one."""
    shown = {take.directory for data in bpy.data.volumes if (take := volume.take_of(data)) is not None}
    rows = context.window_manager.smokelift.jobs
    queued = {Take(Path(row.take)) for row in rows if row.outcome not in run.ENDED}
    read = {source for take in queued if (source := take.source()) is not None}
    return {directory.resolve() for directory in shown | {take.directory for take in queued | read}}


class SMOKELIFT_OT_remove_takes(_NeedsClip, bpy.types.Operator):
    """Delete the files of all results in the output folder except those that a Volume of this file shows"""

    bl_idname = "smokelift.remove_takes"
    bl_label = "Delete Earlier Results?"

    def invoke(self, context: bpy.types.Context, event: bpy.types.Event) -> set[str]:
        return context.window_manager.invoke_confirm(self, event)

    def execute(self, context: bpy.types.Context) -> set[str]:
        kept = _in_use(context)
        for take in takes(run.output_folder(active_smoke(context.scene))):
            if take.directory.resolve() not in kept:
                take.remove()
        return {"FINISHED"}


_CLASSES = (
    SMOKELIFT_OT_add,
    SMOKELIFT_OT_run,
    SMOKELIFT_OT_vary,
    SMOKELIFT_OT_resume,
    SMOKELIFT_OT_cancel,
    SMOKELIFT_OT_check,
    SMOKELIFT_OT_make_box,
    SMOKELIFT_OT_match_clip,
    SMOKELIFT_OT_set_up,
    SMOKELIFT_OT_open_log,
    SMOKELIFT_OT_show_page,
    SMOKELIFT_OT_show_smoke,
    SMOKELIFT_OT_show_take,
    SMOKELIFT_OT_switch_take,
    SMOKELIFT_OT_show_beside,
    SMOKELIFT_OT_name_take,
    SMOKELIFT_OT_remove_take,
    SMOKELIFT_OT_remove_takes,
)

_register, _unregister = bpy.utils.register_classes_factory(_CLASSES)


def register() -> None:
    """Register the operators and what is in Blender's menus."""
    _register()
    bpy.types.VIEW3D_MT_volume_add.append(_draw_add)


def unregister() -> None:
    bpy.types.VIEW3D_MT_volume_add.remove(_draw_add)
    _unregister()
