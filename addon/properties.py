"""What the user chooses, saved with the .blend on the scene, and what runs now, on the window manager."""

import bpy
from bpy.props import (
    BoolProperty,
    CollectionProperty,
    EnumProperty,
    FloatProperty,
    IntProperty,
    IntVectorProperty,
    PointerProperty,
    StringProperty,
)

# Blender 4.5 and later want to be told that // is meant as the .blend's folder; older ones take it for granted.
_PATH_OPTIONS = {"ANIMATABLE"} | ({"PATH_SUPPORTS_BLEND_RELATIVE"} if bpy.app.version >= (4, 5, 0) else set())


def _changed(_settings: "SmokeliftSettings", context: bpy.types.Context) -> None:
    """What the shot will take has changed: look again, where there is somebody to see it."""
    if not bpy.app.background and context.window is not None:
        bpy.ops.smokelift.check()


def _clip_chosen(settings: "SmokeliftSettings", context: bpy.types.Context) -> None:
    """A new clip is used from its first frame to its last."""
    if settings.clip is not None:
        settings.first, settings.last = 1, max(1, settings.clip.frame_duration)


def _box_chosen(settings: "SmokeliftSettings", context: bpy.types.Context) -> None:
    """Who says where the smoke is in the scene means the scene's camera."""
    if settings.box is not None:
        settings.camera_mode = "SCENE"
    _changed(settings, context)


def _is_mesh(_settings: "SmokeliftSettings", thing: bpy.types.Object) -> bool:
    return thing.type == "MESH"


def _is_empty(_settings: "SmokeliftSettings", thing: bpy.types.Object) -> bool:
    return thing.type == "EMPTY"


