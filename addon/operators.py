"""What the sidebar's buttons do."""

import time
from pathlib import Path

import bpy
from bpy.props import StringProperty
from mathutils import Vector

from . import scene as shot
from . import volume
from .job import EngineMissingError, Job, Queue, engine_command
from .take import Take, TakeError, new_take, takes

TICK_SECONDS = 0.1


def output_folder(scene: bpy.types.Scene) -> Path:
    """The folder for the results of a scene: the chosen one, or one beside the .blend, or beside the clip."""
    settings = scene.smokelift
    if settings.output:
        return Path(bpy.path.abspath(settings.output))
    name = bpy.path.clean_name(Path(settings.clip.filepath).stem)
    if bpy.data.filepath:
        return Path(bpy.data.filepath).parent / "smokelift" / name
    return shot.clip_path(settings.clip).parent / f"{name}_smokelift"


def begin(scene: bpy.types.Scene) -> Take:
    """Write a new take of a scene, ready to run.

    Raises
    ------
    ShotError, TakeError
        If something is missing, or nothing can be written.
    """
    tables = shot.shot_tables(scene)
    take = new_take(output_folder(scene))
    take.begin(tables, shot.options(scene))
    return take


def unfinished(scene: bpy.types.Scene) -> Take | None:
    """The take that can be gone on with: the one on show, else the newest, if it was not completed."""
    if scene.smokelift.clip is None:
        return None
    candidates = [volume.shown_take(scene), *reversed(takes(output_folder(scene)))][:2]
    return next((take for take in candidates if take is not None and take.resumable()), None)


class SMOKELIFT_OT_run(bpy.types.Operator):
    """Turn the clip into a volume of smoke. Blender stays usable meanwhile"""

    bl_idname = "smokelift.run"
    bl_label = "Make Smoke"

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        """Needs a clip."""
        if context.scene.smokelift.clip is None:
            cls.poll_message_set("Choose a clip first")
            return False
        return True

    def execute(self, context: bpy.types.Context) -> set[str]:
        """Write the shot's files and put it into the queue."""
        try:
            take = begin(context.scene)
        except (shot.ShotError, TakeError) as error:
            self.report({"ERROR"}, str(error))
            return {"CANCELLED"}
        return _enqueue(context, take)


class SMOKELIFT_OT_resume(bpy.types.Operator):
    """Go on with the run that was cancelled or interrupted, from its last finished frame"""

    bl_idname = "smokelift.resume"
    bl_label = "Resume"

    def execute(self, context: bpy.types.Context) -> set[str]:
        """Put the unfinished take into the queue again."""
        take = unfinished(context.scene)
        if take is None:
            self.report({"ERROR"}, "There is nothing to go on with: press Make Smoke.")
            return {"CANCELLED"}
        return _enqueue(context, take)


def _enqueue(context: bpy.types.Context, take: Take) -> set[str]:
    jobs = context.window_manager.smokelift.jobs
    for place in reversed(range(len(jobs))):
        if (
            jobs[place].outcome in ("done", "failed", "cancelled")
            and jobs[place].scene_uid == context.scene.session_uid
        ):
            jobs.remove(place)
    row = jobs.add()
    row.take, row.scene_uid = str(take.directory), context.scene.session_uid
    if any(job.outcome == "running" for job in jobs):
        return {"FINISHED"}
    return bpy.ops.smokelift.work("EXEC_DEFAULT" if bpy.app.background else "INVOKE_DEFAULT")


class SMOKELIFT_OT_work(bpy.types.Operator):
    """Run the queue: looks ten times a second at what the engine says"""

    bl_idname = "smokelift.work"
    bl_label = "Smokelift"
    bl_options = {"INTERNAL"}

    def invoke(self, context: bpy.types.Context, _event: bpy.types.Event) -> set[str]:
        """Begin to look."""
        self._queue, self._running = Queue(), {}
        self._timer = context.window_manager.event_timer_add(TICK_SECONDS, window=context.window)
        context.window_manager.modal_handler_add(self)
        return {"RUNNING_MODAL"}

    def modal(self, context: bpy.types.Context, event: bpy.types.Event) -> set[str]:
        """Look, and let everything else through."""
        if event.type == "ESC" and event.value == "PRESS" and not context.screen.is_animation_playing:
            bpy.ops.smokelift.cancel("INVOKE_DEFAULT")
            return {"RUNNING_MODAL"}
        if event.type == "TIMER" and not self._tick(context):
            context.window_manager.event_timer_remove(self._timer)
            return {"FINISHED"}
        return {"PASS_THROUGH"}

    def execute(self, context: bpy.types.Context) -> set[str]:
        """Wait for the end, where there is no window."""
        self._queue, self._running = Queue(), {}
        try:
            while self._tick(context):
                time.sleep(TICK_SECONDS)
        finally:
            self._queue.kill()
        return {"FINISHED"}

    def cancel(self, context: bpy.types.Context) -> None:
        """Blender quits or loads another file: the engine ends, finished frames stay."""
        self._queue.kill()
        context.window_manager.event_timer_remove(self._timer)

    def _tick(self, context: bpy.types.Context) -> bool:
        """One look. Returns whether there is more to come."""
        rows = {row.take: row for row in context.window_manager.smokelift.jobs}
        for name, row in rows.items():
            if row.outcome == "waiting" and name not in self._running:
                self._add(name, row)
            if row.cancel and name in self._running:
                self._running[name].cancel()
        changed = self._queue.poll()
        for name, job in self._running.items():
            if job in changed and name in rows:
                self._tell(rows[name], job)
        if changed:
            redraw(context.window_manager)
        return not self._queue.ended

    def _add(self, name: str, row: bpy.types.PropertyGroup) -> None:
        take = Take(Path(name))
        try:
            job = Job(engine_command(take.arguments()), take.log_file)
        except (EngineMissingError, TakeError) as error:
            row.outcome, row.sentence = "failed", str(error)
            return
        self._running[name] = job
        self._queue.add(job)

    def _tell(self, row: bpy.types.PropertyGroup, job: Job) -> None:
        """Show how a job stands: in the panel, and its frames in the viewport."""
        grown = job.done != row.done
        row.outcome, row.sentence = job.outcome, job.sentence
        row.done, row.total = job.done, job.total
        row.seconds_left = -1.0 if job.seconds_left is None else job.seconds_left
        scene = next((s for s in bpy.data.scenes if s.session_uid == row.scene_uid), None)
        if scene is not None and (grown or job.ended):
            volume.show(scene, Take(Path(row.take)))


