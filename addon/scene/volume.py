"""The result: a Volume object that plays the sequence, with a material of the smoke's optical properties."""

import math
from collections.abc import Iterator
from pathlib import Path

import bpy
from mathutils import Vector

from ..core.contract import DIRECTIONS, FRAME_FILE, MADE_UP, PROXY_FILE, retiming
from ..core.sentences import sentence
from ..core.take import TITLES, Snapshot, Take
from .blender import absolute, file_of, frame_rate, relative, set_unless_changed
from .geometry import engine_to_world
from .look import fit_look
from .modifiers import FRAMES_BETWEEN, PROXY, drive_interpolation, fit_interpolation, fit_proxy
from .smoke import scene_of, smokes

BESIDE = 1.1  # widths of the box between a smoke and another take beside it
EARLY = 0.001  # frames by which a frame of the clip is shown early, so that rounding does not delay it by a whole one

GOOD_DEGREES = 30
"""Degrees beside its camera at which smoke of one camera still has what `sentences` calls good, about 28 dB: 29.0 at 20
and 25.1 at 45 degrees, mean of four scenes, smooth (docs/accuracy.md)."""

PROVENANCE = "smokelift_provenance"
"""Custom property of the Volume that says what of the smoke is measured, also where its files are not at hand."""


def show(smoke: bpy.types.Object, take: Take) -> bpy.types.Object | None:
    """Show a take's finished frames in a smoke, whose place and material stay the artist's; None if there are none."""
    now = take.read()
    if not now.frames:
        return None
    before = shown_take(smoke)
    if before != take:
        smoke.smokelift.before = relative(before.directory) if before is not None else ""
        smoke.delta_location = (0.0, 0.0, 0.0)
        set_unless_changed(smoke, "place", smoke, "matrix_basis", engine_to_world(smoke))
    _correct_position(smoke, now)
    fit_look(smoke, now.scene)
    _play(smoke, take)
    smoke.data[PROVENANCE] = _provenance(now, frames_before(smoke, take))
    return smoke


def show_beside(smoke: bpy.types.Object, take: Take) -> bpy.types.Object:
    """Show a take with finished frames in a copy of a smoke, on its right, which is no smoke itself."""
    now = take.read()
    copy = smoke.copy()
    copy.name = f"{smoke.name}, {now.title}"
    copy.data = smoke.data.copy()
    copy.data.name = copy.name
    copy.smokelift.is_smoke = False
    for collection in smoke.users_collection:
        collection.objects.link(copy)
    domain = now.scene["domain"]
    width = (domain["max"][0] - domain["min"][0]) * BESIDE
    copy.location += copy.matrix_basis.to_3x3() @ Vector((width, 0.0, 0.0))
    _play(copy, take)
    return copy


def shown_take(obj: bpy.types.Object) -> Take | None:
    """The take that a smoke, or another Volume object, shows."""
    return take_of(obj.data)


def take_of(volume: bpy.types.Volume) -> Take | None:
    """The take that a Volume plays; None for one without a file, whose empty path saving turns into ``//``."""
    path = file_of(volume)
    return Take(path.parent) if path.suffix == ".vdb" else None


def shown(smoke: bpy.types.Object) -> Snapshot | None:
    """What the files of the take that a smoke shows say; None if it has no finished frame."""
    take = shown_take(smoke)
    return take.read() if take is not None and take.read().frames else None


def take_before(smoke: bpy.types.Object) -> Take | None:
    """The take that a smoke showed before; None if it has no frames any more."""
    path = smoke.smokelift.before
    take = Take(absolute(path)) if path else None
    return take if take is not None and take.read().frames else None


def directories_on_show() -> set[Path]:
    """Directories, without links, of the takes that Volumes of this file show."""
    return {take.directory.resolve() for data in bpy.data.volumes if (take := take_of(data)) is not None}


def scene_frame(smoke: bpy.types.Object, number: int) -> int:
    """The first frame of its scene in which a smoke shows a number of its take, without a live timing."""
    first, steps = _frame_mapping(smoke)
    return smoke.data.frame_start + math.ceil((number - first) * steps - EARLY)


def _frame_mapping(smoke: bpy.types.Object) -> tuple[int, float]:
    """The first number of the take on show, and frames of the scene for each."""
    now = shown(smoke)
    return (now.numbers[0], _ratio(smoke, now) if _real_time(smoke, now) else 1.0) if now else (1, 1.0)


