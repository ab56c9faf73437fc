"""The sub-panel Direct: what is made of the result on show, and the button that does it."""

from typing import Any

import bpy
from bpy.app.translations import pgettext_iface as iface_

from ..core.contract import FASTEST, SLOWEST
from ..result import run_queue, smoke_takes
from ..result.directing import MESHES, frames_of_result
from ..scene.modifiers import CAN_INTERPOLATE
from .common import (
    UNDO,
    Need,
    automatic_unless,
    choice,
    closed_sides,
    link,
    needs_clip,
    needs_result,
    number,
    operator,
    panels,
    speed_changed,
    tick,
    whole,
)
from .layout import draw_automatic, draw_closed, draw_progress, draw_settings, draw_ticked

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
    return number(name, default=default, update=speed_changed, **limits)(description)


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
    use_ramp: tick("Ramp", update=speed_changed)("Change the speed from the first frame to the middle and to the last")
    speed_middle: _speed("Middle", "Speed in the middle of the result", 0.5)
    speed_end: _speed("End", "Speed at the last frame", 1.0)
    live: tick("Preview", update=speed_changed)(
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
    """The selected objects that may act on the smoke."""
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
