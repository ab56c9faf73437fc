"""The sub-panels Direct and Export: what is made of the result on show, and how that is handed on."""

from typing import Any

import bpy

from ..core.contract import FASTEST, SLOWEST
from ..result import run_queue, smoke_takes
from ..result.directing import MESHES, frames_of_result
from ..result.export import arguments, copy_of, export_size, folder_of, write_asset
from ..result.side_job import write_files, writing_job
from ..scene import volume
from ..scene.blender import PATH_OPTIONS, iface_
from ..scene.modifiers import CAN_INTERPOLATE
from ..scene.smoke import activate
from ..scene.volume import synchronize_playback
from .common import UNDO, Need, needs_clip, needs_rest, needs_result, needs_smoke, operator, panels
from .layout import draw_automatic, draw_closed, draw_progress, draw_settings, draw_text, draw_ticked, draw_work
from .settings import automatic_unless, choice, closed_sides, link, number, string, tick, whole

LINES = 11  # of the longest direction: the others are as high, or buttons would move under the pointer
EFFECTORS = "Effectors"  # name of a collection that the tab makes


def _start_chosen(settings: bpy.types.PropertyGroup, _context: bpy.types.Context) -> None:
    """Begin with the last frame of the result, unless a frame of it was chosen before."""
    frames = frames_of_result(settings.id_data)
    if frames is not None and not frames[0] <= settings.start <= frames[1]:
        settings.start = frames[1]


def _part_chosen(settings: bpy.types.PropertyGroup, _context: bpy.types.Context) -> None:
    """Begin with the whole result, unless a part of it was chosen before."""
    frames = frames_of_result(settings.id_data)
    if frames is not None and not frames[0] <= settings.part_first < settings.part_last <= frames[1]:
        settings.part_first, settings.part_last = frames


def _speed(name: str, description: str, default: float) -> Any:
    """A speed, of which 1 is the clip's own."""
    limits = {"min": SLOWEST, "max": FASTEST, "soft_max": 4.0}
    return number(name, default=default, update=synchronize_playback, **limits)(description)


class DirectSettings:
    """What is made of the result on show."""

    direction: choice("Direction")(
        "What is made of the result on show",
        ("continue", "Continue", "Let the smoke go on after its last frame, in wind and around obstacles"),
        ("retime", "Retime", "Slow motion, fast motion and speed ramps"),
        ("loop", "Loop", "Repeat the smoke without a seam"),
    )
    frames: whole("Frames", default=48, min=1, max=100_000)("Number of frames to add")
    fade: whole("Fade", min=0)("Frames at the end in which the smoke fades to nothing")
    use_start: tick("Start", update=_start_chosen)(
        "Simulate from a frame of the clip on, in place of the frames that follow it"
    )
    start: whole("Start", default=1)("Last frame that stays as it is, counted as Frames of the clip")
    closed: closed_sides("Sides of the result's box, along its own axes, that are walls for the frames that are added")
    room: number("Room", default=8.0, min=1.0, soft_max=64.0, max=4096.0, precision=1)(
        "How many times as large as the result's box the smoke may become. Its box grows where smoke goes; smoke that "
        "would need more dissolves before the box ends. 1 keeps the box"
    )
    use_buoyancy: tick("Buoyancy")("Choose Buoyancy by hand; otherwise it is that of the clip's smoke")
    buoyancy: number("Buoyancy", unit="ACCELERATION", default=1.0, soft_min=-10.0, soft_max=10.0)(
        "Upward acceleration of smoke of density 1 in the clip's own scale; below zero it sinks"
    )
    use_dissipation: tick("Dissipation")("Choose Dissipation by hand; otherwise it is that of the clip's smoke")
    dissipation: number("Dissipation", min=0.0, soft_max=5.0)(
        "How fast smoke dissolves, per second: 0 keeps it, at 1 a third is left after a second"
    )
    effectors: link("Effectors", bpy.types.Collection)(
        "Collection of what acts on the smoke: closed meshes, which may be animated, are obstacles; Wind and "
        "Turbulence force fields are wind and turbulence. An Empty, a Force field or a Wind field with Max Distance "
        "is a fan, which blows along its Z axis. Strength is m/s"
    )
    fan_speed: number("Fan Speed", unit="VELOCITY", default=1.0, soft_min=-10.0, soft_max=10.0)(
        "Velocity of the air in Empties that have no force field"
    )
    speed: _speed("Speed", "Speed of the smoke: 0.5 is half as fast", 0.5)
    use_ramp: tick("Ramp", update=synchronize_playback)(
        "Change the speed from the first frame to the middle and to the last"
    )
    speed_middle: _speed("Middle", "Speed in the middle of the result", 0.5)
    speed_end: _speed("End", "Speed at the last frame", 1.0)
    live: tick("Preview", update=synchronize_playback)(
        "Play the result on show at this speed now. Retime Smoke, or Frames Between in Advanced, makes the frames in "
        "between"
    )
    use_part: tick("Part", update=_part_chosen)("Loop a part of the result, in which the smoke is steady")
    part_first: whole("First", default=1)("First frame of the part, counted as Frames of the clip")
    part_last: whole("Last", default=48)("Last frame of the part, counted as Frames of the clip")
    overlap: whole("Overlap", min=0)(
        "Frames in which the end becomes the start; automatic is a third of the loop, 24 at most"
    )
    use_overlap: automatic_unless("overlap", "Overlap", 12)

    def speeds(self) -> tuple[float, ...]:
        """One speed, or those of a ramp."""
        return (self.speed, self.speed_middle, self.speed_end) if self.use_ramp else (self.speed,)


