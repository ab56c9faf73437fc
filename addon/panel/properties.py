"""Settings of a smoke, saved with its object, and the state of this session, on the window manager."""

from typing import Any

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

from ..core.contract import BOX_VOXELS, FASTEST, SIDES, SLOWEST
from ..result import shot_check
from ..result.directing import frames_of_result
from ..scene import volume
from ..scene.blender import PATH_OPTIONS
from ..scene.box import box_of
from ..scene.smoke import free_folder, scene_of
from .layout import automatic_unless

USUAL_DISTANCE = 2.0
"""Meters from which a distance is given by hand where there is no box."""

SEEDS = 2**31
"""Numbers of variations: as many as Blender's whole numbers have from 0."""


def _changed(_settings: "SmokeliftSettings", context: bpy.types.Context) -> None:
    shot_check.check_again(context)


def _clip_chosen(settings: "SmokeliftSettings", context: bpy.types.Context) -> None:
    """Use all frames of a new clip, none of the old one's, and a folder that no other smoke has."""
    if settings.clip is None:
        return
    settings.first, settings.last = 1, max(1, settings.clip.frame_duration)
    settings.plate_frames = ""
    settings.folder, settings.results = free_folder(settings.id_data), ""


def _box_chosen(settings: "SmokeliftSettings", context: bpy.types.Context) -> None:
    """A box belongs to the scene's camera."""
    if settings.box is not None:
        settings.camera_mode = "SCENE"
    _changed(settings, context)


def _middle_of_box(settings: "SmokeliftSettings") -> float:
    """Where a distance that is given by hand begins: at the middle of the box, if there is one before the camera."""
    box, camera = box_of(settings.id_data), scene_of(settings.id_data).camera
    if box is None or camera is None:
        return USUAL_DISTANCE
    pose = camera.matrix_world
    return max(0.0, -(box.matrix_world.translation - pose.translation).dot(pose.col[2].to_3d())) or USUAL_DISTANCE


def _speed_chosen(_settings: "SmokeliftSettings", _context: bpy.types.Context) -> None:
    volume.keep_step()


def _start_chosen(settings: "SmokeliftDirecting", _context: bpy.types.Context) -> None:
    """Begin with the last frame of the result, unless a frame of it was chosen before."""
    frames = frames_of_result(settings.id_data)
    if frames is not None and not frames[0] <= settings.start <= frames[1]:
        settings.start = frames[1]


def _part_chosen(settings: "SmokeliftDirecting", _context: bpy.types.Context) -> None:
    """Begin with the whole result, unless a part of it was chosen before."""
    frames = frames_of_result(settings.id_data)
    if frames is not None and not frames[0] <= settings.part_first < settings.part_last <= frames[1]:
        settings.part_first, settings.part_last = frames


def closed_sides(description: str, **options: Any) -> Any:
    """A row of buttons, one for each side of the box."""
    items = [(side, f"{side[1]}{side[0].upper()}", "", 1 << place) for place, side in enumerate(SIDES)]
    return EnumProperty(
        name="Closed Sides", description=description, items=items, options={"ANIMATABLE", "ENUM_FLAG"}, **options
    )


def _is_mesh(_settings: "SmokeliftSettings", obj: bpy.types.Object) -> bool:
    return obj.type == "MESH"


def _is_empty(_settings: "SmokeliftSettings", obj: bpy.types.Object) -> bool:
    return obj.type == "EMPTY"


