"""The camera: its table in a scene file, in every frame if it moves, and the floor of the box as it shows that."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import bpy
from bpy_extras.object_utils import world_to_camera_view
from mathutils import Matrix, Vector

from ..core import ShotError
from .blender import at_frame
from .box import box_of, sides_of
from .clip import start_frame
from .smoke import scene_of

LENS = ("fx", "fy", "cx", "cy")  # numbers of a camera's table that say its lens
CAMERA_SAMPLES = 9  # frames that decide whether the camera moves

MAX_PIXEL_DEPTH = 0.08
"""Fraction of the box's depth that a pixel may show where the click still tells more than the box alone, which knows
the depth to 0.165 of its half (docs/experiments/density-axis.md)."""


def camera_table(
    smoke: bpy.types.Object, camera: bpy.types.Object, depsgraph: bpy.types.Depsgraph, rotation: Matrix
) -> dict[str, Any]:
    """The camera as a pinhole (or orthographic) camera of the clip's size, as it is evaluated in a frame.

    The rotation (3x3) is from the engine's axes to Blender's.
    """
    width, height = smoke.smokelift.clip.size
    render = scene_of(smoke).render
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


def scene_camera(scene: bpy.types.Scene, depsgraph: bpy.types.Depsgraph) -> bpy.types.Object:
    """The scene's camera as it is evaluated; ShotError if there is none."""
    if scene.camera is None:
        raise ShotError(
            "The scene has no camera: add one where the clip was filmed from, or choose Camera From the Clip."
        )
    return scene.camera.evaluated_get(depsgraph)


def camera_over_frames(smoke: bpy.types.Object, rotation: Matrix, corners: list[Vector], quick: bool) -> dict[str, Any]:
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
            camera = scene_camera(scene, depsgraph)
            samples.append((camera_table(smoke, camera, depsgraph, rotation), _in_picture(scene, camera, corners)))
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
            pose = Matrix(camera_table(smoke, scene_camera(scene, depsgraph), depsgraph, rotation)["matrix"])
        up, back = Vector((0.0, 0.0, 1.0)), pose.col[2].to_3d()
        if abs(back.z) > math.sqrt(0.5):  # as the engine takes a camera that looks steeply up or down
            up = pose.col[1].to_3d()
        along = (back.dot(up) * up - back).normalized()
        return cls(rotation, *sides_of(box, rotation), pose.translation, along)

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
