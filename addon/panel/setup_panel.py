"""The sub-panel Shot Set-Up: what Set Up Shot sets up, each with a tick of its own; and the button for that."""

import bpy
from bpy.app.translations import pgettext_rpt as rpt_

from ..core import ShotError
from ..scene import shot_setup, volume
from ..scene.plate import clip_behind
from .common import UNDO, needs_clip, needs_result, operator, panels
from .layout import draw_settings
from .settings import choice, link, tick


class SetUpSettings:
    """What Set Up Shot sets up."""

    set_up_range: tick("Size, Rate and Range", default=True)(
        "Give the scene the clip's resolution and frame rate, and the length of the result"
    )
    set_up_camera: tick("Camera", default=True)(
        "Look through the camera of the clip, with the background behind it that the render has, and the clip at a "
        "switch"
    )
    set_up_light: tick("Light", default=True)(
        "Render with Cycles, scatter light in smoke as often as the engine did, and add the light that was estimated "
        "from the clip"
    )
    set_up_plate: tick("Background", default=True)("Show the clean plate behind the smoke")
    set_up_colors: tick("Color Management", default=True)(
        "Set the view transform to Standard, in which the clip looks as it was filmed"
    )
    plate_place: choice("Place")(
        "Where the background is put behind the smoke",
        ("WORLD", "World", "In the world, seen by the camera only"),
        (
            "COMPOSITE",
            "Compositor",
            "Transparent film over the plate in the compositor, with the smoke's shadow on the floor, holdouts, "
            "the clip's grain, and the clip in front of it all where a mask says so",
        ),
        (
            "PROJECTION",
            "Projection",
            "On a card behind the smoke, projected from where the clip was filmed, so that it stays in its place "
            "when the camera of the render moves",
        ),
    )
    assumed_camera: link("Assumed Camera", bpy.types.Object)(
        "Camera object that stands where the clip was assumed to be filmed from"
    )


@operator("Set Up Shot", needs_clip, needs_result, bl_options=UNDO)
def set_up(context: bpy.types.Context, smoke: bpy.types.Object) -> str:
    """Make a Cycles render from the camera match the clip: resolution, frame rate, background, estimated light
    and colors, with samples for about a minute in a new file. The old world stays in the file
    """
    take, settings = volume.shown_take(smoke), smoke.smokelift
    if volume.shown(smoke) is None:
        text = rpt_("The files of the smoke in {:s} are missing: make it again.")
        raise ShotError(text.format(str(take.directory)))
    if settings.set_up_camera and settings.camera_mode == "SCENE" and context.scene.camera is None:
        raise ShotError("The scene has no camera: choose the one that the smoke was made for.")
    said = shot_setup.set_up(smoke)
    if settings.set_up_camera and context.area is not None and context.area.type == "VIEW_3D":
        context.space_data.region_3d.view_perspective = "CAMERA"
    volume.show(smoke, take)  # the frame rate may have changed
    return " ".join([rpt_("The shot is set up: press F12 for a render that matches the clip."), *said])


@panels("set_up", "Shot Set-Up", needs_clip)
def _draw_set_up(layout: bpy.types.UILayout, context: bpy.types.Context, smoke: bpy.types.Object) -> None:
    layout.use_property_split = False
    settings = smoke.smokelift
    draw_settings(layout, settings, "set_up_range", "set_up_camera", "set_up_light", "set_up_colors", "set_up_plate")
    row = layout.row()
    row.use_property_split = True
    row.active = settings.set_up_plate
    row.prop(settings, "plate_place")
    camera = context.scene.camera
    clip = clip_behind(smoke, camera.data) if camera is not None and camera.type == "CAMERA" else None
    if clip is not None:
        layout.prop(clip, "show_background_image", text="Clip in View", icon="NONE")
    layout.operator("smokelift.set_up", icon="CAMERA_DATA")