class SmokeliftDirecting(bpy.types.PropertyGroup):
    """What is made of the result on show."""

    direction: EnumProperty(
        name="Direction",
        description="What is made of the result on show",
        items=[
            ("continue", "Continue", "Let the smoke go on after its last frame, in wind and around obstacles"),
            ("retime", "Retime", "Slow motion, fast motion and speed ramps"),
            ("loop", "Loop", "Repeat the smoke without a seam"),
        ],
    )
    frames: IntProperty(name="Frames", description="Number of frames to add", default=48, min=1, max=100_000)
    fade: IntProperty(name="Fade", description="Frames at the end in which the smoke fades to nothing", min=0)
    use_start: BoolProperty(
        name="Start",
        description="Simulate from a frame of the clip on, in place of the frames that follow it",
        update=_start_chosen,
    )
    start: IntProperty(
        name="Start", description="Last frame that stays as it is, counted as Frames of the clip", default=1
    )
    closed: closed_sides("Sides of the result's box, along its own axes, that are walls for the frames that are added")
    room: FloatProperty(
        name="Room",
        description="How many times as large as the result's box the smoke may become. Its box grows where smoke goes; "
        "smoke that would need more dissolves before the box ends. 1 keeps the box",
        default=8.0,
        min=1.0,
        soft_max=64.0,
        max=4096.0,
        precision=1,
    )
    use_buoyancy: BoolProperty(
        name="Buoyancy", description="Choose Buoyancy by hand; otherwise it is that of the clip's smoke"
    )
    buoyancy: FloatProperty(
        name="Buoyancy",
        description="Upward acceleration of smoke of density 1 in the clip's own scale; below zero it sinks",
        unit="ACCELERATION",
        default=1.0,
        soft_min=-10.0,
        soft_max=10.0,
    )
    use_dissipation: BoolProperty(
        name="Dissipation", description="Choose Dissipation by hand; otherwise it is that of the clip's smoke"
    )
    dissipation: FloatProperty(
        name="Dissipation",
        description="How fast smoke dissolves, per second: 0 keeps it, at 1 a third is left after a second",
        default=0.0,
        min=0.0,
        soft_max=5.0,
    )
    effectors: PointerProperty(
        name="Effectors",
        description=(
            "Collection of what acts on the smoke: closed meshes, which may be animated, are obstacles; Wind "
            "and Turbulence force fields are wind and turbulence. An Empty, a Force field or a Wind field with "
            "Max Distance is a fan, which blows along its Z axis. Strength is m/s"
        ),
        type=bpy.types.Collection,
    )
    fan_speed: FloatProperty(
        name="Fan Speed",
        description="Velocity of the air in Empties that have no force field",
        unit="VELOCITY",
        default=1.0,
        soft_min=-10.0,
        soft_max=10.0,
    )
    speed: FloatProperty(
        name="Speed",
        description="Speed of the smoke: 0.5 is half as fast",
        default=0.5,
        min=SLOWEST,
        max=FASTEST,
        soft_max=4.0,
        update=_speed_chosen,
    )
    use_ramp: BoolProperty(
        name="Ramp",
        description="Change the speed from the first frame to the middle and to the last",
        update=_speed_chosen,
    )
    speed_middle: FloatProperty(
        name="Middle",
        description="Speed in the middle of the result",
        default=0.5,
        min=SLOWEST,
        max=FASTEST,
        soft_max=4.0,
        update=_speed_chosen,
    )
    speed_end: FloatProperty(
        name="End",
        description="Speed at the last frame",
        default=1.0,
        min=SLOWEST,
        max=FASTEST,
        soft_max=4.0,
        update=_speed_chosen,
    )
    live: BoolProperty(
        name="Preview",
        description="Play the result on show at this speed now. Retime Smoke, or Frames Between in Advanced, makes the "
        "frames in between",
        update=_speed_chosen,
    )
    use_part: BoolProperty(
        name="Part",
        description="Loop a part of the result, in which the smoke is steady",
        update=_part_chosen,
    )
    part_first: IntProperty(
        name="First", description="First frame of the part, counted as Frames of the clip", default=1
    )
    part_last: IntProperty(name="Last", description="Last frame of the part, counted as Frames of the clip", default=48)
    overlap: IntProperty(
        name="Overlap",
        description="Frames in which the end becomes the start; automatic is a third of the loop, 24 at most",
        min=0,
    )
    use_overlap: automatic_unless("overlap", "Overlap", 12)

    def speeds(self) -> tuple[float, ...]:
        """One speed, or those of a ramp."""
        return (self.speed, self.speed_middle, self.speed_end) if self.use_ramp else (self.speed,)


