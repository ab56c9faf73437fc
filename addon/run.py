"""The engine beside Blender: the queue of takes, the check before a run, and the progress on show."""

import functools
import time
from pathlib import Path

import bpy
import bpy.utils.previews

from . import directing, preferences, scene_file, shot_setup, volume
from .job import ENDED, EngineMissingError, Job, Queue, engine_command
from .paths import absolute
from .smoke import active_smoke, part_duplicate, smokes
from .take import Take, TakeError, new_take, takes

TICK_SECONDS = 0.1
CHECK_TICKS = 4
"""Ticks without a change of settings before the engine checks the shot."""


def output_folder(smoke: bpy.types.Object) -> Path:
    """The folder of a smoke's takes: the chosen one, else in that of the preferences, beside the .blend or the clip."""
    settings = smoke.smokelift
    if settings.output:
        return absolute(settings.output)
    common = preferences.output_folder()
    if common is not None:
        return common / settings.folder
    if bpy.data.filepath:
        return Path(bpy.data.filepath).parent / "smokelift" / settings.folder
    return scene_file.clip_path(settings.clip).parent / f"{settings.folder}_smokelift"


def write_take(smoke: bpy.types.Object) -> Take:
    """Write the files of a new take.

    Raises
    ------
    ShotError, TakeError
        If the shot is unusable, or the folder cannot be written to.
    """
    tables = scene_file.shot_tables(smoke)
    part_duplicate(smoke)
    take = new_take(output_folder(smoke))
    take.write(tables, scene_file.options(smoke))
    return take


def write_directed(smoke: bpy.types.Object) -> Take:
    """Write the files of a new take that is made of the one on show.

    Raises
    ------
    ShotError, TakeError
        If a setting or an object cannot be used, or the folder cannot be written to.
    """
    source = volume.shown_take(smoke)
    if source is None:
        raise scene_file.ShotError("Make smoke first: there is none yet to direct.")
    if busy(bpy.context.window_manager, source):
        raise scene_file.ShotError("The result on show is still being made: wait for its end, or cancel it.")
    direction, options, meshes = directing.request(smoke)
    part_duplicate(smoke)
    take = new_take(output_folder(smoke))
    take.write_directed(direction, source, options, meshes)
    return take


def find_again(smoke: bpy.types.Object, take: Take) -> None:
    """Tell a take that is resumed where clip and plate are today, if the project was moved.

    Raises
    ------
    TakeError
        If its files are damaged.
    """
    settings = smoke.smokelift
    if take.direction() is None:
        files = {"clip": ("path", scene_file.clip_path(settings.clip))}
        if settings.plate:
            files["background"] = ("image", absolute(settings.plate))
        take.find_again(files)


def unfinished(smoke: bpy.types.Object) -> Take | None:
    """The take that can be resumed: the one on show, else the newest."""
    if smoke.smokelift.clip is None:
        return None
    newest = takes(output_folder(smoke))[-1:]
    candidates = [take for take in (volume.shown_take(smoke), *newest) if take is not None]
    return next((take for take in candidates if take.resumable()), None)


def page_file() -> Path:
    """Where the engine shows in pictures what it found of the shot that was checked last."""
    return Path(bpy.app.tempdir) / "smokelift_inspect.png"


def enqueue(context: bpy.types.Context, smoke: bpy.types.Object, take: Take) -> None:
    """Append a take to the queue; without a window, wait for its end."""
    jobs = context.window_manager.smokelift.jobs
    for place in reversed(range(len(jobs))):
        if jobs[place].outcome in ENDED and jobs[place].smoke_uid == smoke.session_uid:
            jobs.remove(place)
    row = jobs.add()
    row.take, row.smoke_uid = str(take.directory), smoke.session_uid
    work(context)


def present(smoke: bpy.types.Object, take: Take) -> None:
    """Show a take's finished frames, and the camera that the engine assumed if it did."""
    index = take.index()
    if volume.show(smoke, take) and index is not None:
        shot_setup.assumed_camera(smoke, index)


