"""The result: a Volume object that plays the sequence, with a material of the smoke's optical properties."""

import math
import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import bpy
from mathutils import Vector

from ..core.contract import DIRECTIONS, FRAME_FILE, MADE_UP, PROXY_FILE
from ..core.retiming import retiming
from ..core.take import TITLES, Take
from .blender import absolute, frame_rate, relative, set_unless_changed
from .box import engine_to_world
from .look import fit_look
from .modifiers import FRAMES_BETWEEN, PROXY, drive_interpolation, fit_interpolation, fit_proxy
from .smoke import scene_of, smokes

BESIDE = 1.1  # widths of the box between a smoke and another take beside it
EARLY = 0.001  # frames by which a frame of the clip is shown early, so that rounding does not delay it by a whole one

GOOD_DEGREES = 30
"""Degrees beside its camera at which smoke of one camera still has what `sentences` calls good, about 28 dB: 29.0 at 20
and 25.1 at 45 degrees, mean of four scenes, smooth (docs/accuracy.md)."""

_FRAMES = re.compile(r"[Ff]rames? \d+(?: to \d+)?")  # frames that a sentence of the engine names

PROVENANCE = "smokelift_provenance"
"""Custom property of the Volume that says what of the smoke is measured, also where its files are not at hand."""


def show(smoke: bpy.types.Object, take: Take) -> bpy.types.Object | None:
    """Show a take's finished frames in a smoke, whose place and material stay the artist's; None if there are none."""
    index = take.read().index
    if not index or not index["frames"]:
        return None
    before = shown_take(smoke)
    if before != take:
        smoke.smokelift.before = relative(before.directory) if before is not None else ""
        smoke.delta_location = (0.0, 0.0, 0.0)
        set_unless_changed(smoke, "place", smoke, "matrix_basis", engine_to_world(smoke))
    _correct_position(smoke, index["scene"]["domain"])
    fit_look(smoke, index["scene"])
    _play(smoke, take, index)
    parts, before = index.get("provenance", []), frames_before(smoke.smokelift, index)
    smoke.data[PROVENANCE] = _provenance(parts, bool(index["scene"].get("views")), before)
    return smoke


def shown_take(smoke: bpy.types.Object) -> Take | None:
    """The take that a smoke shows."""
    return take_of(smoke.data)


def shown_index(smoke: bpy.types.Object) -> dict[str, Any] | None:
    """The `sequence.json` of the take that a smoke shows; None if it has no finished frame."""
    take = shown_take(smoke)
    index = take.read().index if take is not None else None
    return index if index and index["frames"] else None


def shown_numbers(smoke: bpy.types.Object) -> list[int]:
    """The numbers of the finished frames of the take that a smoke shows."""
    index = shown_index(smoke)
    return _numbers(index) if index else []


def number_at(smoke: bpy.types.Object, frame: int) -> int:
    """The number in the take that a smoke shows in a frame of its scene, without a live timing."""
    data, (first, ratio) = smoke.data, _step(smoke)
    return first + math.floor((frame - data.frame_start + EARLY) / ratio)


def scene_frame(smoke: bpy.types.Object, number: int) -> int:
    """The first frame of its scene in which a smoke shows a number of its take, without a live timing."""
    data, (first, ratio) = smoke.data, _step(smoke)
    return data.frame_start + math.ceil((number - first) * ratio - EARLY)


def _step(smoke: bpy.types.Object) -> tuple[int, float]:
    """The first number of the take on show, and frames of the scene for each."""
    index = shown_index(smoke)
    if index is None:
        return 1, 1.0
    return _numbers(index)[0], _ratio(smoke, index) if _real_time(smoke, index) else 1.0


def frames_before_take(smoke: bpy.types.Object, take: Take) -> int:
    """Number of the clip's frames before a take's first: with it, the take's numbers are the clip's, and go on.

    One that is made of another take, and has no frame yet, has the other's.
    """
    index = take.read().index
    while index is None and (source := take.read().source) is not None:
        take = source
        index = take.read().index
    return frames_before(smoke.smokelift, index) if index else smoke.smokelift.first - 1