@operator("Direct Smoke", needs_clip, needs_result, bl_options={"UNDO"})
def direct(_context: bpy.types.Context, smoke: bpy.types.Object) -> None:
    """Make a new result of the one on show: longer, at another speed, or repeating. The one on show stays"""
    run_queue.enqueue(smoke, smoke_takes.write_directed(smoke))


def _may_act(context: bpy.types.Context, smoke: bpy.types.Object) -> list[bpy.types.Object]:
    box = smoke.smokelift.box
    return [obj for obj in context.selected_objects if obj != box and obj.type in {*MESHES, "EMPTY"}]


_needs_effector = Need("Select a mesh, a Wind or Turbulence force field, or an Empty", _may_act)


@operator("Add Selected to Effectors", needs_result, _needs_effector, bl_options=UNDO)
def add_effectors(context: bpy.types.Context, smoke: bpy.types.Object) -> None:
    """Let the selected objects act on the smoke: put them into the collection of effectors, which is made if need be"""
    settings = smoke.smokelift.directing
    if settings.effectors is None:
        settings.effectors = bpy.data.collections.new(EFFECTORS)
        context.scene.collection.children.link(settings.effectors)
    for obj in _may_act(context, smoke):
        if obj.name not in settings.effectors.objects:
            settings.effectors.objects.link(obj)


@panels("direct", "Direct", needs_result)
def _draw_direct(layout: bpy.types.UILayout, context: bpy.types.Context, smoke: bpy.types.Object) -> None:
    settings = smoke.smokelift.directing
    row = layout.row()
    row.use_property_split = False
    row.prop(settings, "direction", expand=True)
    if settings.direction == "continue":
        lines = LINES
        draw_settings(layout, settings, "frames", "fade")
        draw_ticked(layout, settings, "use_start", "start")
        draw_automatic(layout, settings, "buoyancy")
        draw_automatic(layout, settings, "dissipation")
        layout.prop(settings, "room")
        draw_closed(layout, settings)
        layout.prop(settings, "effectors")
        layout.operator("smokelift.add_effectors", icon="ADD")
        draw_settings(layout, settings, "fan_speed", active=settings.effectors is not None)
    elif settings.direction == "retime":
        lines = 6 if CAN_INTERPOLATE else 5
        draw_settings(layout, settings, "speed", "use_ramp")
        draw_settings(layout, settings, "speed_middle", "speed_end", active=settings.use_ramp)
        layout.prop(settings, "live")
        if CAN_INTERPOLATE:
            draw_settings(layout, smoke.smokelift, "between", active=settings.live)
    else:
        lines = 2
        draw_ticked(layout, settings, "use_part", "part_first", "part_last")
        draw_automatic(layout, settings, "overlap")
    for _ in range(LINES - lines):
        layout.label(text="")
    label = settings.bl_rna.properties["direction"].enum_items[settings.direction].name
    row = layout.row()
    row.scale_y = 1.5
    text = iface_("{:s} Smoke").format(iface_(label))
    row.operator("smokelift.direct", text=text, translate=False, icon="PLAY")
    run = run_queue.running()
    if run is not None and run.smoke == smoke.session_uid:
        draw_progress(layout, run.job, "smokelift.cancel").take = str(run.take.directory)


