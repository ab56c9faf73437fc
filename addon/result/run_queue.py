"""The engine beside Blender: a timer that works through the queue of takes and shows their progress."""

import time

import bpy
import bpy.utils.previews
from bpy.props import BoolProperty, StringProperty

from ..core import ShotError
from ..core.take import Take
from ..scene import volume
from ..scene.blender import call_later, cancel_call, redraw
from ..scene.smoke import active_smoke, find_smoke, scene_of
from . import shot_check
from .side_job import TICK_SECONDS
from .smoke_takes import Run, engine_job, runs, show_while_made


def enqueue(smoke: bpy.types.Object, take: Take, settings: str = "") -> None:
    """Append a take to the queue; without a window, wait for its end. ShotError if it cannot be made.

    It is made with settings as `shot_check.settings_text` has them; empty if they are not the smoke's own.
    """
    try:
        job = engine_job(smoke, take)
    except ShotError:
        take.remove_unless_begun()
        raise
    shot_check.make_way()
    uid = smoke.session_uid
    runs[:] = [run for run in runs if run.smoke != uid or not run.job.ended]
    runs.append(Run(take, uid, job, (job.done, False), settings))
    work()


def work() -> None:
    """Work through the queue; without a window, to its end."""
    if not bpy.app.background:
        call_later(_timer, 0.0)
        return
    while _tick():
        time.sleep(TICK_SECONDS)


def _timer() -> float | None:
    """Go on in the first window, which exists as long as Blender does: a timer has none."""
    with bpy.context.temp_override(window=bpy.context.window_manager.windows[0]):
        return TICK_SECONDS if _tick() else None


def _tick() -> bool:
    """Poll once; returns whether work remains."""
    for run in runs:
        if not run.job.ended and find_smoke(run.smoke) is None:
            run.job.cancel()  # it has nowhere to go; undo brings the smoke back, and Resume goes on
    run = running()
    waiting = next((run for run in runs if run.job.outcome == "waiting"), None)
    changed = run is not None and run.job.poll()
    if changed:
        shot_check.learn(run)
    if run is None and waiting is not None:
        waiting.job.start()
        changed = True
    new = [run for run in runs if (run.job.done, run.job.ended) != run.shown]
    if new and not bpy.app.is_job_running("RENDER"):  # its data must stay
        for run in new:
            _show(run)
        new = []
    if changed:
        redraw()
    remains = bool(new) or any(not run.job.ended for run in runs)
    if not remains:
        _remove_thumbnails()
    return remains


def _show(run: Run) -> None:
    """Show a run's frames in the viewport, and its end."""
    smoke, job = find_smoke(run.smoke), run.job
    created, said = 0, ""
    if smoke is not None:
        count = _datablocks()
        if run.first:
            run.before, run.first = volume.shown_take(smoke), False
        said = show_while_made(smoke, run)
        created = _datablocks() - count
        in_tab = smoke == active_smoke(scene_of(smoke))  # of another the artist sees nothing now
        if run.before is None and in_tab and not run.seen:  # the artist may leave it afterwards
            run.seen = _playing(bpy.context) or volume.go_to_smoke(smoke)
    run.shown = job.done, job.ended
    if not bpy.app.background:
        run.icon = _thumbnail(run.take)
        if smoke is not None and (created or job.ended):  # where it was deleted, one undo brings it back
            # an undo to a step before new objects leaves Blender with dangling pointers
            bpy.ops.ed.undo_push(message="Make Smoke")
        if words := " ".join(filter(None, (said, job.sentence if job.ended else ""))):
            bpy.ops.smokelift.tell("INVOKE_DEFAULT", words=words, failed=job.outcome == "failed")


