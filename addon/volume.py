"""The result: a Volume object that plays the sequence, with a material of the smoke's optical properties."""

import math
from collections.abc import Iterator
from typing import Any

import bpy
from bpy.app.handlers import persistent
from mathutils import Vector

from .contract import FRAME_FILE, MADE_UP
from .kept import set_unless_changed
from .look import fit_look
from .paths import absolute, relative
from .scene_file import engine_to_world, frame_rate
from .smoke import scene_of, smokes
from .take import Take

PROVENANCE = "smokelift_provenance"
"""Custom property of the Volume that says what of the smoke is measured, also where its files are not at hand."""


def show(smoke: bpy.types.Object, take: Take) -> bpy.types.Object | None:
    """Show a take's finished frames in a smoke. What the artist changed of its place and material stays.

    Returns
    -------
    The smoke, or None while no frame is finished.
    """
    index = take.index()
    if not index or not index["frames"]:
        return None
    if shown_take(smoke) != take:
        smoke.delta_location = (0.0, 0.0, 0.0)
        set_unless_changed(smoke, "place", smoke, "matrix_basis", engine_to_world(smoke))
    _correct_position(smoke, index["scene"]["domain"])
    _set_file(smoke.data, take, index)
    _set_time(smoke, scene_of(smoke), index)
    fit_look(smoke.data, index["scene"])
    smoke.data[PROVENANCE] = _provenance(index.get("provenance", []))
    return smoke


def shown_take(smoke: bpy.types.Object) -> Take | None:
    """The take that a smoke shows."""
    return take_of(smoke.data)


def take_of(volume: bpy.types.Volume) -> Take | None:
    """The take that a Volume plays; None for one without a file, whose empty path saving turns into ``//``."""
    path = absolute(volume.filepath, volume.library)
    return Take(path.parent) if path.suffix == ".vdb" else None


def provenance_note(smoke: bpy.types.Object) -> str:
    """What of a smoke is measured and what is not, as a line for the panel; empty if that is unknown."""
    return smoke.data.get(PROVENANCE, "")


def _provenance(parts: list[dict[str, Any]]) -> str:
    if not parts:  # the engine of earlier versions did not say
        return ""
    for part in parts:
        if part["origin"] == MADE_UP:
            detail, seed = part["settings"]["detail"], part["settings"]["seed"]
            return f"The camera's view is measured. Depth detail {detail:.2g} is made up: variation {seed}."
    return "The camera's view is measured. Nothing is made up: the depth is smooth."


@persistent
def correct_positions(_file: str = "") -> None:
    """Correct all smokes, since another version of Blender may have saved the file."""
    for _, smoke, index in _shown():
        _correct_position(smoke, index["scene"]["domain"])


def _shown() -> Iterator[tuple[bpy.types.Scene, bpy.types.Object, dict[str, Any]]]:
    """Every smoke of every scene whose take has finished frames, with its `sequence.json`."""
    for scene in bpy.data.scenes:
        for smoke in smokes(scene):
            take = shown_take(smoke)
            index = take.index() if take is not None else None
            if index and index["frames"]:
                yield scene, smoke, index


def _correct_position(obj: bpy.types.Object, domain: dict[str, Any]) -> None:
    """Compensate for Cycles, which before 5.0 renders every grid half a voxel too far along all its axes."""
    voxel = (domain["max"][0] - domain["min"][0]) / domain["resolution"][0]
    shift = Vector([-voxel / 2] * 3) if bpy.app.version < (5, 0, 0) else Vector()
    obj.delta_location = obj.matrix_basis.to_quaternion() @ shift


def keep_step() -> None:
    """Play all smokes in step with their clips, after a clip or a scene got another time or rate."""
    for scene, smoke, index in _shown():
        _set_time(smoke, scene, index)


def _numbers(index: dict[str, Any]) -> list[int]:
    return sorted(int(number) for number in index["frames"])


def _set_file(volume: bpy.types.Volume, take: Take, index: dict[str, Any]) -> None:
    """Make a Volume read the take's files."""
    path = relative(take.directory / FRAME_FILE.format(_numbers(index)[0]))
    if volume.filepath != path:
        volume.filepath = path
    volume.is_sequence = True
    volume.sequence_mode = "CLIP"
    if volume.velocity_grid != "velocity":  # Blender complains if the default is set again
        volume.velocity_grid = "velocity"
    volume.velocity_unit = "SECOND"
    set_unless_changed(volume, "clipping", volume.render, "clipping", 0.0)
    # the viewport shows the render's optical depth
    set_unless_changed(volume, "density", volume.display, "density", index["scene"]["medium"]["extinction"])


def _set_time(smoke: bpy.types.Object, scene: bpy.types.Scene, index: dict[str, Any]) -> None:
    """Make a smoke play when its clip does."""
    volume, settings = smoke.data, smoke.smokelift
    numbers = _numbers(index)
    clip_rate, scene_rate = index["scene"]["clip"]["fps"], frame_rate(scene)
    ratio = scene_rate / clip_rate
    # the smoke keeps step with a moving camera, which has one matrix for each frame of the clip
    tracked = "matrices" in index["scene"].get("camera", {})
    real = settings.speed == "REAL" and not tracked and not math.isclose(ratio, 1.0, rel_tol=1e-3)
    clip = settings.clip
    before = _frames_before(settings, index)
    start = (clip.frame_start if clip else 1) + (round(before * ratio) if real else before)
    set_unless_changed(volume, "start", volume, "frame_start", start)
    volume.frame_offset = numbers[0] - 1
    volume.frame_duration = math.ceil(len(numbers) * ratio) if real else len(numbers)
    volume.driver_remove("frame_offset")
    if real:
        # Blender shows one file in each frame of the scene; the driven offset selects another
        driver = volume.driver_add("frame_offset").driver
        driver.type = "SCRIPTED"
        start = volume.frame_start
        driver.expression = f"floor((frame - {start} + 0.001) / {ratio:.9g}) - (frame - {start}) + {numbers[0] - 1}"
    volume.velocity_scale = 1.0 if real else ratio


def _frames_before(settings: bpy.types.PropertyGroup, index: dict[str, Any]) -> int:
    """Number of the clip's frames before the take's first, which settings for the next take do not change."""
    frames = index["scene"]["clip"].get("frames")
    return settings.first - 1 if frames is None or settings.clip is None else frames[0] - settings.clip.frame_offset


@persistent
def _listen(_file: str = "") -> None:
    """Have Blender say when the time or rate of a clip or scene changes; loading a file ends that."""
    bpy.msgbus.clear_by_owner(_LISTENER)
    for owner, name in _TIMES:
        key = (getattr(bpy.types, owner), name)
        bpy.msgbus.subscribe_rna(key=key, owner=_LISTENER, args=(), notify=keep_step)


_LISTENER = object()
_TIMES = (
    ("MovieClip", "frame_start"),
    ("MovieClip", "frame_offset"),
    ("RenderSettings", "fps"),
    ("RenderSettings", "fps_base"),
)
_HANDLERS = (correct_positions, _listen)


def register() -> None:
    bpy.app.handlers.load_post.extend(_HANDLERS)
    _listen()


def unregister() -> None:
    bpy.msgbus.clear_by_owner(_LISTENER)
    for handler in _HANDLERS:
        bpy.app.handlers.load_post.remove(handler)