def frames_before(smoke: bpy.types.Object, take: Take) -> int:
    """Number of the clip's frames before a take's first: with it, the take's numbers are the clip's, and go on.

    One that is made of another take, and has no frame yet, has the other's. Settings for the next take change nothing.
    """
    now, settings = take.read(), smoke.smokelift
    while not now.index and now.source is not None:
        now = now.source.read()
    frames = now.scene["clip"].get("frames") if now.index else None
    return settings.first - 1 if frames is None or settings.clip is None else frames[0] - settings.clip.frame_offset


def shown_range(smoke: bpy.types.Object) -> tuple[int, int] | None:
    """The first and the last frame of its scene in which a smoke shows its take, those that are still made included."""
    now, data = shown(smoke), smoke.data
    if now is None:
        return None
    last = data.frame_start + data.frame_duration - 1
    if not now.complete and _direction(now) is None:
        last = max(last, scene_frame(smoke, _last_planned(now)))
    return data.frame_start, last


def _last_planned(now: Snapshot) -> int:
    """The number of the last frame that a take made of a clip will have."""
    used = now.scene["clip"].get("frames")
    return now.numbers[0] + used[1] - used[0] if used else now.numbers[-1]


def go_to_smoke(smoke: bpy.types.Object) -> bool:
    """Go to the first frame that shows smoke unless the current one does, or will; returns whether there is any yet."""
    now, scene = shown(smoke), scene_of(smoke)
    smoky = [int(n) for n, figures in now.index["frames"].items() if figures.get("mass", 1.0) > 0.0] if now else []
    if not smoky:
        return False
    first, steps = _frame_mapping(smoke)
    number = first + math.floor((scene.frame_current - smoke.data.frame_start + EARLY) / steps)
    if number not in smoky and not now.numbers[-1] < number <= _last_planned(now):
        scene.frame_set(scene_frame(smoke, min(smoky)))
    return True


def _provenance(now: Snapshot, before: int) -> str:
    """The line for the panel, with frames counted on from the clip's; empty if nothing is known.

    Of what was done after the clip it says the last: what was done before names frames of an earlier result.
    """
    parts = now.index.get("provenance", [])
    done = [part for part in parts if part["what"] in DIRECTIONS]
    directed = [sentence({"text": part["how"], **part}, before) for part in done[-1:]]
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
    seen += "." if now.scene.get("views") else f", good to about {GOOD_DEGREES} degrees beside it."
    return " ".join([seen, what, *directed])


def correct_positions(_file: str = "") -> None:
    """Correct all smokes, since another version of Blender may have saved the file."""
    for smoke, now in _all_shown():
        _correct_position(smoke, now)


def synchronize_playback(_settings: object = None, _context: object = None) -> None:
    """Play all smokes in step with their clips, after clip, scene or smoke got another time or speed."""
    for smoke, now in _all_shown():
        _set_time(smoke, now)


def _all_shown() -> Iterator[tuple[bpy.types.Object, Snapshot]]:
    """Every smoke of every scene whose take has finished frames, with what its files say."""
    every = (smoke for scene in bpy.data.scenes for smoke in smokes(scene))
    return ((smoke, now) for smoke in every if (now := shown(smoke)) is not None)


def _correct_position(obj: bpy.types.Object, now: Snapshot) -> None:
    """Compensate for Cycles, which before 5.0 renders every grid half a voxel too far along all its axes."""
    domain = now.scene["domain"]
    voxel = (domain["max"][0] - domain["min"][0]) / domain["resolution"][0]
    shift = Vector([-voxel / 2] * 3) if bpy.app.version < (5, 0, 0) else Vector()
    obj.delta_location = obj.matrix_basis.to_quaternion() @ shift


def _play(smoke: bpy.types.Object, take: Take) -> None:
    """Make a smoke, and its proxy if the take has one, read the take's files and play when its clip does."""
    now = take.read()
    fit_proxy(smoke, take, now.file_numbers)
    for volume, name, _ in _volumes(smoke):
        path = relative(take.directory / name.format(now.file_numbers[0]))
        if volume.filepath != path:
            volume.filepath = path
        volume.is_sequence = True
        if volume.velocity_grid != "velocity":  # Blender complains if the default is set again
            volume.velocity_grid = "velocity"
        volume.velocity_unit = "SECOND"
        set_unless_changed(volume, "clipping", volume.render, "clipping", 0.0)
        # the viewport shows the render's optical depth
        set_unless_changed(volume, "density", volume.display, "density", now.scene["medium"]["extinction"])
    _set_time(smoke, now)