class SmokeliftSettings(bpy.types.PropertyGroup):
    """Settings of one smoke, on its Volume object."""

    is_smoke: BoolProperty(name="Smoke", description="The object is made from a clip", options={"HIDDEN"})
    folder: StringProperty(name="Folder", description="Name of the folder for the results", options={"HIDDEN"})
    results: StringProperty(
        name="Results",
        description="Folder that holds the results where none is chosen; the add-on keeps it in step with the .blend",
        options={"HIDDEN"},
    )
    saved_as: StringProperty(
        name="Saved As",
        description="The .blend as it was last saved or opened, which may have been copied or renamed meanwhile",
        options={"HIDDEN"},
    )
    before: StringProperty(name="Before", description="The result that was shown before", options={"HIDDEN"})
    directing: PointerProperty(name="Direct", description="What is made of the result", type=SmokeliftDirecting)

    clip: PointerProperty(
        name="Clip",
        description="Footage of smoke: a video or an image sequence",
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
        description="The picture without smoke",
        items=[
            ("ESTIMATE", "From the Clip", "Estimate the background from frames where no smoke covers it"),
            (
                "FILE",
                "Clean Plate",
                "Picture of the same view without smoke; for a moving camera, one for each frame",
            ),
            ("FRAMES", "Frames", "Frames of the clip in which there is no smoke"),
        ],
        update=_changed,
    )
    plate: StringProperty(
        name="Clean Plate",
        description=(
            "Picture of the same view without smoke. For a moving camera: a video, or the first image of a sequence, "
            "with one image for each frame of the clip"
        ),
        subtype="FILE_PATH",
        options=PATH_OPTIONS,
        update=_changed,
    )
    plate_frames: StringProperty(
        name="Frames",
        description="Frames of the clip without smoke, counted from 1 and separated by commas",
        update=_changed,
    )
    strokes: PointerProperty(
        name="Strokes",
        description="Image of the clip's size: painted green where smoke is, red where none is, blue where a pixel "
        "shows the background. Nothing is said of the rest, which is transparent",
        type=bpy.types.Image,
        update=_changed,
    )
    drawn_mask: PointerProperty(
        name="Mask",
        description="Mask of the Clip Editor: smoke may be inside its lines, or outside those of a layer that is "
        "inverted, and nowhere else, whatever moves there",
        type=bpy.types.Mask,
        update=_changed,
    )
    mask: StringProperty(
        name="Mask File",
        description=(
            "Picture that is white where smoke may be and black where none is, whatever moves there; or a video, or "
            "mask_####.png, with one for each frame of the clip"
        ),
        subtype="FILE_PATH",
        options=PATH_OPTIONS,
        update=_changed,
    )
    camera_mode: EnumProperty(
        name="Camera",
        description="Where the clip was filmed from",
        items=[
            (
                "ESTIMATE",
                "From the Clip",
                "Assume a level camera with an ordinary lens and a box around the smoke, and add it",
            ),
            ("SCENE", "Scene Camera", "The scene's camera with its lens, sensor and shift, tracked or still"),
        ],
        update=_changed,
    )
    box: PointerProperty(
        name="Box",
        description="Box that holds all of the smoke. A smaller box gives a finer result",
        type=bpy.types.Object,
        poll=_is_mesh,
        update=_box_chosen,
    )
    inlet: PointerProperty(
        name="Inlet",
        description=("Empty at the smoke's source, as large as the opening. Without one, sources are estimated"),
        type=bpy.types.Object,
        poll=_is_empty,
        update=_changed,
    )
    distance: FloatProperty(
        name="Distance",
        description="Distance from the camera to the lower end of the smoke, level and straight ahead; automatic is "
        "estimated. With Camera From the Clip it sets the scale",
        subtype="DISTANCE",
        default=0.0,
        min=0.0,
        update=_changed,
    )
    use_distance: automatic_unless("distance", "Distance", _middle_of_box)
    closed: closed_sides(
        "Sides of the box, along its own axes, that are solid: no air flows through them. -Z is a floor",
        update=_changed,
    )
    light_mode: EnumProperty(
        name="Light",
        description="What lights the smoke in the clip",
        items=[
            ("ESTIMATE", "From the Clip", "Estimate even light from the smoke's brightness"),
            ("SCENE", "Scene Lights", "The scene's suns and point lights, and its world's panorama"),
        ],
        update=_changed,
    )
    quality: EnumProperty(
        name="Quality",
        description="More detail takes more time, memory (RAM, in GiB) and disk space. Lost is the share of the "
        "smoke's contrast in the clip that is finer than the voxels",
        items=[
            ("draft", "Draft", "A quick preview"),
            ("balanced", "Balanced", "Good for most shots"),
            ("fine", "Fine", "More of the clip's detail, several times slower"),
            ("final", "Final", "All of the clip's detail, a voxel a pixel: much memory, seconds to minutes a frame"),
        ],
        default="balanced",
        update=_changed,
    )
    detail: FloatProperty(
        name="Depth Detail",
        description=(
            "How much fine structure in depth is made up in the clip's texture, since no camera shows it. "
            "At 0 the smoke is smooth from the side, which is best for measuring; at 1 it is as detailed as in the clip"
        ),
        subtype="FACTOR",
        default=1.0,
        min=0.0,
        max=1.0,
        update=_changed,
    )
    seed: IntProperty(
        name="Variation",
        description="Number of the plausible smoke: all look alike from the camera, and differ from the side",
        default=0,
        min=0,
        max=SEEDS - 1,
    )
    output: StringProperty(
        name="Output",
        description="Folder for the results; by default beside the .blend file, or beside the clip if that is unsaved",
        subtype="DIR_PATH",
        options=PATH_OPTIONS,
    )

    longest_side: IntProperty(
        name="Resolution",
        description="Voxels along the box's longest side; automatic is by the detail that is measured in the clip",
        default=0,
        min=0,
        max=1024,
        update=_changed,
    )
    use_longest_side: automatic_unless("longest_side", "Resolution", BOX_VOXELS)
    fps: FloatProperty(
        name="Frame Rate",
        description="Frame rate at which the clip was filmed, if it plays in slow motion; automatic is the clip's own",
        default=0.0,
        min=0.0,
        soft_max=1000.0,
        update=_changed,
    )
    use_fps: automatic_unless("fps", "Frame Rate", 120.0)
    transfer: EnumProperty(
        name="Color Space",
        description="Color space of the clip",
        items=[
            ("AUTO", "From the Clip", "As the clip's settings in the Movie Clip Editor say"),
            ("srgb", "sRGB", "Ordinary video and pictures"),
            ("linear", "Linear Rec.709", "Proportional to light"),
        ],
        update=_changed,
    )
    use_medium: BoolProperty(name="Smoke Material", description="Set the smoke's optical properties", update=_changed)
    extinction: FloatProperty(
        name="Extinction",
        description="Extinction coefficient per meter of smoke of density 1",
        default=5.0,
        min=0.001,
        max=1e9,
        soft_max=50.0,
        update=_changed,
    )
    albedo: FloatProperty(
        name="Albedo",
        description="Scattered share of the extinction: 1 is white steam, 0 is black soot",
        default=0.9,
        min=0.0,
        max=1.0,
        update=_changed,
    )
    anisotropy: FloatProperty(
        name="Anisotropy",
        description="Forward scattering above 0, backward scattering below",
        default=0.0,
        min=-0.95,
        max=0.95,
        update=_changed,
    )
    speed: EnumProperty(
        name="Speed",
        description="Speed of the smoke if clip and scene differ in frame rate",
        items=[
            ("FRAMES", "Frame by Frame", "One frame of the clip in each frame of the scene, as Blender plays clips"),
            ("REAL", "Real Time", "As fast as in reality"),
        ],
        update=_speed_chosen,
    )
    between: BoolProperty(
        name="Frames Between",
        description="At another speed than the clip's, compute what lies between two frames with their velocity, while "
        "it is shown and rendered. Blender can do so since 5.0",
        update=_speed_chosen,
    )
    device: EnumProperty(
        name="Device",
        description="Device that renders",
        items=[
            ("auto", "Automatic", "The CPU, until a GPU is measured to be faster"),
            ("cpu", "CPU", "The CPU only"),
            ("gpu", "GPU Compute", "The GPU only; without a usable one the run fails"),
        ],
    )
    set_up_range: BoolProperty(
        name="Size, Rate and Range",
        description="Give the scene the clip's resolution and frame rate, and the length of the result",
        default=True,
    )
    set_up_camera: BoolProperty(
        name="Camera",
        description="Look through the camera of the clip, with the clip behind it",
        default=True,
    )
    set_up_light: BoolProperty(
        name="Light",
        description="Render with Cycles, scatter light in smoke as often as the engine did, and add the light that was "
        "estimated from the clip",
        default=True,
    )
    set_up_plate: BoolProperty(
        name="Background",
        description="Show the clean plate behind the smoke",
        default=True,
    )
    set_up_colors: BoolProperty(
        name="Color Management",
        description="Set the view transform to Standard, in which the clip looks as it was filmed",
        default=True,
    )
    plate_place: EnumProperty(
        name="Place",
        description="Where the background is put behind the smoke",
        items=[
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
        ],
    )
    assumed_camera: PointerProperty(
        name="Assumed Camera",
        description="Camera object that stands where the clip was assumed to be filmed from",
        type=bpy.types.Object,
    )


