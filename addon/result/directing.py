"""What an artist does to a smoke after its clip, as the engine's options.

Objects of the scene act on the smoke: meshes are obstacles, a Wind field is wind, a Turbulence field is turbulence,
other Empties are fans. The smoke may have been moved, rotated and scaled, so places and velocities are turned into
those of its own space.
"""

import math
from typing import Any

import bpy
import numpy as np
import numpy.typing as npt
from mathutils import Matrix, Vector

from ..core import ShotError
from ..core.contract import SHORTEST, SIDES
from ..scene import volume
from ..scene.blender import at_frame
from ..scene.smoke import scene_of

BLOWING = ("WIND", "FORCE")  # force fields that blow along their Z axis
UNSIZED = 1.0  # m; what Blender takes for the size of turbulence that has none (by definition)
MESHES = {"MESH", "CURVE", "SURFACE", "FONT", "META"}  # objects that have a surface
STL_HEADER = 80  # bytes before the number of triangles (by definition)


def engine_request(smoke: bpy.types.Object) -> tuple[str, list[str], list[bytes]]:
    """What the engine is asked to do to the take that a smoke shows: its command, its options, and obstacles.

    Those are a binary STL file, one for each frame if they move. ShotError if a setting or an object cannot be used.
    """
    settings, now = smoke.smokelift.directing, volume.shown(smoke)
    if now is None or now.frames < SHORTEST:
        raise ShotError(f"{SHORTEST} frames at least are needed to see how smoke moves: make the result longer first.")
    if settings.direction == "retime":
        return "retime", ["--speed", *map(_number_text, settings.speeds())], []
    if settings.direction == "loop":
        options = ["--overlap", str(settings.overlap)] if settings.overlap else []
        if settings.use_part:
            first, last = (_number_in_take(smoke, frame) for frame in (settings.part_first, settings.part_last))
            if last - first + 1 < SHORTEST:
                raise ShotError(f"A loop needs {SHORTEST} frames at least: choose a later last frame.")
            options = ["--frames", f"{first}:{last}", *options]
        return "loop", options, []
    if settings.fade > settings.frames:
        raise ShotError(
            f"The smoke fades in {settings.fade} frames, more than are added ({settings.frames}): shorten the fade."
        )
    options = ["--frames", str(settings.frames), "--fade", str(settings.fade), "--room", _number_text(settings.room)]
    for name in ("buoyancy", "dissipation"):
        if getattr(settings, f"use_{name}"):
            options += [f"--{name}", _number_text(getattr(settings, name))]
    last = now.numbers[-1]
    if settings.use_start:
        last = _number_in_take(smoke, settings.start)
        if last < now.numbers[SHORTEST - 1]:
            raise ShotError(f"{SHORTEST} frames are needed before the smoke reacts: choose a later frame.")
        options += ["--start", str(last)]
    if settings.closed:
        options += ["--closed", *(side for side in SIDES if side in settings.closed)]
    later = [volume.scene_frame(smoke, last + step) for step in range(1, settings.frames + 1)]
    with at_frame(scene_of(smoke), volume.scene_frame(smoke, last)) as depsgraph:
        options += _air_options(smoke, depsgraph)
        return "continue", options, _obstacles(smoke, depsgraph, later)


def frames_of_result(smoke: bpy.types.Object) -> tuple[int, int] | None:
    """The first and the last frame of the result on show, counted as those of the clip; None without one."""
    now = volume.shown(smoke)
    if now is None:
        return None
    before = volume.frames_before(smoke, volume.shown_take(smoke))
    return before + now.numbers[0], before + now.numbers[-1]


def _number_in_take(smoke: bpy.types.Object, frame: int) -> int:
    """The number in the take on show of a frame that is counted as those of the clip."""
    first, last = frames_of_result(smoke)
    if not first <= frame <= last:
        raise ShotError(f"The result has no frame {frame}: choose one from {first} to {last}.")
    return frame - volume.frames_before(smoke, volume.shown_take(smoke))


def _air_options(smoke: bpy.types.Object, depsgraph: bpy.types.Depsgraph) -> list[str]:
    settings = smoke.smokelift.directing
    to_smoke = _world_to_smoke(smoke.evaluated_get(depsgraph))
    scale = abs(to_smoke.to_3x3().determinant()) ** (1 / 3)
    wind, local = Vector(), []
    for obj in _effectors(smoke):
        seen = obj.evaluated_get(depsgraph)
        field, kind = seen.field, _kind(seen)
        if kind not in ("NONE", *BLOWING, "TURBULENCE"):
            raise ShotError(
                f"The force field of {obj.name} cannot be used: only Wind, Force and Turbulence move smoke."
            )
        matrix = seen.matrix_world
        ahead = to_smoke.to_3x3() @ matrix.to_3x3().col[2].normalized()
        if kind == "TURBULENCE":
            if field.use_max_distance:
                raise ShotError(f"Turbulence is everywhere: switch off Max Distance of {obj.name}.")
            size = field.size or UNSIZED
            local += ["--turbulence", *map(_number_text, (abs(field.strength) * scale, size * scale, field.seed))]
        elif kind == "WIND" and not field.use_max_distance:
            wind += field.strength * ahead
        elif kind != "NONE" or obj.type == "EMPTY":
            if kind != "NONE" and field.use_max_distance:
                radius = field.distance_max
            else:
                radius = obj.empty_display_size * abs(matrix.to_3x3().determinant()) ** (1 / 3)
            velocity = (settings.fan_speed if kind == "NONE" else field.strength) * ahead
            local += ["--fan", *map(_number_text, (*(to_smoke @ matrix.translation), radius * scale, *velocity))]
    return (["--wind", *map(_number_text, wind)] if wind.length > 0.0 else []) + local


