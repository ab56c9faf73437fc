"""The floor of a smoke's box as the camera shows it: where a click on it is."""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import bpy
from mathutils import Matrix, Vector

from ..core import ShotError
from .blender import at_frame
from .box import box_of, sides_of
from .camera import camera_table, scene_camera
from .clip import start_frame
from .smoke import scene_of

MAX_PIXEL_DEPTH = 0.08
"""Fraction of the box's depth that a pixel may show where the click still tells more than the box alone, which knows
the depth to 0.165 of its half (docs/experiments/density-axis.md)."""


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
