"""The check of a shot before its run: the engine's forecast of time, memory and disk, and what it assumes.

It starts by itself once the settings rest, and its result is shown in the panel. A shot that was checked before in this
session is not measured anew.
"""

import hashlib
from collections.abc import Iterable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import bpy

from ..core import ShotError
from ..core.job import Job
from ..core.take import Take
from ..scene.blender import call_later, cancel_call, redraw, rpt_, thread_options
from ..scene.geometry import box_corners, box_of
from ..scene.scene_file import options, shot_files, shot_tables
from ..scene.smoke import active_smoke, find_smoke, scene_of, smokes
from .side_job import REST_SECONDS, SideJob
from .smoke_takes import Run, runs

_known: dict[str, tuple[Mapping[str, Any], list[tuple[str, str]]]] = {}
"""What the engine said of the shots of this session at its end, and its doubts, by their fingerprints."""

WORDS = {
    "background": "Background",
    "scale": "Box",
    "light": "Light",
    "sun's direction": "Light",
    "smoke color": "Smoke Color",
    "axis depth": "Depth",
}
"""What the engine knows of a shot and the panel shows, in the panel's words; the page of the report has the rest."""


def found_lines(facts: Iterable[Mapping[str, str]]) -> list[str]:
    """What was found or assumed, in a line each that fits the sidebar, by the engine's facts."""
    return [f"{WORDS[fact['what']]}: {fact['short']}" for fact in facts if fact["what"] in WORDS]


@dataclass
class ShotCheck:
    """The last check, of which the newest figures are shown until there are others."""

    settings: str = ""  # of the smoke that was checked, by `settings_text`; empty where something else has changed
    page: str = ""  # picture of what was found
    done: bool = False  # whether the engine has said what it found
    error: str = ""  # why it could not
    of: int = 0  # number of the smoke that the engine spoke of last
    details: Mapping[str, Any] = field(default_factory=dict)  # what it said at its end
    doubts: list[tuple[str, str]] = field(default_factory=list)  # why the result may be wrong, as `Job` has them
    awaited: str = ""  # settings of the smoke that is checked soon

    def fits(self, smoke: bpy.types.Object) -> bool:
        """Whether it is of this smoke as it is."""
        return self.settings == settings_text(smoke)

    def costs(self, smoke: bpy.types.Object) -> Mapping[str, Mapping[str, Any]]:
        """What each quality takes and loses, also of this smoke before its last change; nothing of one that failed."""
        failed = self.fits(smoke) and self.error
        return self.details["qualities"] if self.of == smoke.session_uid and not failed else {}

    def found_color(self, smoke: bpy.types.Object) -> Sequence[float] | None:
        """The color behind this smoke (linear), also before its last change; None if it was never read."""
        return self.details.get("background_color") if self.of == smoke.session_uid else None

    def store(self, smoke: bpy.types.Object, details: Mapping[str, Any], doubts: list[tuple[str, str]]) -> None:
        """Keep what the engine said of the smoke."""
        self.done, self.of, self.details, self.doubts = True, smoke.session_uid, details, doubts


state = ShotCheck()  # the check of this session, which is never saved


NEUTRAL = {
    *("quality", "seed"),
    *("output", "start_number", "folder", "results", "saved_as", "before", "directing", "speed", "between"),
    *("set_up_range", "set_up_camera", "set_up_light", "set_up_plate", "set_up_colors", "plate_place"),
    "assumed_camera",
}
"""Settings that change nothing in what the engine says of a shot: it says what each quality takes."""


def settings_text(smoke: bpy.types.Object) -> str:
    """What decides a check: settings of a smoke, its scene's size and rate, and the place of its box, as a text."""
    settings, render = smoke.smokelift, scene_of(smoke).render
    names = [setting.identifier for setting in settings.bl_rna.properties]
    values = [getattr(settings, name) for name in names if name not in NEUTRAL]
    box = box_of(smoke) if settings.camera_mode == "SCENE" else None
    place = [f"{number:.5g}" for corner in box_corners(box) for number in corner] if box is not None else []
    size = (render.resolution_x, render.resolution_y, render.fps, render.fps_base)
    return repr((smoke.session_uid, values, size, place))


check_job = SideJob()  # the check's own, beside which files may be written


def check(smoke: bpy.types.Object, needs_page: bool = True) -> None:
    """Check a shot; without a window, to the end. A run tells the same, but for the page."""
    bpy.context.view_layer.update()  # or the box would be where it was
    state.settings, state.done, state.error = settings_text(smoke), False, ""
    _start(smoke, needs_page)
    if bpy.app.background:
        check_job.wait()