def shown_range(smoke: bpy.types.Object) -> tuple[int, int] | None:
    """The first and the last frame of its scene in which a smoke shows its take, those that are still made included."""
    index, data = shown_index(smoke), smoke.data
    if index is None:
        return None
    last = data.frame_start + data.frame_duration - 1
    if not index["complete"] and "direct" not in index.get("settings", {}):
        last = max(last, scene_frame(smoke, _last_planned(index)))
    return data.frame_start, last


def _last_planned(index: dict[str, Any]) -> int:
    """The number of the last frame that a take made of a clip will have."""
    finished, used = _numbers(index), index["scene"]["clip"].get("frames")
    return finished[0] + used[1] - used[0] if used else finished[-1]


def go_to_smoke(smoke: bpy.types.Object) -> bool:
    """Go to the first frame that shows smoke unless the current one does, or will; returns whether there is any yet."""
    index, scene = shown_index(smoke), scene_of(smoke)
    smoky = [int(n) for n, figures in index["frames"].items() if figures.get("mass", 1.0) > 0.0] if index else []
    if not smoky:
        return False
    number = number_at(smoke, scene.frame_current)
    if number not in smoky and not _numbers(index)[-1] < number <= _last_planned(index):
        scene.frame_set(scene_frame(smoke, min(smoky)))
    return True


def take_before(smoke: bpy.types.Object) -> Take | None:
    """The take that a smoke showed before; None if it has no frames any more."""
    path = smoke.smokelift.before
    take = Take(absolute(path)) if path else None
    return take if take is not None and take.read().frames else None


def show_beside(smoke: bpy.types.Object, take: Take) -> bpy.types.Object | None:
    """Show a take in a copy of a smoke, on its right, which is no smoke itself; None if no frame is finished."""
    index = take.read().index
    if not index or not index["frames"]:
        return None
    copy = smoke.copy()
    copy.name = f"{smoke.name}, {take.read().title}"
    copy.data = smoke.data.copy()
    copy.data.name = copy.name
    copy.smokelift.is_smoke = False
    for collection in smoke.users_collection:
        collection.objects.link(copy)
    domain = index["scene"]["domain"]
    width = (domain["max"][0] - domain["min"][0]) * BESIDE
    copy.location += copy.matrix_basis.to_3x3() @ Vector((width, 0.0, 0.0))
    _play(copy, take, index)
    return copy


def take_of(volume: bpy.types.Volume) -> Take | None:
    """The take that a Volume plays; None for one without a file, whose empty path saving turns into ``//``."""
    path = absolute(volume.filepath, volume.library)
    return Take(path.parent) if path.suffix == ".vdb" else None


def directories_on_show() -> set[Path]:
    """Directories, without links, of the takes that Volumes of this file show."""
    shown = (take_of(data) for data in bpy.data.volumes)
    return {take.directory.resolve() for take in shown if take is not None}


def provenance_note(smoke: bpy.types.Object) -> str:
    """What of a smoke is measured and what is not, as a line for the panel; empty if that is unknown."""
    return smoke.data.get(PROVENANCE, "")


def _provenance(parts: list[dict[str, Any]], has_further_views: bool, before: int) -> str:
    """The line; of what was done last after the clip, with its frames counted on from the clip's.

    What was done before names frames of an earlier result, which are others in this one.
    """
    done = [part for part in parts if part["what"] in DIRECTIONS]
    directed = [_renumbered(part["how"], before) for part in done[-1:]]
    if len(done) > 1:
        directed.append(f"Before that: {', '.join(TITLES[part['what']] for part in done[:-1])}.")
    parts = [part for part in parts if part["what"] not in DIRECTIONS]
    if not parts:  # the engine of earlier versions did not say
        return " ".join(directed)
    made_up = next((part["settings"] for part in parts if part["origin"] == MADE_UP), None)
    if made_up is None:
        what = "Nothing is made up: its depth is smooth."
    else:
        what = f"Made up: Depth Detail {made_up['detail']:.2g}, Variation {made_up['seed']}."
    seen = "What the camera sees is measured"
    seen += "." if has_further_views else f", good to about {GOOD_DEGREES} degrees beside it."
    return " ".join([seen, what, *directed])


