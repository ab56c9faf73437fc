"""Another object that plays a Volume's files at its own time.

Blender keeps the time of a sequence in the Volume data-block, so that the object has a data-block of its own.
"""

import bpy
from bpy.props import BoolProperty, IntProperty

from .paths import absolute, relative


def copy_of(obj: bpy.types.Object, name: str) -> bpy.types.Object:
    """A copy of a Volume object, with data of its own and the same material, which is no smoke to be made."""
    copy = bpy.data.objects.new(name, obj.data.copy())
    copy.delta_location = obj.delta_location  # first: the matrix has it, and gives the rest to the location
    copy.matrix_basis = obj.matrix_basis
    return copy


def copy_later(obj: bpy.types.Object, name: str, offset: int, repeat: bool) -> bpy.types.Object:
    """A copy of a Volume object that plays some frames later; again and again if it repeats or the original does."""
    copy = copy_of(obj, name)
    if obj.data.library is not None:
        copy.data.filepath = relative(absolute(obj.data.filepath, obj.data.library))
    copy.data.frame_start += offset
    copy.data.sequence_mode = "REPEAT" if repeat else obj.data.sequence_mode
    return copy


class SMOKELIFT_OT_add_instance(bpy.types.Operator):
    """Add another object that plays the active Volume's files later or earlier. The material is shared"""

    bl_idname = "smokelift.add_instance"
    bl_label = "Instance in Time"
    bl_options = {"REGISTER", "UNDO"}

    offset: IntProperty(
        name="Time Offset", description="Frames by which the new object plays later; below 0 earlier", default=12
    )
    repeat: BoolProperty(name="Repeat", description="Play the frames again and again, as for a loop")

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        obj = context.object
        if obj is None or obj.type != "VOLUME" or not obj.data.is_sequence:
            cls.poll_message_set("Select a Volume that plays a sequence")
            return False
        if obj.data.animation_data is not None and obj.data.animation_data.drivers:
            cls.poll_message_set("Set Speed to Frame by Frame first")
            return False
        return True

    def execute(self, context: bpy.types.Context) -> set[str]:
        obj = context.object
        instance = copy_later(obj, obj.name, self.offset, self.repeat)
        context.collection.objects.link(instance)
        for other in context.selected_objects:
            other.select_set(False)
        instance.select_set(True)
        context.view_layer.objects.active = instance
        return {"FINISHED"}


register, unregister = bpy.utils.register_classes_factory((SMOKELIFT_OT_add_instance,))
