"""Where the smoke is and where it was filmed from, in the engine's axes: the box, its floor, inlet and camera."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import bpy
from bpy_extras.object_utils import world_to_camera_view
from mathutils import Matrix, Vector

from ..core import ShotError
from ..core.contract import BOX_VOXELS, MIN_VOXELS
from .blender import at_frame
from .clip import start_frame
from .smoke import scene_of

ROUNDING = 1e-5  # error of Blender's 32-bit places over the box's longest side: a hundred of their steps
BOX_FRACTION = 0.9  # width and height of a new box over those of the picture

LENS = ("fx", "fy", "cx", "cy")  # numbers of a camera's table that say its lens
CAMERA_SAMPLES = 9  # frames that decide whether the camera moves

MAX_PIXEL_DEPTH = 0.08
"""Fraction of the box's depth that a pixel may show where the click still tells more than the box alone, which knows
the depth to 0.165 of its half (docs/experiments/density-axis.md)."""


def box_of(smoke: bpy.types.Object) -> bpy.types.Object | None:
    return _in_scene(scene_of(smoke), smoke.smokelift.box)


def _in_scene(scene: bpy.types.Scene, obj: bpy.types.Object | None) -> bpy.types.Object | None:
    """The object if the scene holds it. A setting still refers to an object that was deleted."""
    return obj if obj is not None and obj.name in scene.objects else None


def has_inlet(smoke: bpy.types.Object) -> bool:
    """Whether an inlet says where the smoke enters, and so where it stands."""
    settings = smoke.smokelift
    return settings.camera_mode == "SCENE" and _in_scene(scene_of(smoke), settings.inlet) is not None


def box_corners(box: bpy.types.Object) -> list[Vector]:
    return [box.matrix_world @ Vector(corner) for corner in box.bound_box]


def geometry_tables(smoke: bpy.types.Object, depsgraph: bpy.types.Depsgraph, quick: bool) -> dict[str, Any]:
    """The tables of box, camera and inlet where these are the scene's, which is evaluated in a frame; else none.

    ``quick`` reads the camera in the current frame only. ShotError if something is missing or unusable.
    """
    settings, box = smoke.smokelift, box_of(smoke)
    if settings.camera_mode != "SCENE":
        return {}
    if box is None:
        raise ShotError("The smoke has no box: press Make Box, and move it so that it holds the smoke.")
    rotation = box.matrix_world.to_quaternion().to_matrix()
    tables: dict[str, Any] = {"domain": _domain_table(box, rotation, settings)}
    tables["camera"] = _camera_in_frames(smoke, rotation, box_corners(box), quick)
    tables["domain"] = _keep_camera_outside(tables["domain"], tables["camera"], box, rotation)
    inlet = _in_scene(scene_of(smoke), settings.inlet)
    if inlet is not None:
        tables["inlet"] = [_inlet_table(inlet.evaluated_get(depsgraph), rotation, tables["domain"])]
    return tables


def _domain_table(box: bpy.types.Object, rotation: Matrix, settings: bpy.types.PropertyGroup) -> dict[str, Any]:
    """The domain: the box in cubic voxels, a multiple of four along each side. It grows and keeps its floor."""
    low, high = _sides_of(box, rotation)
    extent = high - low
    if min(extent) <= 1e-6 * max(*extent, 1e-6):
        raise ShotError("The box is flat: give it a width, a depth and a height.")
    voxel = max(extent) / (settings.longest_side or BOX_VOXELS)
    counts = [max(MIN_VOXELS, 4 * math.ceil(length / voxel / 4 - 1e-4)) for length in extent]
    size = [count * voxel for count in counts]
    middle = (low + high) / 2
    start = [middle[0] - size[0] / 2, middle[1] - size[1] / 2, low[2]]
    return {"min": start, "max": [s + length for s, length in zip(start, size, strict=True)], "resolution": counts}


def _sides_of(box: bpy.types.Object, rotation: Matrix) -> tuple[Vector, Vector]:
    """The lowest and the highest corner of a box in the engine's world."""
    corners = [rotation.inverted() @ corner for corner in box_corners(box)]
    low = Vector(min(corner[axis] for corner in corners) for axis in range(3))
    return low, Vector(max(corner[axis] for corner in corners) for axis in range(3))


def is_inside(low: Sequence[float], high: Sequence[float], place: Sequence[float], margin: float = 0.0) -> bool:
    """Whether a place is between the corners of a box, and so far from its sides."""
    return all(a + margin <= here <= b - margin for a, here, b in zip(low, place, high, strict=True))