def stop(smoke: bpy.types.Object) -> None:
    """Stop reading the clip, until a setting changes or the artist asks for a check."""
    make_way()
    state.settings, state.done = settings_text(smoke), False
    state.error = rpt_("Time and memory are not estimated: Check Shot does it.")


def learn(run: Run) -> None:
    """Take the forecast of a run for a check, once, unless the settings that it began with have changed meanwhile."""
    smoke, job, settings = find_smoke(run.smoke), run.job, run.settings
    if smoke is None or job.forecast is None or not settings:
        return
    run.settings = ""
    if settings != settings_text(smoke):
        return
    with suppress(ShotError):
        shot = _fingerprint(smoke, shot_tables(smoke, quick=True))
        _known[shot] = job.forecast
        if smoke == active_smoke(scene_of(smoke)):
            state.settings, state.error, state.page = settings, "", str(_page(shot))
            state.store(smoke, *job.forecast)


def make_way() -> None:
    """Stop reading the clip for a run, which reads it too; the tab begins again unless the run says what it found."""
    cancel_call(_start_later)
    if check_job.job is not None:
        check_job.stop()
        state.settings = ""


def check_soon(context: bpy.types.Context, smoke: bpy.types.Object) -> bool:
    """Have the smoke in the tab checked once its settings rest, if no run is at work; whether it will be."""
    busy = any(not run.job.ended for run in runs)
    if busy or bpy.app.background or context.window != context.window_manager.windows[0]:
        return False
    if not bpy.app.timers.is_registered(_start_later) or state.awaited != settings_text(smoke):
        state.awaited = settings_text(smoke)
        call_later(_start_later, REST_SECONDS)
    return True


def _start_later() -> None:
    """Check the smoke in the tab; a timer, which has no window."""
    with bpy.context.temp_override(window=bpy.context.window_manager.windows[0]):
        smoke = active_smoke(bpy.context.scene)
        if smoke is not None and smoke.smokelift.clip is not None:
            check(smoke, needs_page=False)
    redraw()


def _start(smoke: bpy.types.Object, needs_page: bool) -> None:
    """Start the engine on a shot, unless it is at work on it or it is known what it says: that goes into the state."""
    try:
        take, words, tables = Take(Path(bpy.app.tempdir) / "smokelift_check"), options(smoke), shot_tables(smoke, True)
        take.write(tables, words)
        shot = _fingerprint(smoke, tables)
        page = _page(shot)
        if check_job.job is not None and state.page == str(page):
            return
        check_job.stop()
        state.done, state.page = False, str(page)
        if shot in _known and (page.is_file() or not needs_page):
            state.store(smoke, *_known[shot])
            return

        def store(smoke: bpy.types.Object, job: Job) -> None:
            if job.outcome == "done":
                _known[shot] = job.details, job.doubts
            if not state.fits(smoke):  # it has changed meanwhile
                return
            if job.outcome == "done":
                state.store(smoke, *_known[shot])
            else:
                state.error = job.sentence

        check_job.start(smoke, ["inspect", str(take.scene_file), "--page", str(page), *words], store)
    except ShotError as error:
        check_job.stop()
        state.error = str(error)


def _page(shot: str) -> Path:
    return Path(bpy.app.tempdir) / f"smokelift_inspect_{shot}.png"


def _fingerprint(smoke: bpy.types.Object, tables: Mapping[str, Any]) -> str:
    """What tells a shot from others: its scene file, options that are not `NEUTRAL`, and the state of its files."""
    settings, words = smoke.smokelift, options(smoke) + thread_options()
    neutral = (settings.quality, f"--seed={settings.seed}")
    files = shot_files(smoke).values()
    states = [(file.stat().st_mtime_ns, file.stat().st_size) if file.exists() else None for file in files]
    parts = repr((tables, [word for word in words if word not in neutral], states))
    return hashlib.sha256(parts.encode()).hexdigest()[:16]


def _when_drawn_on(scene: bpy.types.Scene, depsgraph: bpy.types.Depsgraph) -> None:
    """Forget the last check where the mask of a smoke was drawn on; the tab begins another when it is drawn."""
    if not state.settings or not depsgraph.id_type_updated("MASK"):
        return
    changed = {update.id.original for update in depsgraph.updates}
    if any(smoke.smokelift.drawn_mask in changed for smoke in smokes(scene)):
        state.settings = ""
        redraw()


HANDLERS = ((bpy.app.handlers.depsgraph_update_post, _when_drawn_on),)
