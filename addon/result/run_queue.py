"""The engine beside Blender: an operator that works through the queue of takes and shows their progress."""

import functools
import time
from pathlib import Path

import bpy
import bpy.utils.previews

from ..core.job import ENDED, EngineMissingError, Job, engine_command
from ..core.sentences import stopped
from ..core.take import Take, TakeError
from ..scene import volume
from ..scene.blender import redraw, thread_options
from ..scene.smoke import active_smoke, find_smoke, scene_of
from . import shot_check
from .side_job import TICK_SECONDS, call_later, cancel_call
from .smoke_takes import show_while_made


def enqueue(context: bpy.types.Context, smoke: bpy.types.Object, take: Take) -> None:
    """Append a take to the queue; without a window, wait for its end."""
    jobs = context.window_manager.smokelift.jobs
    for place in reversed(range(len(jobs))):
        if jobs[place].outcome in ENDED and jobs[place].smoke_uid == smoke.session_uid:
            jobs.remove(place)
    row = jobs.add()
    shot_check.make_way()
    row.take, row.smoke_uid, row.done = str(take.directory), smoke.session_uid, take.read().frames
    work(context)


def work(context: bpy.types.Context) -> None:
    """Start the worker unless it runs."""
    if bpy.app.background:
        bpy.ops.smokelift.work("EXEC_DEFAULT")
        return
    manager = context.window_manager
    if _has_unregistered(manager):
        call_later(_work_later, TICK_SECONDS)
    elif not workers(manager):
        # the first window exists as long as Blender does
        with context.temp_override(window=manager.windows[0]):
            bpy.ops.smokelift.work("INVOKE_DEFAULT")


def _work_later() -> None:
    work(bpy.context)


def workers(manager: bpy.types.WindowManager) -> list[bpy.types.Operator]:
    """The running worker, if any."""
    running = [operator for window in manager.windows for operator in window.modal_operators]
    return [operator for operator in running if _operator_name(operator) == SMOKELIFT_OT_work.__name__]


def _has_unregistered(manager: bpy.types.WindowManager) -> bool:
    """Whether a window still lists an operator that was unregistered while it ran.

    It drops it with its next event. Blender crashes if another modal operator starts before that.
    """
    return any(_operator_name(operator) is None for window in manager.windows for operator in window.modal_operators)


def _operator_name(operator: bpy.types.Operator) -> str | None:
    """The operator's name; None of one that was unregistered."""
    try:
        return str(operator.bl_idname)
    except ValueError:
        return None