class SmokeliftDoubt(bpy.types.PropertyGroup):
    """Why a result may be nothing, or wrong."""

    kind: StringProperty(description="The engine's name of the sentence; empty if it has none")
    sentence: StringProperty()


class SmokeliftJob(bpy.types.PropertyGroup):
    """One run in the panel."""

    smoke_uid: IntProperty()
    take: StringProperty()
    outcome: StringProperty(default="waiting")
    done: IntProperty()
    total: IntProperty()
    seconds_left: FloatProperty(default=-1.0)
    sentence: StringProperty()
    doubts: CollectionProperty(type=SmokeliftDoubt)
    icon: IntProperty()
    cancel: BoolProperty()
    left: BoolProperty(description="The artist chose another result while it runs")


class SmokeliftCost(bpy.types.PropertyGroup):
    """What a run takes at the quality that it is named after."""

    resolution: IntVectorProperty(size=3)
    seconds: FloatProperty()
    memory: FloatProperty(description="GiB")
    disk: FloatProperty(description="MB")
    lost: FloatProperty(description="Share of the smoke's contrast in the clip; below 0 if unknown")


class SmokeliftState(bpy.types.PropertyGroup):
    """This session's runs, and the estimate of the next one; never saved."""

    jobs: CollectionProperty(type=SmokeliftJob)
    check_smoke: IntProperty()
    check_place: StringProperty(description="Corners of the box that was checked; empty without one")
    check_page: StringProperty(description="Picture of what was found in the shot that was checked")
    check_ticks: IntProperty()
    check_done: BoolProperty()
    check_error: StringProperty()
    check_seconds: IntProperty(description="Since the engine began to read the clip")
    notes: StringProperty()
    doubts: CollectionProperty(type=SmokeliftDoubt)
    costs: CollectionProperty(type=SmokeliftCost)
    costs_smoke: IntProperty(description="Whose the costs are")
    memory_free: FloatProperty(description="GiB")


_CLASSES = (
    SmokeliftDirecting,
    SmokeliftSettings,
    SmokeliftDoubt,
    SmokeliftJob,
    SmokeliftCost,
    SmokeliftState,
)


def register() -> None:
    for cls in _CLASSES:
        bpy.utils.register_class(cls)
    bpy.types.Object.smokelift = PointerProperty(type=SmokeliftSettings)
    bpy.types.WindowManager.smokelift = PointerProperty(type=SmokeliftState)


def unregister() -> None:
    del bpy.types.WindowManager.smokelift
    del bpy.types.Object.smokelift
    for cls in reversed(_CLASSES):
        bpy.utils.unregister_class(cls)