def _keep_camera_outside(
    domain: dict[str, Any], camera: dict[str, Any], box: bpy.types.Object, rotation: Matrix
) -> dict[str, Any]:
    """The domain, grown to the side away from a camera that would else stand in what cubes add to the box.

    A camera on a side of the box counts as outside, for Blender rounds its place to 32 bits. ShotError if it stands
    inside the box itself.
    """
    eyes = [Vector(row[3] for row in pose[:3]) for pose in camera.get("matrices") or [camera["matrix"]]]
    if camera["type"] != "perspective" or not any(is_inside(domain["min"], domain["max"], eye) for eye in eyes):
        return domain
    low, high = _sides_of(box, rotation)
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


def _inlet_table(inlet: bpy.types.Object, rotation: Matrix, domain: dict[str, Any]) -> dict[str, Any]:
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


def _camera_table(smoke: bpy.types.Object, depsgraph: bpy.types.Depsgraph, rotation: Matrix) -> dict[str, Any]:
    """The scene's camera, evaluated, at the clip's size; the rotation (3x3) is from the engine's axes to Blender's."""
    (width, height), scene = smoke.smokelift.clip.size, scene_of(smoke)
    if scene.camera is None:
        raise ShotError(
            "The scene has no camera: add one where the clip was filmed from, or choose Camera From the Clip."
        )
    camera, render = scene.camera.evaluated_get(depsgraph), scene.render
    if camera.data.type not in ("PERSP", "ORTHO"):
        raise ShotError("The camera is panoramic: choose Perspective or Orthographic in its lens settings.")
    if not math.isclose(render.resolution_x * height, render.resolution_y * width, rel_tol=0.005):
        raise ShotError(
            f"The render size {render.resolution_x} x {render.resolution_y} has another shape than the clip, "
            f"{width} x {height}: press Match Scene to Clip, or set it in the output settings."
        )
    axes = camera.matrix_world.to_3x3().normalized()
    skew = max(abs(axes.col[i].dot(axes.col[j])) for i, j in ((0, 1), (0, 2), (1, 2)))
    if skew > 1e-4 or axes.determinant() < 0.0:
        raise ShotError("The camera is skewed or mirrored by the scale of its parents: apply their scale.")
    pose = rotation.to_4x4().inverted() @ Matrix.Translation(camera.matrix_world.translation) @ axes.to_4x4()
    # Blender's projection matrix holds sensor fit, shift and pixel aspect; it maps the image's edges to -1 and 1.
    lens = camera.calc_matrix_camera(
        depsgraph, x=width, y=height, scale_x=render.pixel_aspect_x, scale_y=render.pixel_aspect_y
    )
    perspective = camera.data.type == "PERSP"
    off_x, off_y = (-lens[0][2], -lens[1][2]) if perspective else (lens[0][3], lens[1][3])
    return {
        "type": "perspective" if perspective else "orthographic",
        "matrix": [list(row) for row in pose],
        "fx": lens[0][0] * width / 2,
        "fy": lens[1][1] * height / 2,
        "cx": (1 + off_x) * width / 2,
        "cy": (1 - off_y) * height / 2,
        "size": [width, height],
    }


def _camera_in_frames(smoke: bpy.types.Object, rotation: Matrix, corners: list[Vector], quick: bool) -> dict[str, Any]:
    """The camera's table: one matrix, or one for every used frame if the camera moves.

    Each frame costs an evaluation of the whole scene, so a few frames decide whether the camera moves; ``quick`` reads
    the current one only. The corners are those of the box, in Blender's world.
    """
    settings, scene = smoke.smokelift, scene_of(smoke)
    start, length = start_frame(settings), settings.last - settings.first
    frames = [start + round(step * length / (CAMERA_SAMPLES - 1)) for step in range(CAMERA_SAMPLES)]
    samples = _sample_camera(smoke, [scene.frame_current] if quick else sorted(set(frames)), rotation, corners)
    first = samples[0][0]
    size = max((a - b).length for a in corners for b in corners)
    moves = any(_moved(table["matrix"], first["matrix"], size) for table, _ in samples)
    if moves:
        samples = _sample_camera(smoke, list(range(start, start + length + 1)), rotation, corners)
    if any(abs(table[key] - first[key]) > 1e-4 * max(table["size"]) for table, _ in samples for key in LENS):
        raise ShotError(
            "The camera zooms during the clip, and only footage with one focal length can be used: choose frames in "
            "which its lens does not change."
        )
    if not any(visible for _, visible in samples):
        raise ShotError("The box is not in the camera's picture: move it there, or press Frame Box.")
    if not moves:
        return first
    matrices = [table["matrix"] for table, _ in samples]
    return {**{key: value for key, value in first.items() if key != "matrix"}, "matrices": matrices}