class SmokeliftSettings(bpy.types.PropertyGroup):
    """The shot of one scene."""

    clip: PointerProperty(
        name="Clip",
        description="Footage of smoke: a video or a sequence of pictures",
        type=bpy.types.MovieClip,
        update=_clip_chosen,
    )
    first: IntProperty(
        name="First",
        description="First frame of the clip to use, counted from 1 as Blender does; the command line counts from 0",
        default=1,
        min=1,
        update=_changed,
    )
    last: IntProperty(
        name="Last",
        description="Last frame of the clip to use, counted from 1 as Blender does; the command line counts from 0",
        default=1,
        min=1,
        update=_changed,
    )
    plate_mode: EnumProperty(
        name="Background",
        description="What the picture shows where there is no smoke",
        items=[
            ("ESTIMATE", "From the Clip", "Find the background in the frames where the smoke does not cover it"),
            ("FILE", "Clean Plate", "A picture of the same view without smoke; of a moving camera, one for each frame"),
        ],
        update=_changed,
    )
    plate: StringProperty(
        name="Clean Plate",
        description=(
            "Picture of the same view without smoke. If the camera moves: a video without smoke, or the first picture "
            "of a sequence, with a picture for every frame of the clip"
        ),
        subtype="FILE_PATH",
        options=_PATH_OPTIONS,
        update=_changed,
    )
    camera_mode: EnumProperty(
        name="Camera",
        description="Where the clip was filmed from",
        items=[
            (
                "GUESS",
                "Guess",
                "A level camera with an ordinary lens, and a box around the smoke; it is made",
            ),
            ("SCENE", "Scene Camera", "The scene's camera with its lens, sensor, shift and place, tracked or still"),
        ],
        update=_changed,
    )
    box: PointerProperty(
        name="Box",
        description="Box that holds all of the smoke; the smaller, the finer the result",
        type=bpy.types.Object,
        poll=_is_mesh,
        update=_box_chosen,
    )
    inlet: PointerProperty(
        name="Inlet",
        description=(
            "Empty where the smoke comes from, as large as the place where it enters. Without one such places are "
            "looked for; with one they are not"
        ),
        type=bpy.types.Object,
        poll=_is_empty,
        update=_changed,
    )
    floor: BoolProperty(
        name="Floor",
        description="The bottom of the box is solid: no air goes through it",
        update=_changed,
    )
    light_mode: EnumProperty(
        name="Light",
        description="What lights the smoke in the clip",
        items=[
            ("ESTIMATE", "From the Clip", "Even light from everywhere, as bright as the smoke in the clip"),
            ("SCENE", "Scene Lights", "The scene's suns and point lights, and the picture that lights its world"),
        ],
    )
    quality: EnumProperty(
        name="Quality",
        description="More detail takes more time, memory and disk",
        items=[
            ("draft", "Draft", "A quick look"),
            ("balanced", "Balanced", "Good for most shots"),
            ("fine", "Fine", "All the detail that the clip holds, several times slower"),
        ],
        default="balanced",
        update=_changed,
    )
    output: StringProperty(
        name="Output",
        description="Folder for the results; empty is a folder beside the .blend file",
        subtype="DIR_PATH",
        options=_PATH_OPTIONS,
    )

    longest_side: IntProperty(
        name="Resolution",
        description="Voxels along the box's longest side; 0 is what the clip's detail asks for, at most the quality's",
        default=0,
        min=0,
        max=1024,
        update=_changed,
    )
    use_axis_depth: BoolProperty(
        name="Known Depth",
        description="Say how far behind the middle of the box the smoke stands; else it is estimated",
        update=_changed,
    )
    axis_depth: FloatProperty(
        name="Depth",
        description="From the middle of the box to the middle of the smoke, away from the camera; below 0 is nearer",
        subtype="DISTANCE",
        default=0.0,
        update=_changed,
    )
    fps: FloatProperty(
        name="Captured At",
        description="Frames a second at which the camera ran, if the clip is in slow motion; 0 is the clip's own rate",
        default=0.0,
        min=0.0,
        soft_max=1000.0,
        update=_changed,
    )
    transfer: EnumProperty(
        name="Pixels",
        description="How the pixels of the clip encode light",
        items=[
            ("AUTO", "Automatic", "As usual for the kind of file"),
            ("srgb", "sRGB", "Ordinary video and pictures"),
            ("linear", "Linear", "Already proportional to light"),
        ],
        update=_changed,
    )
    use_medium: BoolProperty(name="Smoke Material", description="Say how the smoke takes and scatters light")
    extinction: FloatProperty(
        name="Extinction",
        description="Light taken per metre of smoke of density 1",
        default=5.0,
        min=0.001,
        soft_max=50.0,
    )
    albedo: FloatProperty(
        name="Albedo",
        description="Share of that light which is scattered: 1 is white steam, 0 black soot",
        default=0.9,
        min=0.0,
        max=1.0,
    )
    anisotropy: FloatProperty(
        name="Anisotropy", description="Light goes on forwards (above 0) or back", default=0.0, min=-0.95, max=0.95
    )
    speed: EnumProperty(
        name="Speed",
        description="How fast the smoke moves where the clip and the scene have other frame rates",
        items=[
            ("REAL", "Real Time", "As fast as it was filmed"),
            ("FRAMES", "Frame by Frame", "One frame of the clip in every frame of the scene, as Blender plays clips"),
        ],
    )
    device: EnumProperty(
        name="Device",
        description="What computes",
        items=[
            ("auto", "Automatic", "The graphics card if there is a usable one"),
            ("cpu", "Processor", "The processor only"),
            ("gpu", "Graphics Card", "The graphics card, or fail"),
        ],
    )
    volume: PointerProperty(name="Result", description="The smoke that was made", type=bpy.types.Object)


class SmokeliftJob(bpy.types.PropertyGroup):
    """One run, as the panel shows it."""

    scene_uid: IntProperty()
    take: StringProperty()
    outcome: StringProperty(default="waiting")
    done: IntProperty()
    total: IntProperty()
    seconds_left: FloatProperty(default=-1.0)
    sentence: StringProperty()
    warnings: StringProperty()
    icon: IntProperty()
    cancel: BoolProperty()


class SmokeliftState(bpy.types.PropertyGroup):
    """What runs, waits and has ended in this session, and what the next run would take; never saved."""

    jobs: CollectionProperty(type=SmokeliftJob)
    check_scene: IntProperty()
    check_ticks: IntProperty()
    check_done: BoolProperty()
    check_error: StringProperty()
    notes: StringProperty()
    resolution: IntVectorProperty(size=3)
    seconds: FloatProperty()
    memory: FloatProperty(description="GiB")
    memory_free: FloatProperty(description="GiB")
    disk: FloatProperty(description="MB")


_CLASSES = (SmokeliftSettings, SmokeliftJob, SmokeliftState)


def register() -> None:
    """Add the properties to scenes and to the window manager."""
    for cls in _CLASSES:
        bpy.utils.register_class(cls)
    bpy.types.Scene.smokelift = PointerProperty(type=SmokeliftSettings)
    bpy.types.WindowManager.smokelift = PointerProperty(type=SmokeliftState)


def unregister() -> None:
    """Take the properties away."""
    del bpy.types.WindowManager.smokelift
    del bpy.types.Scene.smokelift
    for cls in reversed(_CLASSES):
        bpy.utils.unregister_class(cls)