def busy(manager: bpy.types.WindowManager, take: Take) -> bool:
    """Whether a take runs or waits."""
    return any(row.take == str(take.directory) and row.outcome not in ENDED for row in manager.smokelift.jobs)


def work(context: bpy.types.Context) -> None:
    """Start the worker unless it runs."""
    if bpy.app.background:
        bpy.ops.smokelift.work("EXEC_DEFAULT")
        return
    manager = context.window_manager
    if _leaving(manager):
        if not bpy.app.timers.is_registered(_work_later):
            bpy.app.timers.register(_work_later, first_interval=TICK_SECONDS)
    elif not workers(manager):
        # the first window exists as long as Blender does
        with context.temp_override(window=manager.windows[0]):
            bpy.ops.smokelift.work("INVOKE_DEFAULT")


def _work_later() -> None:
    work(bpy.context)


def workers(manager: bpy.types.WindowManager) -> list[bpy.types.Operator]:
    """The running worker, if any."""
    running = [operator for window in manager.windows for operator in window.modal_operators]
    return [operator for operator in running if _name(operator) == SMOKELIFT_OT_work.__name__]


def _leaving(manager: bpy.types.WindowManager) -> bool:
    """Whether a window still lists an operator that was unregistered while it ran.

    It drops it with its next event. Blender crashes if another modal operator starts before that.
    """
    return any(_name(operator) is None for window in manager.windows for operator in window.modal_operators)


def _name(operator: bpy.types.Operator) -> str | None:
    """The operator's name; None of one that was unregistered."""
    try:
        return str(operator.bl_idname)
    except ValueError:
        return None


def _drop_unregistered(timer: bpy.types.Timer) -> float | None:
    """End a timer that gives the first window events, once no unregistered operator is left for them to drop."""
    manager = bpy.context.window_manager
    if _leaving(manager):
        return TICK_SECONDS
    manager.event_timer_remove(timer)
    return None


def check_soon(context: bpy.types.Context) -> None:
    """Check the active smoke unless it was checked. Drawing code may call this."""
    state, first = context.window_manager.smokelift, context.window_manager.windows[0]
    smoke = active_smoke(context.scene)
    known = smoke is None or smoke.session_uid == state.check_smoke
    if not known and context.window == first and not bpy.app.timers.is_registered(_check):
        bpy.app.timers.register(_check)  # drawing code may not change data


def _check() -> None:
    with bpy.context.temp_override(window=bpy.context.window_manager.windows[0]):
        if bpy.ops.smokelift.check.poll():
            bpy.ops.smokelift.check()


def _open_log(take: str) -> None:
    with bpy.context.temp_override(window=bpy.context.window_manager.windows[0]):
        bpy.ops.smokelift.open_log(take=take)