def _renumbered(words: str, before: int) -> str:
    """A sentence of the engine, which counts the frames of a result from 1, with so many frames before them."""
    return _FRAMES.sub(lambda named: re.sub(r"\d+", lambda number: str(int(number[0]) + before), named[0]), words)


def correct_positions(_file: str = "") -> None:
    """Correct all smokes, since another version of Blender may have saved the file."""
    for smoke, index in _shown():
        _correct_position(smoke, index["scene"]["domain"])


def _shown() -> Iterator[tuple[bpy.types.Object, dict[str, Any]]]:
    """Every smoke of every scene whose take has finished frames, with its `sequence.json`."""
    every = (smoke for scene in bpy.data.scenes for smoke in smokes(scene))
    return ((smoke, index) for smoke in every if (index := shown_index(smoke)) is not None)


def _correct_position(obj: bpy.types.Object, domain: dict[str, Any]) -> None:
    """Compensate for Cycles, which before 5.0 renders every grid half a voxel too far along all its axes."""
    voxel = (domain["max"][0] - domain["min"][0]) / domain["resolution"][0]
    shift = Vector([-voxel / 2] * 3) if bpy.app.version < (5, 0, 0) else Vector()
    obj.delta_location = obj.matrix_basis.to_quaternion() @ shift


def synchronize_playback() -> None:
    """Play all smokes in step with their clips, after a clip or a scene got another time or rate."""
    for smoke, index in _shown():
        _set_time(smoke, index)


def _numbers(index: dict[str, Any]) -> list[int]:
    return sorted(int(number) for number in index["frames"])


def _file_numbers(index: dict[str, Any]) -> list[int]:
    """The numbers in the names of the finished frames' files; the engine of earlier versions counts from 1."""
    return [number + index.get("start_number", 1) - 1 for number in _numbers(index)]


def _play(smoke: bpy.types.Object, take: Take, index: dict[str, Any]) -> None:
    """Make a smoke, and its proxy if the take has one, read the take's files and play when its clip does."""
    numbers = _file_numbers(index)
    _set_file(smoke.data, take.directory / FRAME_FILE.format(numbers[0]), index)
    fit_proxy(smoke, take, numbers)
    for volume, name in ((PROXY.volume(smoke), PROXY_FILE), (FRAMES_BETWEEN.volume(smoke), FRAME_FILE)):
        if volume is not None:
            _set_file(volume, take.directory / name.format(numbers[0]), index)
    _set_time(smoke, index)


def _set_file(volume: bpy.types.Volume, file: Path, index: dict[str, Any]) -> None:
    path = relative(file)
    if volume.filepath != path:
        volume.filepath = path
    volume.is_sequence = True
    if volume.velocity_grid != "velocity":  # Blender complains if the default is set again
        volume.velocity_grid = "velocity"
    volume.velocity_unit = "SECOND"
    set_unless_changed(volume, "clipping", volume.render, "clipping", 0.0)
    # the viewport shows the render's optical depth
    set_unless_changed(volume, "density", volume.display, "density", index["scene"]["medium"]["extinction"])


