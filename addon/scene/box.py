"""The box that holds the smoke: the domain and the inlet in a scene file, and the engine's world in Blender's."""

import math
from collections.abc import Sequence
from typing import Any

import bpy
from mathutils import Matrix, Vector

from ..core import ShotError
from ..core.contract import BOX_VOXELS, MIN_VOXELS
from .smoke import scene_of

ROUNDING = 1e-5  # error of Blender's 32-bit places over the box's longest side: a hundred of their steps
BOX_FRACTION = 0.9  # width and height of a new box over those of the picture


def box_of(smoke: bpy.types.Object) -> bpy.types.Object | None:
    """The box that holds the smoke."""
    return in_scene(scene_of(smoke), smoke.smokelift.box)


def in_scene(scene: bpy.types.Scene, obj: bpy.types.Object | None) -> bpy.types.Object | None:
    """The object if the scene holds it. A setting still refers to an object that was deleted."""
    return obj if obj is not None and obj.name in scene.objects else None


def has_inlet(smoke: bpy.types.Object) -> bool:
    """Whether an inlet says where the smoke enters, and so where it stands."""
    settings = smoke.smokelift
    return settings.camera_mode == "SCENE" and in_scene(scene_of(smoke), settings.inlet) is not None


def box_corners(box: bpy.types.Object) -> list[Vector]:
    """The eight corners of a box in the world."""
    return [box.matrix_world @ Vector(corner) for corner in box.bound_box]


def domain_table(box: bpy.types.Object, rotation: Matrix, settings: bpy.types.PropertyGroup) -> dict[str, Any]:
    """The domain: the box in cubic voxels, a multiple of four along each side. It grows and keeps its floor."""
    low, high = sides_of(box, rotation)
    extent = high - low
    if min(extent) <= 1e-6 * max(*extent, 1e-6):
        raise ShotError("The box is flat: give it a width, a depth and a height.")
    voxel = max(extent) / (settings.longest_side or BOX_VOXELS)
    counts = [max(MIN_VOXELS, 4 * math.ceil(length / voxel / 4 - 1e-4)) for length in extent]
    size = [count * voxel for count in counts]
    middle = (low + high) / 2
    start = [middle[0] - size[0] / 2, middle[1] - size[1] / 2, low[2]]
    return {"min": start, "max": [s + length for s, length in zip(start, size, strict=True)], "resolution": counts}


def sides_of(box: bpy.types.Object, rotation: Matrix) -> tuple[Vector, Vector]:
    """The lowest and the highest corner of a box in the engine's world."""
    corners = [rotation.inverted() @ corner for corner in box_corners(box)]
    low = Vector(min(corner[axis] for corner in corners) for axis in range(3))
    return low, Vector(max(corner[axis] for corner in corners) for axis in range(3))


def is_inside(low: Sequence[float], high: Sequence[float], place: Sequence[float], margin: float = 0.0) -> bool:
    """Whether a place is between the corners of a box, and so far from its sides."""
    return all(a + margin <= here <= b - margin for a, here, b in zip(low, place, high, strict=True))


def keep_camera_outside(
    domain: dict[str, Any], camera: dict[str, Any], box: bpy.types.Object, rotation: Matrix
) -> dict[str, Any]:
    """The domain, grown to the side away from a camera that would else stand in what cubes add to the box.

    A camera on a side of the box counts as outside, for Blender rounds its place to 32 bits. ShotError if it stands
    inside the box itself.
    """
    eyes = [Vector(row[3] for row in pose[:3]) for pose in camera.get("matrices") or [camera["matrix"]]]
    if camera["type"] != "perspective" or not any(is_inside(domain["min"], domain["max"], eye) for eye in eyes):
        return domain
    low, high = sides_of(box, rotation)
    rounding = ROUNDING * max(high - low)
    if any(is_inside(low, high, eye, rounding) for eye in eyes):
        raise ShotError("The camera stands inside the smoke's box: move it out, or make the box smaller.")
    start, end = list(domain["min"]), list(domain["max"])
    for axis in (0, 1):  # upwards it grows from its floor
        length = end[axis] - start[axis]
        if all(eye[axis] >= high[axis] - rounding for eye in eyes):
            end[axis] = high[axis] - 2 * rounding
            start[axis] = end[axis] - length
        elif all(eye[axis] <= low[axis] + rounding for eye in eyes):
            start[axis] = low[axis] + 2 * rounding
            end[axis] = start[axis] + length
    return {**domain, "min": start, "max": end}


def inlet_table(inlet: bpy.types.Object, rotation: Matrix, domain: dict[str, Any]) -> dict[str, Any]:
    """A ball, as large as the Empty is drawn."""
    center = rotation.inverted() @ inlet.matrix_world.translation
    radius = inlet.empty_display_size * max(abs(scale) for scale in inlet.matrix_world.to_scale())
    if radius <= 0.0:
        raise ShotError("The inlet has no size: scale up its Empty.")
    sides = zip(domain["min"], center, domain["max"], strict=True)
    if (center - Vector(min(max(place, low), high) for low, place, high in sides)).length > radius:
        raise ShotError("The inlet is outside the box: move it to where the smoke enters.")
    return {"centre": list(center), "radius": radius}


def engine_to_world(smoke: bpy.types.Object) -> Matrix:
    """The matrix (4x4) from the engine's world to Blender's."""
    settings = smoke.smokelift
    box = box_of(smoke) if settings.camera_mode == "SCENE" else None
    return Matrix.Identity(4) if box is None else box.matrix_world.to_quaternion().to_matrix().to_4x4()


def framed_box(scene: bpy.types.Scene) -> tuple[Vector, Vector]:
    """Lowest and highest corner of an upright box that nearly fills the picture at the 3D cursor's depth."""
    camera = scene.camera
    frame = [camera.matrix_world @ corner for corner in camera.data.view_frame(scene=scene)]
    eye = camera.matrix_world.translation
    ahead = -camera.matrix_world.to_3x3().col[2].normalized()
    near = (frame[0] - eye).dot(ahead)
    depth = (scene.cursor.location - eye).dot(ahead)
    if depth < 2 * near:  # the cursor is behind the camera or close to it
        depth = 10 * near
    if camera.data.type == "ORTHO":
        corners = [corner + ahead * (depth - near) for corner in frame]
    else:
        corners = [eye + (corner - eye) * (depth / near) for corner in frame]
    middle = sum(corners, Vector()) / 4
    width = BOX_FRACTION * (corners[0] - corners[3]).length
    height = BOX_FRACTION * (corners[0] - corners[1]).length
    half = Vector((width, min(width, height), height)) / 2
    return middle - half, middle + half


def new_box() -> bpy.types.Object:
    mesh = bpy.data.meshes.new("Smoke Box")
    corners = [(x, y, z) for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)]
    faces = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
    mesh.from_pydata(corners, [], faces)
    box = bpy.data.objects.new("Smoke Box", mesh)
    box.display_type = "WIRE"
    box.hide_render = True
    return box
