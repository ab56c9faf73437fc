"""The engine's work that is no run of the queue, since it changes no result: a check, an export, a proxy, an element.

A timer of Blender polls it.
"""

import time
from collections.abc import Callable
from pathlib import Path
from typing import ClassVar

import bpy

from ..core import ShotError
from ..core.job import Job, engine_command
from ..scene.blender import call_later, redraw, thread_options
from ..scene.smoke import find_smoke

TICK_SECONDS = 0.1  # time between two readings of what the engine says
REST_SECONDS = 0.4  # time without a change of settings before the engine is asked what they come to
End = Callable[[bpy.types.Object, Job], None]  # called with the smoke and the job when that has ended


class SideJob:
    """One such job at a time, and after its end what it said; never saved."""

    all: ClassVar[list["SideJob"]] = []

    def __init__(self) -> None:
        self.job: Job | None = None  # the one that runs
        self.smoke = 0  # number of the smoke that it is for
        self.operator = ""  # identifier of the operator that has files written; empty for an estimate
        self.seconds = 0  # whole seconds since its start
        self.sentence = ""  # the result, or the reason of a failure; empty for an estimate
        self.doubts: list[tuple[str, str]] = []  # why the result may be wrong, as `Job` has them
        self._end: End | None = None
        self._began = 0.0
        self._timer = self.poll  # Blender knows a timer by the object, and each `self.poll` is another
        self.all.append(self)

    @property
    def writing(self) -> bool:
        """Whether files are being written."""
        return self.job is not None and bool(self.operator)

    def start(self, smoke: bpy.types.Object, words: list[str], end: End, operator: str = "") -> None:
        """Start the engine with arguments; ShotError if there is none."""
        self.stop()
        self._end = end
        self.smoke, self.operator, self.sentence, self.doubts = smoke.session_uid, operator, "", []
        words = [*words, "--progress", "json", *thread_options()]
        self.job = Job(engine_command(words), Path(bpy.app.tempdir) / "smokelift.log")
        self._began, self.seconds = time.monotonic(), 0
        self.job.start()
        call_later(self._timer, TICK_SECONDS)

    def stop(self) -> None:
        """End the engine at once."""
        if self.job is not None:
            self.job.kill()
        self.job = None

    def wait(self) -> None:
        """Wait for its end, without a window."""
        while self.poll() is not None:
            time.sleep(TICK_SECONDS)

    def poll(self) -> float | None:
        """Read what the engine says; a timer that ends with it."""
        job, before = self.job, self.seconds
        if job is None:
            return None
        self.seconds = int(time.monotonic() - self._began)
        if job.poll() or self.seconds != before:
            redraw()
        if not job.ended:
            return TICK_SECONDS
        self.job = None
        if self.operator:
            self.sentence, self.doubts = job.sentence, job.doubts
        smoke = find_smoke(self.smoke)
        if smoke is not None:
            self._end(smoke, job)
        return None


writing_job = SideJob()  # writes files, or estimates how large they will be


def write_files(
    smoke: bpy.types.Object, operator: str, words: list[str], complete: Callable[[bpy.types.Object], str | None]
) -> None:
    """Have the engine write files of a smoke, by its arguments, for an operator; without a window, wait for them.

    Then ``complete`` is called with the smoke, and may return what is said in place of the engine's words. ShotError
    if there is no engine, or, without a window, if it failed.
    """

    def end(smoke: bpy.types.Object, job: Job) -> None:
        if job.outcome == "done":
            writing_job.sentence = complete(smoke) or job.sentence

    writing_job.start(smoke, words, end, operator)
    job = writing_job.job
    if bpy.app.background:
        writing_job.wait()
        if job.outcome != "done":
            raise ShotError(job.sentence)


def _stop_all(_file: str = "") -> None:
    """End the engine, as another file is loaded."""
    for job in SideJob.all:
        job.stop()


HANDLERS = ((bpy.app.handlers.load_pre, _stop_all),)

unregister = _stop_all