class SMOKELIFT_OT_tell(bpy.types.Operator):
    """Say how a run goes as Blender does: only an operator that waits for an event can, and no timer"""

    bl_idname = "smokelift.tell"
    bl_label = "Smokelift"
    bl_options = {"INTERNAL"}

    words: StringProperty()
    failed: BoolProperty()

    def invoke(self, context: bpy.types.Context, _event: bpy.types.Event) -> set[str]:
        self._timer = context.window_manager.event_timer_add(TICK_SECONDS, window=context.window)
        context.window_manager.modal_handler_add(self)
        return {"RUNNING_MODAL"}

    def modal(self, context: bpy.types.Context, _event: bpy.types.Event) -> set[str]:
        context.window_manager.event_timer_remove(self._timer)
        self.report({"ERROR" if self.failed else "INFO"}, self.words)
        return {"FINISHED", "PASS_THROUGH"}


def _thumbnail(take: Take) -> int:
    """The icon of the take's thumbnail; 0 if there is none."""
    if not take.thumbnail_file.is_file():
        return 0
    image, name = bpy.data.images.load(str(take.thumbnail_file)), str(take.directory)
    preview = register.thumbnails.get(name) or register.thumbnails.new(name)
    preview.image_size = image.size
    preview.image_pixels_float = image.pixels[:]
    bpy.data.images.remove(image)
    return preview.icon_id


def _remove_thumbnails() -> None:
    for run in runs:
        run.icon = 0
    register.thumbnails.clear()


def running() -> Run | None:
    """The run that is made now."""
    return next((run for run in runs if run.job.outcome == "running"), None)


def _datablocks() -> int:
    return sum(map(len, (bpy.data.objects, bpy.data.volumes, bpy.data.cameras, bpy.data.materials)))


def _playing(context: bpy.types.Context) -> bool:
    return context.screen is not None and context.screen.is_animation_playing


def _stop_all(_file: str = "") -> None:
    """End the engine, as another file is loaded; finished frames stay."""
    cancel_call(_timer)
    for run in runs:
        waits = run.job.outcome == "waiting"
        run.job.kill()
        if waits and find_smoke(run.smoke) is not None:  # a deleted one may come back
            run.take.remove_unless_begun()
    _remove_thumbnails()
    runs.clear()


class SMOKELIFT_OT_cancel(bpy.types.Operator):
    """Stop the run. Finished frames stay, and Resume continues after them"""

    bl_idname = "smokelift.cancel"
    bl_label = "Stop Making Smoke?"
    bl_options = {"INTERNAL"}

    take: StringProperty(options={"SKIP_SAVE", "HIDDEN"})

    def invoke(self, context: bpy.types.Context, event: bpy.types.Event) -> set[str]:
        """Without a take, as Esc has none, ask whether to stop; Esc ends an animation that plays first."""
        if self.take:
            return self.execute(context)
        if running() is None or _playing(context):
            return {"CANCELLED", "PASS_THROUGH"}
        return context.window_manager.invoke_confirm(self, event)

    def execute(self, context: bpy.types.Context) -> set[str]:
        for run in list(runs):
            if str(run.take.directory) != self.take and (self.take or run.job.outcome != "running"):
                continue
            if run.job.outcome == "waiting":  # it leaves nothing behind
                run.take.remove_unless_begun()
                runs.remove(run)
            else:
                run.job.cancel()
        return {"FINISHED"}


HANDLERS = ((bpy.app.handlers.load_pre, _stop_all),)


def register() -> None:
    """Give Esc to the operator that asks, where nothing else takes it; without a window there are no keys."""
    register.thumbnails = bpy.utils.previews.new()
    keys = bpy.context.window_manager.keyconfigs.addon
    if keys is not None:
        keymap = keys.keymaps.new("Window")
        register.key = keymap, keymap.keymap_items.new(SMOKELIFT_OT_cancel.bl_idname, "ESC", "PRESS")


def unregister() -> None:
    _stop_all()
    bpy.utils.previews.remove(register.thumbnails)
    if key := register.__dict__.pop("key", None):
        key[0].keymap_items.remove(key[1])
