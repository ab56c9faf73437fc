"""The sub-panels Advanced, Look and Shot Set-Up: how a result plays, what it looks like, and the scene around it."""

import bpy

from ..core import ShotError
from ..result.shot_check import found_lines, state
from ..scene import look, shot_setup, volume
from ..scene.blender import rpt_
from ..scene.modifiers import CAN_INTERPOLATE, PROXY, in_viewport
from ..scene.plate import camera_of_view, clip_behind
from ..scene.smoke import is_override, smoke_with_look
from .common import UNDO, Need, needs_clip, needs_result, operator, panels
from .layout import draw_automatic, draw_settings, draw_text, draw_work
from .settings import choice, link, tick

SHORT = {"Absorption Color": "Absorption"}  # names of inputs that the sidebar would cut off


class PlaybackSettings:
    """How a result is played."""

    speed: choice("Speed", update=volume.synchronize_playback)(
        "Speed of the smoke if clip and scene differ in frame rate",
        ("FRAMES", "Frame by Frame", "One frame of the clip in each frame of the scene, as Blender plays clips"),
        ("REAL", "Real Time", "As fast as in reality"),
    )
    between: tick("Frames Between", update=volume.synchronize_playback)(
        "At another speed than the clip's, compute what lies between two frames with their velocity, while it is "
        "shown and rendered. Blender can do so since 5.0"
    )


@panels("advanced", "Advanced", needs_clip)
def _draw_advanced(layout: bpy.types.UILayout, _context: bpy.types.Context, smoke: bpy.types.Object) -> None:
    settings = smoke.smokelift
    row = layout.row()
    row.active = settings.camera_mode == "SCENE"
    draw_automatic(row, settings, "longest_side")
    draw_automatic(layout, settings, "fps")
    draw_settings(layout, settings, "transfer", "speed", *(["between"] if CAN_INTERPOLATE else []))
    draw_settings(layout, settings, "device", "use_medium")
    draw_settings(layout, settings, "extinction", "albedo", "anisotropy", active=settings.use_medium)
    if state.fits(smoke) and state.done:
        for line in found_lines(state.details.get("facts", ())):
            layout.label(text=line, translate=False)
    layout.operator("smokelift.show_page", icon="IMAGE_DATA")
    layout.operator("smokelift.check", icon="VIEWZOOM")


# also a smoke that is linked from another file can be changed so
_needs_look = Need(
    needs_result.why,
    lambda context, smoke: is_override(smoke_with_look(context.scene)) or needs_result.is_there(context, smoke),
)
PRESETS = [(key, name, description) for key, (name, description, _) in look.PRESETS.items()]


@operator("Use Look", _needs_look, bl_options=UNDO, given={"preset": choice("Preset")("Kind of smoke", *PRESETS)})
def use_look(context: bpy.types.Context, _smoke: bpy.types.Object, preset: str) -> None:
    """Set density, brightness, colors and edges of the smoke. What was fitted to the clip stays"""
    smoke = smoke_with_look(context.scene)
    now = volume.shown_take(smoke).read()
    if not now.index:
        raise ShotError("The smoke's files are missing: make it again.")
    if not look.use_preset(smoke, preset, now.scene["medium"]["anisotropy"]):
        raise ShotError("The smoke's material is your own: remove it and show the result again for presets.")


@panels("look", "Look", _needs_look)
def _draw_look(layout: bpy.types.UILayout, context: bpy.types.Context, smoke: bpy.types.Object) -> None:
    smoke = smoke_with_look(context.scene)
    layout.use_property_decorate = True  # the look may be animated
    override = is_override(smoke)
    if override:
        layout.label(text=smoke.name, translate=False, icon="LIBRARY_DATA_OVERRIDE")
    sockets = look.controls(smoke)
    if sockets:
        layout.operator_menu_enum("smokelift.use_look", "preset", text="Presets", icon="PRESET")
    else:
        layout.label(text="The material is your own", icon="MATERIAL")
    if look.is_linked(smoke):
        draw_text(layout, "A preset gives this override a look of its own.", "INFO")
    else:
        column = layout.column()
        for socket in sockets:
            column.prop(socket, "default_value", text=SHORT.get(socket.name, socket.name))
    column = layout.column()
    column.use_property_decorate = False
    modifier = PROXY.modifier(smoke)
    if not override:
        column.prop(in_viewport(smoke).display, "density", text="View Density")
        # Cycles goes through smoke by null scattering since 5.0, unless it is set to march as before
        cycles = getattr(context.scene, "cycles", None)
        may_choose = hasattr(cycles, "volume_biased")
        if may_choose:
            column.prop(cycles, "volume_biased", text="March in Cycles")
        row = column.row()
        row.active = not may_choose or cycles.volume_biased
        row.prop(smoke.data.render, "step_size", text="Render Step")
        if may_choose and not cycles.volume_biased:
            draw_text(column, "Marching has less noise per sample, but its steps make an error.", "INFO")
    if modifier is not None:
        column.prop(modifier, "show_viewport", text="Proxy in View", icon="NONE")
    elif not override:
        draw_work(column, smoke, "smokelift.make_proxy", "MOD_REMESH")


class SetUpSettings:
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
    camera = camera_of_view(context.scene)
    if camera is not None and (clip := clip_behind(smoke, camera)) is not None:
        layout.prop(clip, "show_background_image", text="Clip in View", icon="NONE")
    layout.operator("smokelift.set_up", icon="CAMERA_DATA")
