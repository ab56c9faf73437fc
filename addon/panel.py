"""The sidebar's tab Smokelift, in the 3D View and in the Movie Clip Editor."""

import bpy

from . import operators


class _Main:
    bl_label = "Smokelift"
    bl_category = "Smokelift"
    bl_region_type = "UI"

    def draw(self, context: bpy.types.Context) -> None:
        """From the clip to the button, top to bottom."""
        layout = self.layout
        layout.use_property_split = True
        layout.use_property_decorate = False
        settings = context.scene.smokelift
        layout.template_ID(settings, "clip", open="clip.open")
        if settings.clip is not None:
            row = layout.row(align=True)
            row.prop(settings, "first", text="Frames")
            row.prop(settings, "last", text="")
        _draw_shot(layout, settings)
        layout.prop(settings, "quality")
        layout.prop(settings, "output")
        _draw_run(layout, context)


def _draw_shot(layout: bpy.types.UILayout, settings: bpy.types.PropertyGroup) -> None:
    layout.prop(settings, "plate_mode")
    if settings.plate_mode == "FILE":
        layout.prop(settings, "plate", text=" ")
    layout.prop(settings, "camera_mode")
    if settings.camera_mode == "SCENE":
        row = layout.row(align=True)
        row.prop(settings, "box")
        row.operator("smokelift.make_box", text="", icon="MESH_CUBE")
    layout.prop(settings, "light_mode")


def _draw_run(layout: bpy.types.UILayout, context: bpy.types.Context) -> None:
    column = layout.column()
    column.scale_y = 1.5
    column.operator("smokelift.run", icon="PLAY")
    for row in context.window_manager.smokelift.jobs:
        _draw_job(layout, row)
    if not context.window_manager.smokelift.jobs and operators.unfinished(context.scene) is not None:
        layout.operator("smokelift.resume", icon="FILE_REFRESH")


def _draw_job(layout: bpy.types.UILayout, row: bpy.types.PropertyGroup) -> None:
    box = layout.box()
    if row.outcome == "waiting":
        box.label(text="Waiting", icon="SORTTIME")
    elif row.outcome == "running":
        factor = row.done / row.total if row.total else 0.0
        box.progress(factor=factor, text=_progress(row))
    else:
        box.label(text=row.sentence, icon="ERROR" if row.outcome == "failed" else "INFO")
    buttons = box.row(align=True)
    if row.outcome in ("waiting", "running"):
        button = buttons.operator("smokelift.cancel", text="Cancel", icon="CANCEL")
        button.take = row.take
    else:
        button = buttons.operator("smokelift.open_log", icon="TEXT")
        button.take = row.take


def _progress(row: bpy.types.PropertyGroup) -> str:
    if not row.total:
        return "Looking at the clip"
    left = f", {duration(row.seconds_left)} left" if row.seconds_left >= 0.0 else ""
    return f"Frame {row.done} of {row.total}{left}"


def duration(seconds: float) -> str:
    """A time in words, no finer than is honest."""
    if seconds < 60.0:
        return f"{max(1, round(seconds))} s"
    minutes = round(seconds / 60.0)
    return f"{minutes} min" if minutes < 60 else f"{minutes // 60} h {minutes % 60:02d} min"


class SMOKELIFT_PT_view(_Main, bpy.types.Panel):
    """In the 3D View."""

    bl_space_type = "VIEW_3D"


class SMOKELIFT_PT_clip(_Main, bpy.types.Panel):
    """In the Movie Clip Editor."""

    bl_space_type = "CLIP_EDITOR"


class _Advanced:
    bl_label = "Advanced"
    bl_category = "Smokelift"
    bl_region_type = "UI"
    bl_options = {"DEFAULT_CLOSED"}

    def draw(self, context: bpy.types.Context) -> None:
        """Whatever most shots do not need."""
        layout = self.layout
        layout.use_property_split = True
        layout.use_property_decorate = False
        settings = context.scene.smokelift
        for name in ("longest_side", "fps", "transfer", "speed", "device", "use_medium"):
            layout.prop(settings, name)
        column = layout.column()
        column.active = settings.use_medium
        for name in ("extinction", "albedo", "anisotropy"):
            column.prop(settings, name)


class SMOKELIFT_PT_view_advanced(_Advanced, bpy.types.Panel):
    """In the 3D View."""

    bl_space_type = "VIEW_3D"
    bl_parent_id = "SMOKELIFT_PT_view"


class SMOKELIFT_PT_clip_advanced(_Advanced, bpy.types.Panel):
    """In the Movie Clip Editor."""

    bl_space_type = "CLIP_EDITOR"
    bl_parent_id = "SMOKELIFT_PT_clip"


_CLASSES = (SMOKELIFT_PT_view, SMOKELIFT_PT_clip, SMOKELIFT_PT_view_advanced, SMOKELIFT_PT_clip_advanced)


def register() -> None:
    """Make the panels known."""
    for cls in _CLASSES:
        bpy.utils.register_class(cls)


def unregister() -> None:
    """Take them back."""
    for cls in reversed(_CLASSES):
        bpy.utils.unregister_class(cls)
