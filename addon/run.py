"""Running the engine beside Blender: the queue of takes, the look ahead, and what of them is shown."""

import functools
import time
from pathlib import Path

import bpy
import bpy.utils.previews

from . import look, volume
from . import scene as shot
from .job import EngineMissingError, Job, Queue, engine_command
from .take import Take, TakeError, new_take, takes

TICK_SECONDS = 0.1
CHECK_TICKS = 4
"""How long settings have to rest before the engine looks at them again."""

ENDED = ("done", "failed", "cancelled")


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
    """The take that can be gone on with: the one on show, or else the newest, if it was not completed."""
    if scene.smokelift.clip is None:
        return None
    newest = takes(output_folder(scene))[-1:]
    candidates = [take for take in (volume.shown_take(scene), *newest) if take is not None]
    return next((take for take in candidates if take.resumable()), None)


def enqueue(context: bpy.types.Context, scene: bpy.types.Scene, take: Take) -> None:
    """Run a take after those that run and wait; without a window, wait for its end."""
    jobs = context.window_manager.smokelift.jobs
    for place in reversed(range(len(jobs))):
        if jobs[place].outcome in ENDED and jobs[place].scene_uid == scene.session_uid:
            jobs.remove(place)
    row = jobs.add()
    row.take, row.scene_uid = str(take.directory), scene.session_uid
    work(context)


def present(scene: bpy.types.Scene, take: Take) -> bpy.types.Object | None:
    """Show a take's finished frames, with the camera that the engine took for granted if it was left to it."""
    thing, index = volume.show(scene, take), take.index()
    if thing is not None and index is not None:
        look.guessed_camera(scene, index)
    return thing


def busy(manager: bpy.types.WindowManager, take: Take) -> bool:
    """Whether a take runs or waits."""
    return any(row.take == str(take.directory) and row.outcome not in ENDED for row in manager.smokelift.jobs)


def work(context: bpy.types.Context) -> None:
    """See to it that somebody looks after the queue."""
    if bpy.app.background:
        bpy.ops.smokelift.work("EXEC_DEFAULT")
        return
    if not workers(context.window_manager):
        # in the first window, which is there as long as Blender is
        with context.temp_override(window=context.window_manager.windows[0]):
            bpy.ops.smokelift.work("INVOKE_DEFAULT")


def workers(manager: bpy.types.WindowManager) -> list[bpy.types.Operator]:
    """Whoever looks after the queue: one, or nobody."""
    running = [operator for window in manager.windows for operator in window.modal_operators]
    return [operator for operator in running if operator.bl_idname == SMOKELIFT_OT_work.__name__]


def check_soon(context: bpy.types.Context) -> None:
    """Have the engine look at the shot, unless it has looked at one of this file. Drawing code may call it."""
    state, first = context.window_manager.smokelift, context.window_manager.windows[0]
    looked = any(scene.session_uid == state.check_scene for scene in bpy.data.scenes)
    if not looked and context.window == first and not bpy.app.timers.is_registered(_check):
        bpy.app.timers.register(_check)  # while it draws, Blender lets nothing be changed


def _check() -> None:
    with bpy.context.temp_override(window=bpy.context.window_manager.windows[0]):
        if bpy.ops.smokelift.check.poll():
            bpy.ops.smokelift.check()


def _open_log(take: str) -> None:
    with bpy.context.temp_override(window=bpy.context.window_manager.windows[0]):
        bpy.ops.smokelift.open_log(take=take)