def _wait_for_unregistered(timer: bpy.types.Timer) -> float | None:
    """Keep a timer that gives the first window events until no window lists an unregistered operator any more."""
    manager = bpy.context.window_manager
    if _has_unregistered(manager):
        return TICK_SECONDS
    manager.event_timer_remove(timer)
    return None


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
        if event.type == "ESC" and event.value == "PRESS" and self._job and not _playing(context):
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
        self._take, self._job = "", None  # the run, and its process
        self._before: dict[str, Take | None] = {}  # what was on show when a run's first frame came
        self._seen: set[str] = set()  # takes to whose smoke the playhead went; the artist may leave it
        self._not_shown: dict[str, Job] = {}  # runs whose newest frames the viewport does not show yet
        self._thumbnails = bpy.utils.previews.new()

    def _end(self, context: bpy.types.Context) -> None:
        if self._job is not None:
            self._job.kill()
        for row in context.window_manager.smokelift.jobs:
            row.icon = 0
            if row.outcome == "waiting" and find_smoke(row.smoke_uid) is not None:  # a deleted one may come back
                Take(Path(row.take)).remove_unless_begun()
            if row.outcome not in ENDED:
                row.outcome, row.sentence = "cancelled", stopped(row.done)
        bpy.utils.previews.remove(self._thumbnails)
        if self._timer is not None:
            context.window_manager.event_timer_remove(self._timer)

    def _tick(self, context: bpy.types.Context) -> bool:
        """Poll once; returns whether work remains."""
        manager = context.window_manager
        rows = {row.take: row for row in manager.smokelift.jobs}
        waiting = next((row for row in rows.values() if row.outcome == "waiting"), None)
        changed = False
        if self._job is not None:
            changed = self._poll(rows.get(self._take))
        elif waiting is not None:
            self._start(waiting)
            changed = True
        while self._not_shown and not bpy.app.is_job_running("RENDER"):  # its data must stay
            name, job = self._not_shown.popitem()
            if name in rows:
                self._show(rows[name], job)
        if changed:
            redraw(manager)
        return bool(self._job or self._not_shown or waiting)

    def _start(self, row: bpy.types.PropertyGroup) -> None:
        """Start the engine on a run that waits."""
        take, smoke = Take(Path(row.take)), find_smoke(row.smoke_uid)
        if smoke is None:  # undo brings it back, and Resume goes on
            row.outcome, row.sentence = "cancelled", "Cancelled before it began."
            return
        try:
            words = engine_command(take.arguments() + thread_options())
        except (EngineMissingError, TakeError) as error:
            row.outcome, row.sentence = "failed", str(error)
            return
        job = Job(words, take.log_file, volume.frames_before_take(smoke, take), take.read().frames)
        job.start()
        self._take, self._job = row.take, None if job.ended else job
        self._update_row(row, job)

    def _poll(self, row: bpy.types.PropertyGroup | None) -> bool:
        """Read what the engine says; returns whether anything changed."""
        job = self._job
        if row is not None and find_smoke(row.smoke_uid) is None:
            row.cancel = True  # it has nowhere to go; undo brings the smoke back, and Resume goes on
        if row is None or row.cancel:
            job.cancel()
        changed = job.poll()
        if job.ended:
            self._job = None
        if changed and row is not None:
            self._update_row(row, job)
        return changed

    def _update_row(self, row: bpy.types.PropertyGroup, job: Job) -> None:
        """Show a job's progress in the panel."""
        new_frames = job.done != row.done
        row.outcome, row.sentence = job.outcome, job.sentence
        shot_check.store_doubts(row, job.doubts)
        row.done, row.total = job.done, job.total
        row.seconds_left = -1.0 if job.seconds_left is None else job.seconds_left
        if new_frames or job.ended:
            self._not_shown[row.take] = job

    def _show(self, row: bpy.types.PropertyGroup, job: Job) -> None:
        """Show a job's frames in the viewport, and its end."""
        take = Take(Path(row.take))
        smoke = find_smoke(row.smoke_uid)
        created, said = 0, ""
        if smoke is not None:
            count = _datablocks()
            before = self._before.setdefault(row.take, volume.shown_take(smoke))
            if not row.left:
                said = show_while_made(smoke, take, before, job.outcome)
            created = _datablocks() - count
            in_tab = smoke == active_smoke(scene_of(smoke))  # of another the artist sees nothing now
            first = before is None and in_tab and row.take not in self._seen
            if first and (_playing(bpy.context) or volume.go_to_smoke(smoke)):
                self._seen.add(row.take)
        if not bpy.app.background:
            row.icon = self._thumbnail(take)
            if smoke is not None and (created or job.ended):  # where it was deleted, one undo brings it back
                # an undo to a step before new objects leaves Blender with dangling pointers
                bpy.ops.ed.undo_push(message="Make Smoke")
            if said:
                self.report({"INFO"}, said)
            if job.ended:
                self.report({"ERROR" if job.outcome == "failed" else "INFO"}, job.sentence)

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


def _datablocks() -> int:
    return sum(map(len, (bpy.data.objects, bpy.data.volumes, bpy.data.cameras, bpy.data.materials)))


def _playing(context: bpy.types.Context) -> bool:
    return context.screen is not None and context.screen.is_animation_playing


def unregister() -> None:
    """End the worker and its jobs."""
    cancel_call(_work_later)
    manager = bpy.context.window_manager
    running = workers(manager)
    for worker in running:
        worker.cancel(bpy.context)
    if running:
        timer = manager.event_timer_add(TICK_SECONDS, window=manager.windows[0])
        bpy.app.timers.register(functools.partial(_wait_for_unregistered, timer), first_interval=TICK_SECONDS)
