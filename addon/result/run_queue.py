"""The engine beside Blender: an operator that works through the queue of takes and shows their progress."""

import functools
import time

import bpy
import bpy.utils.previews
from bpy.app.handlers import persistent

from ..core.job import EngineMissingError, Job, engine_command
from ..core.take import Take, TakeError
from ..scene import volume
from ..scene.blender import call_later, redraw, thread_options
from ..scene.smoke import active_smoke, find_smoke, scene_of
from . import shot_check
from .side_job import TICK_SECONDS
from .smoke_takes import Run, runs, show_while_made


def enqueue(context: bpy.types.Context, smoke: bpy.types.Object, take: Take, settings: str = "") -> None:
    """Append a take to the queue; without a window, wait for its end.

    EngineMissingError, TakeError if it cannot be made.

    Parameters
    ----------
    context, smoke, take
        What is made.
    settings
        Those that it is made with, as `shot_check.settings_text` has them; empty if they are not the smoke's own.
    """
    try:
        words = engine_command(take.arguments() + thread_options())
    except (EngineMissingError, TakeError):
        take.remove_unless_begun()
        raise
    shot_check.make_way()
    done, uid = take.read().frames, smoke.session_uid
    job = Job(words, take.log_file, volume.frames_before_take(smoke, take), done)
    runs[:] = [run for run in runs if run.smoke != uid or not run.job.ended]
    runs.append(Run(take, uid, job, (done, False), settings))
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
        self._thumbnails = bpy.utils.previews.new()
        self._timer = context.window_manager.event_timer_add(TICK_SECONDS, window=context.window)
        context.window_manager.modal_handler_add(self)
        return {"RUNNING_MODAL"}

    def modal(self, context: bpy.types.Context, event: bpy.types.Event) -> set[str]:
        """Poll on the timer, pass other events on; Esc asks whether to stop."""
        if event.type == "ESC" and event.value == "PRESS" and running() and not _playing(context):
            bpy.ops.smokelift.cancel("INVOKE_DEFAULT")
            return {"RUNNING_MODAL"}
        if event.type == "TIMER" and not self._tick(context):
            self._end(context)
            return {"FINISHED"}
        return {"PASS_THROUGH"}

    def execute(self, context: bpy.types.Context) -> set[str]:
        """Without a window: poll to the end."""
        self._thumbnails = bpy.utils.previews.new()
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

    def _end(self, context: bpy.types.Context) -> None:
        for run in runs:
            run.icon = 0
            waits = run.job.outcome == "waiting"
            run.job.kill()
            if waits and find_smoke(run.smoke) is not None:  # a deleted one may come back
                run.take.remove_unless_begun()
        bpy.utils.previews.remove(self._thumbnails)
        if self._timer is not None:
            context.window_manager.event_timer_remove(self._timer)

    def _tick(self, context: bpy.types.Context) -> bool:
        """Poll once; returns whether work remains."""
        for run in runs:
            if not run.job.ended and find_smoke(run.smoke) is None:
                run.job.cancel()  # it has nowhere to go; undo brings the smoke back, and Resume goes on
        run = running()
        waiting = next((run for run in runs if run.job.outcome == "waiting"), None)
        changed = run is not None and run.job.poll()
        if changed and run.settings and run.job.forecast is not None and (smoke := find_smoke(run.smoke)) is not None:
            shot_check.learn(smoke, run.settings, run.job)
            run.settings = ""
        if run is None and waiting is not None:
            waiting.job.start()
            changed = True
        new = [run for run in runs if (run.job.done, run.job.ended) != run.shown]
        if new and not bpy.app.is_job_running("RENDER"):  # its data must stay
            for run in new:
                self._show(run)
            new = []
        if changed:
            redraw()
        return bool(new) or any(not run.job.ended for run in runs)

    def _show(self, run: Run) -> None:
        """Show a run's frames in the viewport, and its end."""
        smoke, job = find_smoke(run.smoke), run.job
        created, said = 0, ""
        if smoke is not None:
            count = _datablocks()
            if run.first:
                run.before, run.first = volume.shown_take(smoke), False
            if not run.left:
                said = show_while_made(smoke, run.take, run.before, job.outcome)
            created = _datablocks() - count
            in_tab = smoke == active_smoke(scene_of(smoke))  # of another the artist sees nothing now
            if run.before is None and in_tab and not run.seen:  # the artist may leave it afterwards
                run.seen = _playing(bpy.context) or volume.go_to_smoke(smoke)
        run.shown = job.done, job.ended
        if not bpy.app.background:
            run.icon = self._thumbnail(run.take)
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


def running() -> Run | None:
    """The run that is made now."""
    return next((run for run in runs if run.job.outcome == "running"), None)


def _datablocks() -> int:
    return sum(map(len, (bpy.data.objects, bpy.data.volumes, bpy.data.cameras, bpy.data.materials)))


def _playing(context: bpy.types.Context) -> bool:
    return context.screen is not None and context.screen.is_animation_playing


@persistent
def _forget_all(_file: str = "") -> None:
    """Forget the runs of the file that was open before."""
    runs.clear()


HANDLERS = ((bpy.app.handlers.load_post, _forget_all),)


def unregister() -> None:
    """End the worker and its jobs."""
    manager = bpy.context.window_manager
    running = workers(manager)
    for worker in running:
        worker.cancel(bpy.context)
    runs.clear()
    if running:
        timer = manager.event_timer_add(TICK_SECONDS, window=manager.windows[0])
        bpy.app.timers.register(functools.partial(_wait_for_unregistered, timer), first_interval=TICK_SECONDS)