class SMOKELIFT_OT_work(bpy.types.Operator):
    """Look ten times a second at what the engine says, until the queue is empty"""

    bl_idname = "smokelift.work"
    bl_label = "Smokelift"
    bl_options = {"INTERNAL"}

    def invoke(self, context: bpy.types.Context, _event: bpy.types.Event) -> set[str]:
        """Begin to look."""
        self._begin()
        self._timer = context.window_manager.event_timer_add(TICK_SECONDS, window=context.window)
        context.window_manager.modal_handler_add(self)
        return {"RUNNING_MODAL"}

    def modal(self, context: bpy.types.Context, event: bpy.types.Event) -> set[str]:
        """Look, and let everything else through; Esc asks whether to stop."""
        if event.type == "ESC" and event.value == "PRESS" and self._queue.current and not _playing(context):
            bpy.ops.smokelift.cancel("INVOKE_DEFAULT")
            return {"RUNNING_MODAL"}
        if event.type == "TIMER" and not self._tick(context):
            self._end(context)
            return {"FINISHED"}
        return {"PASS_THROUGH"}

    def execute(self, context: bpy.types.Context) -> set[str]:
        """Wait for the end, where there is no window."""
        self._begin()
        self._timer = None
        try:
            while self._tick(context):
                time.sleep(TICK_SECONDS)
        finally:
            self._end(context)
        return {"FINISHED"}

    def cancel(self, context: bpy.types.Context) -> None:
        """Blender quits or loads another file: the engine ends, finished frames stay."""
        self._end(context)

    def _begin(self) -> None:
        self._queue = Queue()
        self._jobs: dict[str, Job] = {}
        self._unseen: dict[str, Job] = {}  # those whose newest frames are not in the viewport yet
        self._check: Job | None = None
        self._pictures = bpy.utils.previews.new()
        self._playhead: dict[str, int] = {}

    def _end(self, context: bpy.types.Context) -> None:
        self._queue.kill()
        if self._check is not None:
            self._check.kill()
        for row in context.window_manager.smokelift.jobs:
            row.icon = 0
            if row.outcome not in ENDED:
                row.outcome, row.sentence = "cancelled", f"Stopped; {row.done} finished frames stay."
        bpy.utils.previews.remove(self._pictures)
        if self._timer is not None:
            context.window_manager.event_timer_remove(self._timer)

    def _tick(self, context: bpy.types.Context) -> bool:
        """One look. Returns whether there is more to come."""
        manager = context.window_manager
        rows = {row.take: row for row in manager.smokelift.jobs}
        for name, row in rows.items():
            if row.outcome == "waiting" and name not in self._jobs:
                self._start(name, row)
            if row.cancel and name in self._jobs:
                self._jobs[name].cancel()
        changed = self._queue.poll()
        for name, job in list(self._jobs.items()):
            if job in changed and name in rows:
                self._tell(rows[name], job)
            if job.ended:
                del self._jobs[name]  # a resumed take comes back under the same name
        while self._unseen and not bpy.app.is_job_running("RENDER"):  # which must not lose its data
            name, job = self._unseen.popitem()
            if name in rows:
                self._show(rows[name], job)
        looked = self._look_ahead(manager.smokelift)
        if changed or looked:
            redraw(manager)
        return bool(self._jobs or self._unseen) or self._check is not None or manager.smokelift.check_ticks > 0

    def _start(self, name: str, row: bpy.types.PropertyGroup) -> None:
        take = Take(Path(name))
        try:
            job = Job(engine_command(take.arguments()), take.log_file)
        except (EngineMissingError, TakeError) as error:
            row.outcome, row.sentence = "failed", str(error)
            return
        self._jobs[name] = job
        self._queue.add(job)

    def _tell(self, row: bpy.types.PropertyGroup, job: Job) -> None:
        """Show in the panel how a job stands."""
        grown = job.done != row.done
        row.outcome, row.sentence, row.warnings = job.outcome, job.sentence, "\n".join(job.warnings)
        row.done, row.total = job.done, job.total
        row.seconds_left = -1.0 if job.seconds_left is None else job.seconds_left
        if grown or job.ended:
            self._unseen[row.take] = job

    def _show(self, row: bpy.types.PropertyGroup, job: Job) -> None:
        """Show a job's frames in the viewport, and how it ended."""
        take = Take(Path(row.take))
        scene = find_scene(row)
        made = 0
        if scene is not None:
            before = _things()
            thing = present(scene, take)
            made = _things() - before
            if thing is not None and not bpy.app.background:
                self._follow(scene, thing, row)
        if not bpy.app.background:
            row.icon = self._picture(take)
            if made or job.ended:
                # undoing steps that do not know of new objects would leave Blender with pointers into nowhere
                bpy.ops.ed.undo_push(message="Make Smoke")
            if job.ended:
                self.report({"ERROR" if job.outcome == "failed" else "INFO"}, job.sentence)
            if job.outcome == "failed":
                # not from here: a modal operator that opens a window is never taken off the one it was in
                bpy.app.timers.register(functools.partial(_open_log, row.take))

    def _follow(self, scene: bpy.types.Scene, thing: bpy.types.Object, row: bpy.types.PropertyGroup) -> None:
        """Move the playhead to the newest frame, until somebody else moves it."""
        before = self._playhead.get(row.take)
        if before is not None and scene.frame_current != before:
            return
        newest = thing.data.frame_start + thing.data.frame_duration - 1
        scene.frame_set(newest)
        self._playhead[row.take] = newest

    def _picture(self, take: Take) -> int:
        """Read the take's small picture and return its icon; 0 if there is none."""
        if not take.picture_file.is_file():
            return 0
        image = bpy.data.images.load(str(take.picture_file))
        try:
            name = str(take.directory)
            preview = self._pictures.get(name) or self._pictures.new(name)
            preview.image_size = image.size
            preview.image_pixels_float = image.pixels[:]
        finally:
            bpy.data.images.remove(image)
        return preview.icon_id

    def _look_ahead(self, state: bpy.types.PropertyGroup) -> bool:
        """Ask the engine what the shot will take, once the settings rest. Returns whether anything changed."""
        if state.check_ticks > 0:
            state.check_ticks -= 1
            if state.check_ticks > 0:
                return False
            self._ask(state)
            return True
        if self._check is None:
            return False
        self._check.poll()
        if not self._check.ended:
            return False
        job, self._check = self._check, None
        details = job.details
        state.check_done = job.outcome == "done"
        state.check_error = "" if state.check_done else job.sentence
        state.notes = "\n".join(job.notes)
        if state.check_done:
            state.resolution = details["scene"]["domain"]["resolution"]
            state.seconds = details["seconds"]
            state.memory, state.memory_free = details["memory"] / 2**30, details["memory_free"] / 2**30
            state.disk = details["disk"] / 1e6
        return True

    def _ask(self, state: bpy.types.PropertyGroup) -> None:
        if self._check is not None:
            self._check.kill()
            self._check = None
        scene = next((s for s in bpy.data.scenes if s.session_uid == state.check_scene), None)
        state.check_done, state.check_error = False, ""
        if scene is None:
            return
        folder = Path(bpy.app.tempdir)
        try:
            take = Take(folder / "smokelift_check")
            take.begin(shot.shot_tables(scene, quick=True), shot.options(scene))
            words = ["inspect", str(take.scene_file), "--progress", "json", *shot.options(scene)]
            self._check = Job(engine_command(words), take.log_file)
        except (shot.ShotError, TakeError, EngineMissingError) as error:
            state.check_error = str(error)
            return
        self._check.start()


def find_scene(row: bpy.types.PropertyGroup) -> bpy.types.Scene | None:
    """The scene of a job; it may have been renamed, or be gone."""
    return next((scene for scene in bpy.data.scenes if scene.session_uid == row.scene_uid), None)


def _things() -> int:
    return sum(map(len, (bpy.data.objects, bpy.data.volumes, bpy.data.cameras, bpy.data.materials)))


def redraw(manager: bpy.types.WindowManager) -> None:
    """Draw again whatever shows the panel."""
    for window in manager.windows:
        for area in window.screen.areas:
            if area.type in ("VIEW_3D", "CLIP_EDITOR"):
                area.tag_redraw()


def _playing(context: bpy.types.Context) -> bool:
    return context.screen is not None and context.screen.is_animation_playing


def register() -> None:
    """Make the worker known."""
    bpy.utils.register_class(SMOKELIFT_OT_work)


def unregister() -> None:
    """Take it back, and end what it runs."""
    if bpy.app.timers.is_registered(_check):
        bpy.app.timers.unregister(_check)
    for worker in workers(bpy.context.window_manager):
        worker.cancel(bpy.context)
    bpy.utils.unregister_class(SMOKELIFT_OT_work)
