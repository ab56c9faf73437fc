"""A video that is dropped into the 3D View or the Movie Clip Editor becomes a smoke."""

import bpy


class SMOKELIFT_FH_video(bpy.types.FileHandler):
    """Blender asks which one is meant, if it can do something else with such a file."""

    bl_idname = "SMOKELIFT_FH_video"
    bl_label = "Smoke from Video"
    bl_import_operator = "smokelift.add"
    bl_file_extensions = ";".join(sorted(bpy.path.extensions_movie))

    @classmethod
    def poll_drop(cls, context: bpy.types.Context) -> bool:
        return context.area is not None and context.area.type in ("VIEW_3D", "CLIP_EDITOR")


register, unregister = bpy.utils.register_classes_factory((SMOKELIFT_FH_video,))