class SMOKELIFT_OT_work(bpy.types.Operator):
    """Poll the engine ten times a second until the queue is empty"""

    bl_idname = "smokelift.work"
    bl_label = "Smokelift"
    bl_options = {"INTERNAL"}

    def invoke(self, context: bpy.types.Context, _event: bpy.types.Event) -> set[str]:
        """Start the timer."""
        self._begin()
        self._timer = context.window_manager.event_timer_add(TICK_SECONDS, window=context.window)
        context.window_manager.modal_handler_add(self)
        return {"RUNNING_MODAL"}

    def modal(self, context: bpy.types.Context, event: bpy.types.Event) -> set[str]:
        """Poll on the timer, pass other events on; Esc asks whether to stop."""
        if event.type == "ESC" and event.value == "PRESS" and self._queue.current and not _playing(context):
            bpy.ops.smokelift.cancel("INVOKE_DEFAULT")
            return {"RUNNING_MODAL"}
        if event.type == "TIMER" and not self._tick(context):
            self._end(context)
            return {"FINISHED"}
        return {"PASS_THROUGH"}

    def execute(self, context: bpy.types.Context) -> set[str]:
        """Without a window: poll to the end."""
        self._begin()
        self._timer = None
        try:
            while self._tick(context):
                time.sleep(TICK_SECONDS)
        finally:
            self._end(context)
        return {"FINISHED"}

    def cancel(self, context: bpy.types.Context) -> None:
        """Blender quits or loads another file: end the engine; finished frames stay."""
        self._end(context)

    def _begin(self) -> None:
        self._queue = Queue()
        self._jobs: dict[str, Job] = {}
        self._before: dict[str, Take | None] = {}  # what was on show when a job's first frame came
        self._not_shown: dict[str, Job] = {}  # jobs whose newest frames the viewport does not show yet
        self._check: Job | None = None
        self._thumbnails = bpy.utils.previews.new()

    def _end(self, context: bpy.types.Context) -> None:
        self._queue.kill()
        if self._check is not None:
            self._check.kill()
        for row in context.window_manager.smokelift.jobs:
            row.icon = 0
            if row.outcome not in ENDED:
                row.outcome, row.sentence = "cancelled", f"Stopped; finished frames stay: {row.done}."
        bpy.utils.previews.remove(self._thumbnails)
        if self._timer is not None:
            context.window_manager.event_timer_remove(self._timer)

    def _tick(self, context: bpy.types.Context) -> bool:
        """Poll once; returns whether work remains."""
        manager = context.window_manager
        rows = {row.take: row for row in manager.smokelift.jobs}
        for name, row in rows.items():
            if row.outcome == "waiting" and name not in self._jobs:
                self._start(name, row)
            if name in self._jobs and find_smoke(row.smoke_uid) is None:
                row.cancel = True  # it has nowhere to go; undo brings the smoke back, and Resume goes on
            if row.cancel and name in self._jobs:
                self._jobs[name].cancel()
        changed = self._queue.poll()
        for name, job in list(self._jobs.items()):
            if job in changed and name in rows:
                self._update_row(rows[name], job)
            if job.ended:
                del self._jobs[name]  # a resumed take has the same name
        while self._not_shown and not bpy.app.is_job_running("RENDER"):  # its data must stay
            name, job = self._not_shown.popitem()
            if name in rows:
                self._show(rows[name], job)
        checked = self._poll_check(manager.smokelift)
        if changed or checked:
            redraw(manager)
        return bool(self._jobs or self._not_shown) or self._check is not None or manager.smokelift.check_ticks > 0

    def _start(self, name: str, row: bpy.types.PropertyGroup) -> None:
        take = Take(Path(name))
        try:
            job = Job(engine_command(take.arguments() + preferences.thread_options()), take.log_file)
        except (EngineMissingError, TakeError) as error:
            row.outcome, row.sentence = "failed", str(error)
            return
        self._jobs[name] = job
        self._queue.add(job)

    def _update_row(self, row: bpy.types.PropertyGroup, job: Job) -> None:
        """Show a job's progress in the panel."""
        new_frames = job.done != row.done
        row.outcome, row.sentence, row.warnings = job.outcome, job.sentence, "\n".join(job.warnings)
        row.done, row.total = job.done, job.total
        row.seconds_left = -1.0 if job.seconds_left is None else job.seconds_left
        if new_frames or job.ended:
            self._not_shown[row.take] = job

    def _show(self, row: bpy.types.PropertyGroup, job: Job) -> None:
        """Show a job's frames in the viewport, and its end."""
        take = Take(Path(row.take))
        smoke = find_smoke(row.smoke_uid)
        created = 0
        if smoke is not None:
            count = _datablocks()
            self._show_or_return(smoke, take, job)
            created = _datablocks() - count
        if not bpy.app.background:
            row.icon = self._thumbnail(take)
            if smoke is not None and (created or job.ended):  # where it was deleted, one undo brings it back
                # an undo to a step before new objects leaves Blender with dangling pointers
                bpy.ops.ed.undo_push(message="Make Smoke")
            if job.ended:
                self.report({"ERROR" if job.outcome == "failed" else "INFO"}, job.sentence)
            if job.outcome == "failed":
                # later: Blender never removes a modal operator that opens a window from its first one
                bpy.app.timers.register(functools.partial(_open_log, row.take))

    def _show_or_return(self, smoke: bpy.types.Object, take: Take, job: Job) -> None:
        """Show a take while it is made; after a failure, or if it is stopped, what was on show before."""
        shown = volume.shown_take(smoke)
        before = self._before.setdefault(str(take.directory), shown)
        if shown not in (before, take):
            return  # the artist has chosen another
        stopped = job.outcome in ("failed", "cancelled")
        present(smoke, before if stopped and before is not None else take)

    def _thumbnail(self, take: Take) -> int:
        """The icon of the take's thumbnail; 0 if there is none."""
        if not take.thumbnail_file.is_file():
            return 0
        image = bpy.data.images.load(str(take.thumbnail_file))
        try:
            name = str(take.directory)
            preview = self._thumbnails.get(name) or self._thumbnails.new(name)
            preview.image_size = image.size
            preview.image_pixels_float = image.pixels[:]
        finally:
            bpy.data.images.remove(image)
        return preview.icon_id

    def _poll_check(self, state: bpy.types.PropertyGroup) -> bool:
        """Check the shot once its settings rest; returns whether anything changed."""
        if state.check_ticks > 0:
            state.check_ticks -= 1
            if state.check_ticks > 0:
                return False
            self._start_check(state)
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

    def _start_check(self, state: bpy.types.PropertyGroup) -> None:
        if self._check is not None:
            self._check.kill()
            self._check = None
        smoke = find_smoke(state.check_smoke)
        state.check_done, state.check_error = False, ""
        if smoke is None:
            return
        folder = Path(bpy.app.tempdir)
        try:
            take = Take(folder / "smokelift_check")
            take.write(scene_file.shot_tables(smoke, quick=True), scene_file.options(smoke))
            words = ["inspect", str(take.scene_file), "--page", str(page_file()), "--progress", "json"]
            words += scene_file.options(smoke) + preferences.thread_options()
            self._check = Job(engine_command(words), take.log_file)
        except (scene_file.ShotError, TakeError, EngineMissingError) as error:
            state.check_error = str(error)
            return
        self._check.start()