def redraw(manager: bpy.types.WindowManager) -> None:
    """Draw again whatever shows the panel."""
    for window in manager.windows:
        for area in window.screen.areas:
            if area.type in ("VIEW_3D", "CLIP_EDITOR"):
                area.tag_redraw()


class SMOKELIFT_OT_cancel(bpy.types.Operator):
    """Stop. Finished frames stay, and Resume goes on from them"""

    bl_idname = "smokelift.cancel"
    bl_label = "Stop Making Smoke?"
    bl_options = {"INTERNAL"}

    take: StringProperty(options={"SKIP_SAVE", "HIDDEN"})

    def invoke(self, context: bpy.types.Context, event: bpy.types.Event) -> set[str]:
        """Ask first."""
        return context.window_manager.invoke_confirm(self, event)

    def execute(self, context: bpy.types.Context) -> set[str]:
        """Stop one job, or the one that runs."""
        for row in context.window_manager.smokelift.jobs:
            if row.take == self.take or (not self.take and row.outcome == "running"):
                row.cancel = True
        return {"FINISHED"}


class SMOKELIFT_OT_make_box(bpy.types.Operator):
    """Make the box that holds the smoke, if there is none, and fit it to the camera's picture"""

    bl_idname = "smokelift.make_box"
    bl_label = "Make Box"
    bl_options = {"REGISTER", "UNDO"}

    def execute(self, context: bpy.types.Context) -> set[str]:
        """Make or move the box."""
        scene = context.scene
        if scene.camera is None:
            self.report({"ERROR"}, "The scene has no camera: add one where the clip was filmed from.")
            return {"CANCELLED"}
        low, high = framed_box(scene)
        box = scene.smokelift.box
        if box is None or box.name not in scene.objects:
            box = _new_box()
            scene.collection.objects.link(box)
            scene.smokelift.box = box
        box.rotation_euler = (0.0, 0.0, 0.0)
        box.location = (low + high) / 2
        box.scale = (high - low) / 2
        return {"FINISHED"}


def framed_box(scene: bpy.types.Scene) -> tuple[Vector, Vector]:
    """An upright box that fills the camera's picture, at the depth of the 3D cursor: its lowest and highest corner."""
    camera = scene.camera
    frame = [camera.matrix_world @ corner for corner in camera.data.view_frame(scene=scene)]
    eye = camera.matrix_world.translation
    ahead = -camera.matrix_world.to_3x3().col[2].normalized()
    depth = (scene.cursor.location - eye).dot(ahead)
    near = (frame[0] - eye).dot(ahead)
    if depth < 2 * near:
        depth = 10 * near
    if camera.data.type == "ORTHO":
        corners = [corner + ahead * (depth - near) for corner in frame]
    else:
        corners = [eye + (corner - eye) * (depth / near) for corner in frame]
    middle = sum(corners, Vector()) / 4
    width = 0.9 * (corners[0] - corners[3]).length
    height = 0.9 * (corners[0] - corners[1]).length
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


class SMOKELIFT_OT_open_log(bpy.types.Operator):
    """Show what the engine said, in a text editor"""

    bl_idname = "smokelift.open_log"
    bl_label = "Open Log"

    take: StringProperty(options={"SKIP_SAVE", "HIDDEN"})

    def execute(self, context: bpy.types.Context) -> set[str]:
        """Load the log as a text."""
        log = Take(Path(self.take)).log_file
        if not log.is_file():
            self.report({"ERROR"}, f"{log} is not there: the engine never started.")
            return {"CANCELLED"}
        name = "Smokelift Log"
        text = bpy.data.texts.get(name) or bpy.data.texts.new(name)
        text.from_string(log.read_text(encoding="utf-8", errors="replace"))
        return {"FINISHED"}


_CLASSES = (
    SMOKELIFT_OT_run,
    SMOKELIFT_OT_resume,
    SMOKELIFT_OT_work,
    SMOKELIFT_OT_cancel,
    SMOKELIFT_OT_make_box,
    SMOKELIFT_OT_open_log,
)


def register() -> None:
    """Make the operators known."""
    for cls in _CLASSES:
        bpy.utils.register_class(cls)


def unregister() -> None:
    """Take them back."""
    for cls in reversed(_CLASSES):
        bpy.utils.unregister_class(cls)
