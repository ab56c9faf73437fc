"""The engine's work that is no run of the queue, since it changes no result: an export, a proxy, an element.

There is one such job at a time, which a timer of Blender polls.
"""

import time
from collections.abc import Callable
from pathlib import Path

import bpy

from ..core.job import EngineMissingError, Job, engine_command
from ..core.take import TakeError
from ..scene.blender import ShotError, redraw, thread_options
from ..scene.smoke import active_smoke, find_smoke

TICK_SECONDS = 0.1

End = Callable[[bpy.types.Object, Job], None]
"""Called with the smoke and the job when that has ended."""

Request = tuple[list[str], End]
"""The engine's arguments, and what is done at the end."""


class SideJob:
    """The job, and after its end what it said; never saved.

    Attributes
    ----------
    smoke
        Number of the smoke that it is for.
    operator
        Identifier of the operator that has files written; empty for an estimate.
    sentence
        The result, or the reason of a failure; empty for an estimate.
    doubts
        Why the result may be wrong, as `Job` has them.
    """

    def __init__(self) -> None:
        self.job: Job | None = None
        self.smoke = 0
        self.operator = ""
        self.sentence = ""
        self.doubts: list[tuple[str, str]] = []
        self._end: End | None = None

    @property
    def writing(self) -> bool:
        """Whether files are being written."""
        return self.job is not None and bool(self.operator)

    def start(self, smoke: bpy.types.Object, request: Request, operator: str = "") -> None:
        """Start the engine; EngineMissingError if there is none."""
        self.stop()
        words, self._end = request
        self.smoke, self.operator, self.sentence, self.doubts = smoke.session_uid, operator, "", []
        words = [*words, "--progress", "json", *thread_options()]
        self.job = Job(engine_command(words), Path(bpy.app.tempdir) / "smokelift.log")
        self.job.start()
        again(self.poll, TICK_SECONDS)

    def stop(self) -> None:
        """End the engine at once."""
        if self.job is not None:
            self.job.kill()
        self.job = None

    def poll(self) -> float | None:
        """Read what the engine says; a timer that ends with it."""
        job = self.job
        if job is None:
            return None
        if job.poll():
            redraw(bpy.context.window_manager)
        if not job.ended:
            return TICK_SECONDS
        self.job = None
        if self.operator:
            self.sentence, self.doubts = job.sentence, job.doubts
        smoke = find_smoke(self.smoke)
        if smoke is not None:
            self._end(smoke, job)
        return None


side_job = SideJob()


def again(timer: Callable[[], float | None], seconds: float) -> None:
    """Have Blender call a function, once, however often it is asked for."""
    if bpy.app.timers.is_registered(timer):
        bpy.app.timers.unregister(timer)
    bpy.app.timers.register(timer, first_interval=seconds)


class Writes:
    """An operator that has the engine write files; without a window it waits for them."""

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        if side_job.writing:
            cls.poll_message_set("Other files are being written: wait for them, or cancel that")
            return False
        return super().poll(context)

    def request(self, smoke: bpy.types.Object) -> Request:
        """The engine's arguments, and what is done at the end; ShotError or TakeError if something is in the way."""
        raise NotImplementedError

    def execute(self, context: bpy.types.Context) -> set[str]:
        smoke = active_smoke(context.scene)
        try:
            side_job.start(smoke, self.request(smoke), type(self).bl_idname)
        except (ShotError, TakeError, EngineMissingError) as error:
            self.report({"ERROR"}, str(error))
            return {"CANCELLED"}
        if not bpy.app.background:
            return {"FINISHED"}
        job = side_job.job
        while side_job.poll() is not None:
            time.sleep(TICK_SECONDS)
        if job.outcome != "done":
            self.report({"ERROR"}, job.sentence)
            return {"CANCELLED"}
        return {"FINISHED"}


class SMOKELIFT_OT_stop_writing(bpy.types.Operator):
    """Stop writing these files"""

    bl_idname = "smokelift.stop_writing"
    bl_label = "Stop Writing"
    bl_options = {"INTERNAL"}

    def execute(self, _context: bpy.types.Context) -> set[str]:
        side_job.stop()
        return {"FINISHED"}


register, _unregister = bpy.utils.register_classes_factory((SMOKELIFT_OT_stop_writing,))


def unregister() -> None:
    """Unregister it and end the engine."""
    side_job.stop()
    if bpy.app.timers.is_registered(side_job.poll):
        bpy.app.timers.unregister(side_job.poll)
    _unregister()