def _volumes(smoke: bpy.types.Object) -> list[tuple[bpy.types.Volume, str, int]]:
    """A smoke's Volume and those of its modifiers, with the names of their files and how many frames they are ahead."""
    between = FRAMES_BETWEEN.volume(smoke)
    known = ((smoke.data, FRAME_FILE, 0), (PROXY.volume(smoke), PROXY_FILE, 0), (between, FRAME_FILE, 1))
    return [each for each in known if each[0] is not None]


def _set_time(smoke: bpy.types.Object, now: Snapshot) -> None:
    """Make a smoke, its proxy and what it needs for frames between play when its clip does, at the timing on trial."""
    settings, numbers, ratio = smoke.smokelift, now.file_numbers, _ratio(smoke, now)
    real = _real_time(smoke, now)
    live = settings.directing.live and _direction(now) != "retime" and not _tracked(now)
    steps = ratio if real else 1.0
    speeds = settings.directing.speeds() if live else (1.0,)
    before = frames_before(smoke, shown_take(smoke))
    first = (settings.clip.frame_start if settings.clip else 1) + (round(before * ratio) if real else before)
    set_unless_changed(smoke.data, "start", smoke.data, "frame_start", first)
    start = smoke.data.frame_start
    time = f"(frame-{start}+{EARLY})/{steps:.9g}"
    timing = retiming(len(numbers), speeds, time)
    place = f"min({timing.place},{len(numbers) - 1})"
    fit_interpolation(smoke, settings.between and (real or live))
    for volume, _, ahead in _volumes(smoke):
        volume.frame_start, volume.frame_offset = start, numbers[0] - 1
        volume.sequence_mode = "REPEAT" if _direction(now) == "loop" else "CLIP"
        for name in ("frame_offset", "velocity_scale"):
            volume.driver_remove(name)
        volume.frame_duration = max(1, math.ceil(steps * timing.duration - EARLY))
        volume.velocity_scale = (1.0 if real else ratio) * speeds[0]
        if real or live:
            # Blender shows one file in each frame of the scene; the driven offset selects another
            file = f"min(floor({place})+{ahead},{len(numbers) - 1})" if ahead else f"floor({place})"
            volume.driver_add("frame_offset").driver.expression = f"{file}-(frame-{start})+{numbers[0] - 1}"
        if live and len(speeds) > 1:
            scale = f"{1.0 if real else ratio:.9g}*({timing.speed})"
            volume.driver_add("velocity_scale").driver.expression = scale
    drive_interpolation(smoke, place, 1.0 / now.scene["clip"]["fps"])


def _direction(now: Snapshot) -> str | None:
    """What a take was made by of another, also where its request is missing; None of one of a clip."""
    return now.index.get("settings", {}).get("direct", {}).get("job")


def _ratio(smoke: bpy.types.Object, now: Snapshot) -> float:
    """Frames of the scene in the time of one of the clip."""
    return frame_rate(scene_of(smoke)) / now.scene["clip"]["fps"]


def _tracked(now: Snapshot) -> bool:
    """Whether the smoke keeps step with a moving camera, which has one matrix for each frame of the clip."""
    return "matrices" in now.scene.get("camera", {})


def _real_time(smoke: bpy.types.Object, now: Snapshot) -> bool:
    """Whether frames are left out or repeated so that the smoke is as fast as in reality."""
    same = math.isclose(_ratio(smoke, now), 1.0, rel_tol=1e-3)
    return smoke.smokelift.speed == "REAL" and not _tracked(now) and not same


def _listen(_file: str = "") -> None:
    """Have Blender say when the time or rate of a clip or scene changes; loading a file ends that."""
    unregister()
    clip, render = bpy.types.MovieClip, bpy.types.RenderSettings
    for key in ((clip, "frame_start"), (clip, "frame_offset"), (render, "fps"), (render, "fps_base")):
        bpy.msgbus.subscribe_rna(key=key, owner=_LISTENER, args=(), notify=synchronize_playback)


_LISTENER = object()

HANDLERS = ((bpy.app.handlers.load_post, correct_positions), (bpy.app.handlers.load_post, _listen))


register = _listen


def unregister() -> None:
    bpy.msgbus.clear_by_owner(_LISTENER)
