"""The button that asks where the smoke stands: a click on the floor in the picture gives its distance."""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import bpy
from bpy.app.translations import pgettext_rpt as rpt_
from bpy_extras import view3d_utils
from mathutils import Matrix, Vector

from . import shot_check
from .blender_scene import ShotError, at_frame
from .box_table import box_of, sides_of
from .camera_table import camera_table, scene_camera
from .clip_table import start_frame
from .needs import NeedsClip
from .shot_setup import show_clip_behind
from .smoke import active_smoke, scene_of

COARSEST = 0.08
"""Share of the box's depth that a pixel may show where the click still tells more than the box alone, which knows the
depth to 0.165 of its half (docs/experiments/density-axis.md)."""


@dataclass(frozen=True)
class Floor:
    """The floor of a smoke's box before the camera, in the engine's axes: those of the box.

    Attributes
    ----------
    rotation
        From the engine's axes to Blender's (3x3).
    low, high
        Corners of the box.
    eye, along
        Where the camera stands in the first frame, and the level direction in which it looks.
    """

    rotation: Matrix
    low: Vector
    high: Vector
    eye: Vector
    along: Vector

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

    def place(self, origin: Vector, direction: Vector) -> Vector:
        """Where a ray in Blender's world meets the floor, in the engine's axes; ShotError if it does not."""
        start, way = self.rotation.inverted() @ origin, self.rotation.inverted() @ direction
        steps = (self.low.z - start.z) / way.z if way.z else -1.0
        if steps <= 0.0:
            raise ShotError("The floor of the box is not seen there: click lower, right below the smoke.")
        return start + steps * way

    def distance(self, place: Vector) -> float:
        """Level distance of a place from the camera, straight ahead."""
        return (place - self.eye).dot(self.along)

    def clicked(self, rays: Sequence[tuple[Vector, Vector]]) -> float:
        """The distance of where the first of two rays, of neighboring pixels, meets the floor.

        Raises
        ------
        ShotError
            If that is outside the box, or so flat that a pixel more is much nearer.
        """
        place, beside = (self.place(*ray) for ray in rays)
        if not all(self.low[axis] <= place[axis] <= self.high[axis] for axis in (0, 1)):
            raise ShotError("That is outside the box: click in the box, or move the box so that it holds the smoke.")
        depth = sum(abs(self.along[axis]) * (self.high[axis] - self.low[axis]) for axis in range(3))
        if abs(self.distance(beside) - self.distance(place)) > COARSEST * depth:
            raise ShotError("The camera is too near to the floor to show depth there: enter the Distance by hand.")
        return self.distance(place)


class SMOKELIFT_OT_place(NeedsClip, bpy.types.Operator):
    """Click in the camera's picture on the floor of the box, right below the smoke: that gives its distance"""

    bl_idname = "smokelift.place"
    bl_label = "Click Where the Smoke Stands"
    bl_options = {"UNDO"}

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        if not super().poll(context):
            return False
        smoke = active_smoke(context.scene)
        if smoke.smokelift.camera_mode != "SCENE" or box_of(smoke) is None:
            cls.poll_message_set("Choose Scene Camera and make a Box first: its bottom is the floor")
            return False
        if context.area is None or context.area.type != "VIEW_3D":
            cls.poll_message_set("Use the tab in a 3D View: the click is made there")
            return False
        return True

    def invoke(self, context: bpy.types.Context, _event: bpy.types.Event) -> set[str]:
        smoke = active_smoke(context.scene)
        try:
            self._floor = Floor.of(smoke)
        except ShotError as error:
            self.report({"ERROR"}, str(error))
            return {"CANCELLED"}
        show_clip_behind(context.scene.camera.data, smoke.smokelift.clip)
        self._view = context.space_data.region_3d
        self._before = self._view.view_perspective
        self._view.view_perspective = "CAMERA"
        context.window.cursor_modal_set("EYEDROPPER")
        context.window_manager.modal_handler_add(self)
        return {"RUNNING_MODAL"}

    def modal(self, context: bpy.types.Context, event: bpy.types.Event) -> set[str]:
        if event.type in ("ESC", "RIGHTMOUSE"):
            self._view.view_perspective = self._before
            return self._end(context, {"CANCELLED"})
        if event.type == "MOUSEMOVE":
            context.workspace.status_text_set(self._said(context, event))
            return {"RUNNING_MODAL"}
        if event.type != "LEFTMOUSE" or event.value != "PRESS":
            return {"PASS_THROUGH"}  # so that the view can be zoomed
        try:
            active_smoke(context.scene).smokelift.distance = self._distance(context, event)
        except ShotError as error:
            self.report({"ERROR"}, str(error))
            return self._end(context, {"CANCELLED"})
        return self._end(context, {"FINISHED"})

    def _said(self, context: bpy.types.Context, event: bpy.types.Event) -> str:
        """What a click would mean there, for the status bar."""
        try:
            return rpt_("Distance: {:.3g} m").format(self._distance(context, event))
        except ShotError as error:
            return str(error)

    def _distance(self, context: bpy.types.Context, event: bpy.types.Event) -> float:
        """The distance of what is under the mouse; ShotError if that is not known."""
        region = next(region for region in context.area.regions if region.type == "WINDOW")
        x, y = event.mouse_x - region.x, event.mouse_y - region.y
        return self._floor.clicked([_ray(region, self._view, (x, y)), _ray(region, self._view, (x, y - 1))])

    def _end(self, context: bpy.types.Context, outcome: set[str]) -> set[str]:
        context.window.cursor_modal_restore()
        context.workspace.status_text_set(None)
        shot_check.check_again(context)
        return outcome


def _ray(region: bpy.types.Region, view: bpy.types.RegionView3D, pixel: tuple[int, int]) -> tuple[Vector, Vector]:
    """Origin and direction of what a pixel of a view shows."""
    return (
        view3d_utils.region_2d_to_origin_3d(region, view, pixel),
        view3d_utils.region_2d_to_vector_3d(region, view, pixel),
    )


register, unregister = bpy.utils.register_classes_factory((SMOKELIFT_OT_place,))
