"""The button that fits the smoke's box to the camera's picture."""

import bpy
from mathutils import Vector

from . import shot_check
from .box_table import box_of
from .smoke import active_smoke

BOX_SHARE = 0.9
"""Width and height of a new box over those of the picture."""


class SMOKELIFT_OT_make_box(bpy.types.Operator):
    """Fit the box to the camera's picture at the distance of the 3D cursor; make one if there is none"""

    bl_idname = "smokelift.make_box"
    bl_label = "Frame Box"
    bl_options = {"REGISTER", "UNDO"}

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        if active_smoke(context.scene) is None:
            cls.poll_message_set("Add smoke first")
            return False
        if context.scene.camera is None:
            cls.poll_message_set("The scene has no camera: add one where the clip was filmed from")
            return False
        return True

    def execute(self, context: bpy.types.Context) -> set[str]:
        scene, smoke = context.scene, active_smoke(context.scene)
        low, high = framed_box(scene)
        box = box_of(smoke)
        if box is None:
            box = _new_box()
            scene.collection.objects.link(box)
            smoke.smokelift.box = box
        box.parent = None
        box.rotation_euler = (0.0, 0.0, 0.0)
        box.location = (low + high) / 2
        box.scale = (high - low) / 2
        shot_check.check_again(context)
        return {"FINISHED"}


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
    width = BOX_SHARE * (corners[0] - corners[3]).length
    height = BOX_SHARE * (corners[0] - corners[1]).length
    half = Vector((width, min(width, height), height)) / 2
    return middle - half, middle + half


def _new_box() -> bpy.types.Object:
    mesh = bpy.data.meshes.new("Smoke Box")
    corners = [(x, y, z) for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)]
    faces = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
    mesh.from_pydata(corners, [], faces)
    box = bpy.data.objects.new("Smoke Box", mesh)
    box.display_type = "WIRE"
    box.hide_render = True
    return box


register, unregister = bpy.utils.register_classes_factory((SMOKELIFT_OT_make_box,))