def _obstacles(smoke: bpy.types.Object, depsgraph: bpy.types.Depsgraph, later: list[int]) -> list[bytes]:
    """The meshes as a binary STL file, and as one more for each later frame of the scene as long as they move."""
    meshes = [obj for obj in _effectors(smoke) if obj.type in MESHES and _kind(obj.evaluated_get(depsgraph)) == "NONE"]

    def current_stl() -> bytes:
        to_smoke = _world_to_smoke(smoke.evaluated_get(depsgraph))
        seen = [obj.evaluated_get(depsgraph) for obj in meshes]
        return _stl([_triangles(obj, to_smoke @ obj.matrix_world) for obj in seen])

    files = [current_stl()]
    if not files[0]:
        return []
    for frame in later:
        scene_of(smoke).frame_set(frame)
        content = current_stl()
        if len(content) != len(files[0]):
            raise ShotError(
                f"The obstacles change their number of triangles in frame {frame}, and a moving mesh has to keep it: "
                "switch off the modifiers that change it."
            )
        files.append(content)
    while len(files) > 1 and files[-1] == files[-2]:
        files.pop()
    return files


def _effectors(smoke: bpy.types.Object) -> list[bpy.types.Object]:
    collection, own = smoke.smokelift.directing.effectors, (smoke, smoke.smokelift.box)
    return [obj for obj in collection.all_objects if obj not in own and not obj.hide_viewport] if collection else []


def _kind(obj: bpy.types.Object) -> str:
    """The force field of an object, or NONE."""
    return "NONE" if obj.field is None else obj.field.type


def _world_to_smoke(smoke: bpy.types.Object) -> Matrix:
    """Transform from the world to the smoke's own space, without what its position corrects for Cycles."""
    basis = smoke.matrix_basis  # with the correction
    return (smoke.matrix_world @ basis.inverted() @ Matrix.Translation(-smoke.delta_location) @ basis).inverted()


def _triangles(obj: bpy.types.Object, matrix: Matrix) -> npt.NDArray[np.float64]:
    """The triangles (n, 3, 3) of an evaluated object, turned outwards if it is closed."""
    mesh = obj.to_mesh()
    if mesh is None:
        return np.empty((0, 3, 3))
    try:
        mesh.calc_loop_triangles()
        places = np.empty(3 * len(mesh.vertices), np.float32)
        mesh.vertices.foreach_get("co", places)
        corners = np.empty(3 * len(mesh.loop_triangles), np.int32)
        mesh.loop_triangles.foreach_get("vertices", corners)
    finally:
        obj.to_mesh_clear()
    whole = np.array(matrix)
    moved = places.reshape(-1, 3) @ whole[:3, :3].T + whole[:3, 3]
    triangles = moved[corners].reshape(-1, 3, 3)
    if len(triangles) and np.linalg.matrix_rank(moved - moved.mean(0), tol=1e-6 * np.ptp(moved)) < 3:
        raise ShotError(f"{obj.name} is flat and encloses nothing: give it a thickness (Solidify).")
    # six times the signed volume that a closed surface encloses
    inward = np.einsum("ni,ni", triangles[:, 0], np.cross(triangles[:, 1], triangles[:, 2])) < 0
    return triangles[:, ::-1] if inward else triangles


def _stl(parts: list[npt.NDArray[np.float64]]) -> bytes:
    """A binary STL file; nothing without triangles."""
    triangles = np.concatenate(parts) if parts else np.empty((0, 3, 3))
    if not len(triangles):
        return b""
    kind: Any = [("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("attribute", "<u2")]
    records = np.zeros(len(triangles), kind)
    records["corners"] = triangles
    return bytes(STL_HEADER) + len(records).to_bytes(4, "little") + records.tobytes()


def _number_text(value: float) -> str:
    """A number as the engine's command line reads it, which takes ``-1e-05`` for an option."""
    if not math.isfinite(value):
        raise ShotError("A place or a speed is not finite: check the scale of the smoke and of its effectors.")
    return f"{value:.6f}"