def _sample_camera(
    smoke: bpy.types.Object, frames: list[int], rotation: Matrix, corners: list[Vector]
) -> list[tuple[dict[str, Any], bool]]:
    """The camera's table in each frame, and whether the box is in its picture."""
    samples, scene = [], scene_of(smoke)
    with at_frame(scene, frames[0]) as depsgraph:
        for frame in frames:
            if frame != scene.frame_current:
                scene.frame_set(frame)
            table, camera = _camera_table(smoke, depsgraph, rotation), scene.camera.evaluated_get(depsgraph)
            samples.append((table, _in_picture(scene, camera, corners)))
    return samples


def _moved(pose: list[list[float]], before: list[list[float]], size: float) -> bool:
    """Whether the camera moved by 0.1% of the box's size, or rotated by 0.001 rad."""
    matrix, other = Matrix(pose), Matrix(before)
    shifted = (matrix.translation - other.translation).length > 1e-3 * size
    return shifted or matrix.to_quaternion().rotation_difference(other.to_quaternion()).angle > 1e-3


def _in_picture(scene: bpy.types.Scene, camera: bpy.types.Object, corners: list[Vector]) -> bool:
    """False for a box that lies wholly outside the picture or behind the camera."""
    points = [world_to_camera_view(scene, camera, corner) for corner in corners]
    outside = any(all(p[axis] < 0.0 for p in points) or all(p[axis] > 1.0 for p in points) for axis in (0, 1))
    return any(p.z > 0.0 for p in points) and not (outside and all(p.z > 0.0 for p in points))


@dataclass(frozen=True)
class Floor:
    """The floor of a smoke's box before the camera, in the engine's axes: those of the box."""

    rotation: Matrix  # from the engine's axes to Blender's (3x3)
    low: Vector  # corner of the box
    high: Vector
    eye: Vector  # where the camera stands in the first frame
    along: Vector  # level direction in which it looks

    @classmethod
    def of(cls, smoke: bpy.types.Object) -> "Floor":
        """The floor of a smoke that has a box; ShotError if the camera cannot be used."""
        box, scene = box_of(smoke), scene_of(smoke)
        rotation = box.matrix_world.to_quaternion().to_matrix()
        with at_frame(scene, start_frame(smoke.smokelift)) as depsgraph:
            pose = Matrix(_camera_table(smoke, depsgraph, rotation)["matrix"])
        up, back = Vector((0.0, 0.0, 1.0)), pose.col[2].to_3d()
        if abs(back.z) > math.sqrt(0.5):  # as the engine takes a camera that looks steeply up or down
            up = pose.col[1].to_3d()
        along = (back.dot(up) * up - back).normalized()
        return cls(rotation, *_sides_of(box, rotation), pose.translation, along)

    def clicked(self, rays: Sequence[tuple[Vector, Vector]]) -> float:
        """The level distance, straight ahead, of where the first of two rays of neighboring pixels meets the floor.

        ShotError if that is nowhere, outside the box, or so flat that a pixel more is much nearer.
        """
        places, to_engine = [], self.rotation.inverted()
        for origin, direction in rays:
            start, way = to_engine @ origin, to_engine @ direction
            steps = (self.low.z - start.z) / way.z if way.z else -1.0
            if steps <= 0.0:
                raise ShotError("The floor of the box is not seen there: click lower, right below the smoke.")
            places.append(start + steps * way)
        if not all(self.low[axis] <= places[0][axis] <= self.high[axis] for axis in (0, 1)):
            raise ShotError("That is outside the box: click in the box, or move the box so that it holds the smoke.")
        distance, beside = ((place - self.eye).dot(self.along) for place in places)
        depth = sum(abs(self.along[axis]) * (self.high[axis] - self.low[axis]) for axis in range(3))
        if abs(beside - distance) > MAX_PIXEL_DEPTH * depth:
            raise ShotError("The camera is too near to the floor to show depth there: enter the Distance by hand.")
        return distance