def find_smoke(uid: int) -> bpy.types.Object | None:
    """A smoke by its number of this session, also after a new name; None if it was deleted."""
    return next((obj for scene in bpy.data.scenes for obj in smokes(scene) if obj.session_uid == uid), None)


def _datablocks() -> int:
    return sum(map(len, (bpy.data.objects, bpy.data.volumes, bpy.data.cameras, bpy.data.materials)))


def redraw(manager: bpy.types.WindowManager) -> None:
    """Redraw every area that shows the panel."""
    for window in manager.windows:
        for area in window.screen.areas:
            if area.type in ("VIEW_3D", "CLIP_EDITOR"):
                area.tag_redraw()


def _playing(context: bpy.types.Context) -> bool:
    return context.screen is not None and context.screen.is_animation_playing


def register() -> None:
    bpy.utils.register_class(SMOKELIFT_OT_work)


def unregister() -> None:
    """Unregister the worker and end its jobs."""
    for later in (_check, _work_later):
        if bpy.app.timers.is_registered(later):
            bpy.app.timers.unregister(later)
    manager = bpy.context.window_manager
    running = workers(manager)
    for worker in running:
        worker.cancel(bpy.context)
    bpy.utils.unregister_class(SMOKELIFT_OT_work)
    if running:
        timer = manager.event_timer_add(TICK_SECONDS, window=manager.windows[0])
        bpy.app.timers.register(functools.partial(_drop_unregistered, timer), first_interval=TICK_SECONDS)