def _set_time(smoke: bpy.types.Object, index: dict[str, Any]) -> None:
    """Make a smoke, its proxy and what it needs for frames between play when its clip does, at the timing on trial."""
    settings, numbers, ratio = smoke.smokelift, _file_numbers(index), _ratio(smoke, index)
    real = _real_time(smoke, index)
    direction = index.get("settings", {}).get("direct", {}).get("job")
    live = settings.directing.live and direction != "retime" and not _tracked(index)
    steps = ratio if real else 1.0
    speeds = settings.directing.speeds() if live else (1.0,)
    timing = retiming(len(numbers), speeds)
    before = frames_before(settings, index)
    first = (settings.clip.frame_start if settings.clip else 1) + (round(before * ratio) if real else before)
    set_unless_changed(smoke.data, "start", smoke.data, "frame_start", first)
    start = smoke.data.frame_start
    time = f"(frame-{start}+{EARLY})/{steps:.9g}"
    place = f"min({timing.place(time)},{len(numbers) - 1})"
    fit_interpolation(smoke, settings.between and (real or live))
    for volume, ahead in ((smoke.data, 0), (PROXY.volume(smoke), 0), (FRAMES_BETWEEN.volume(smoke), 1)):
        if volume is None:
            continue
        volume.frame_start, volume.frame_offset = start, numbers[0] - 1
        volume.sequence_mode = "REPEAT" if direction == "loop" else "CLIP"
        for name in ("frame_offset", "velocity_scale"):
            volume.driver_remove(name)
        volume.frame_duration = max(1, math.ceil(steps * timing.duration - EARLY))
        volume.velocity_scale = (1.0 if real else ratio) * speeds[0]
        if real or live:
            # Blender shows one file in each frame of the scene; the driven offset selects another
            file = f"min(floor({place})+{ahead},{len(numbers) - 1})" if ahead else f"floor({place})"
            volume.driver_add("frame_offset").driver.expression = f"{file}-(frame-{start})+{numbers[0] - 1}"
        if live and len(speeds) > 1:
            scale = f"{1.0 if real else ratio:.9g}*({timing.speed(time)})"
            volume.driver_add("velocity_scale").driver.expression = scale
    drive_interpolation(smoke, place, 1.0 / index["scene"]["clip"]["fps"])


def _ratio(smoke: bpy.types.Object, index: dict[str, Any]) -> float:
    """Frames of the scene in the time of one of the clip."""
    return frame_rate(scene_of(smoke)) / index["scene"]["clip"]["fps"]


def _tracked(index: dict[str, Any]) -> bool:
    """Whether the smoke keeps step with a moving camera, which has one matrix for each frame of the clip."""
    return "matrices" in index["scene"].get("camera", {})


def _real_time(smoke: bpy.types.Object, index: dict[str, Any]) -> bool:
    """Whether frames are left out or repeated so that the smoke is as fast as in reality."""
    same = math.isclose(_ratio(smoke, index), 1.0, rel_tol=1e-3)
    return smoke.smokelift.speed == "REAL" and not _tracked(index) and not same


def frames_before(settings: bpy.types.PropertyGroup, index: dict[str, Any]) -> int:
    """Number of the clip's frames before the take's first, which settings for the next take do not change."""
    frames = index["scene"]["clip"].get("frames")
    return settings.first - 1 if frames is None or settings.clip is None else frames[0] - settings.clip.frame_offset


def _listen(_file: str = "") -> None:
    """Have Blender say when the time or rate of a clip or scene changes; loading a file ends that."""
    bpy.msgbus.clear_by_owner(_LISTENER)
    for owner, names in _TIMES.items():
        for name in names:
            key = (getattr(bpy.types, owner), name)
            bpy.msgbus.subscribe_rna(key=key, owner=_LISTENER, args=(), notify=synchronize_playback)


_LISTENER = object()
_TIMES = {"MovieClip": ("frame_start", "frame_offset"), "RenderSettings": ("fps", "fps_base")}

HANDLERS = ((bpy.app.handlers.load_post, correct_positions), (bpy.app.handlers.load_post, _listen))


register = _listen


def unregister() -> None:
    bpy.msgbus.clear_by_owner(_LISTENER)