class ExportSettings:
    folder: string("Folder", subtype="DIR_PATH", options=PATH_OPTIONS)(
        "Folder for the export; by default export_ and the program's name, beside the results"
    )
    host: choice("For")(
        "Program that reads the files",
        ("blender", "Blender", "And other programs with Z up: grids density and velocity"),
        ("houdini", "Houdini", "Y up, grids density and vel"),
        ("unreal", "Unreal", "Densities from 0 to 1 for 8 bits, and a pivot that stays in place"),
    )
    precision: choice("Precision")(
        "Bits of each value. Smoke too thin to be seen is left out either way",
        ("half", "Half", "Floats of 16 bits"),
        ("quantized", "Quantized", "As few bits as a picture of 8 bits needs: half the size"),
    )
    use_velocity: tick("Velocity", default=True)("Export the velocity, which motion blur needs")
    proxy: choice("Proxy")(
        "Second, coarser sequence for the viewports of those who get the export",
        ("1", "None", "No proxy"),
        ("2", "1/2", "Half the resolution, an eighth of the voxels"),
        ("4", "1/4", "A quarter of the resolution"),
    )


@operator("Export Smoke", needs_rest, needs_result)
def export(_context: bpy.types.Context, smoke: bpy.types.Object) -> None:
    """Write small OpenVDB files of the smoke, a USD file of them, and for Blender an asset to be used in other files"""

    def add_asset(smoke: bpy.types.Object) -> None:
        if smoke.smokelift_export.host == "blender":
            write_asset(smoke, folder_of(smoke))

    write_files(smoke, "smokelift.export", arguments(smoke), add_asset)


@operator("Make Proxy", needs_rest, needs_result)
def make_proxy(_context: bpy.types.Context, smoke: bpy.types.Object) -> None:
    """Write coarse copies of the smoke's files, which viewports show in their place. Renders use the smoke itself"""

    def show_proxy(smoke: bpy.types.Object) -> None:
        volume.show(smoke, volume.shown_take(smoke))

    write_files(smoke, "smokelift.make_proxy", ["proxy", str(volume.shown_take(smoke).directory)], show_proxy)


@operator("Stop Writing", needs_smoke, bl_options={"INTERNAL"})
def stop_writing(_context: bpy.types.Context, _smoke: bpy.types.Object) -> None:
    """Stop writing these files"""
    writing_job.stop()


@panels("export", "Export", needs_result)
def _draw_export(layout: bpy.types.UILayout, context: bpy.types.Context, smoke: bpy.types.Object) -> None:
    settings = smoke.smokelift_export
    layout.prop(settings, "folder", placeholder=str(folder_of(smoke)))
    draw_settings(layout, settings, "host", "precision", "use_velocity", "proxy")
    draw_text(layout, export_size(smoke), "DISK_DRIVE")
    draw_work(layout, smoke, "smokelift.export", "EXPORT")
    layout.operator("smokelift.add_instance", icon="DUPLICATE")


_needs_sequence = Need(
    "Select a Volume that plays a sequence",
    lambda context, _: context.object and context.object.type == "VOLUME" and context.object.data.is_sequence,
)
_needs_no_driver = Need(
    "Set Speed to Frame by Frame first",
    lambda context, _: not (context.object.data.animation_data and context.object.data.animation_data.drivers),
)
IN_TIME = {
    "offset": whole("Time Offset", default=12)("Frames by which the new object plays later; below 0 earlier"),
    "repeat": tick("Repeat")("Play the frames again and again, as for a loop"),
}


@operator("Instance in Time", _needs_sequence, _needs_no_driver, bl_options=UNDO, given=IN_TIME)
def add_instance(context: bpy.types.Context, _smoke: bpy.types.Object | None, offset: int, repeat: bool) -> None:
    """Add another object that plays the active Volume's files later or earlier. The material is shared"""
    instance = copy_of(context.object, offset, repeat)
    context.collection.objects.link(instance)
    activate(instance, context.scene)
