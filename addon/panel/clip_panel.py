"""The clip in the tab: its frames, its background, its mask and its lens."""

import os
from contextlib import suppress

import bpy

from ..core import ShotError
from ..result import smoke_takes
from ..result.shot_check import state
from ..scene import shot_setup
from ..scene.blender import absolute, file_of, frame_rate, iface_, relative, rpt_
from ..scene.clip import frame_count, shown_frame, unseen_pictures, used_range
from ..scene.pictures import is_distorted, undistorted
from ..scene.smoke import active_smoke, free_folder, new_smoke
from . import editors
from .common import FILE, HIDDEN, UNDO, ChoosesFile, Need, needs_clip, operator
from .editors import open_tab
from .layout import draw_hint, draw_text
from .settings import automatic_unless, choice, link, number, string, vector, whole

UNCHANGED = ("first", "last", "folder", "fps", "plate_frames")  # settings that a clip of the same frames keeps


def _clip_chosen(settings: bpy.types.PropertyGroup, context: bpy.types.Context) -> None:
    """Use all frames of a new clip, none of the old one's, and a folder that no other smoke has."""
    if settings.clip is None:
        return
    settings.first, settings.last = 1, max(1, settings.clip.frame_duration)
    settings.plate_frames = ""
    settings.property_unset("plate_color")
    settings.folder, settings.results = free_folder(settings.id_data), ""


def _background_chosen(settings: bpy.types.PropertyGroup, _context: bpy.types.Context) -> None:
    """Begin with the color that a reading of the clip found, unless one was chosen before."""
    found = state.found_color(settings.id_data)
    if settings.plate_mode == "COLOR" and found is not None and not settings.is_property_set("plate_color"):
        settings.plate_color = found


class ClipSettings:
    """The clip, what is behind its smoke, and where its smoke may be."""

    clip: link("Clip", bpy.types.MovieClip, update=_clip_chosen)("Footage of smoke: a video or an image sequence")
    first: whole("First", default=1, min=1)(
        "First frame of the clip to use, counted from 1 as Blender does; the command line counts from 0"
    )
    last: whole("Last", default=1, min=1)(
        "Last frame of the clip to use, counted from 1 as Blender does; the command line counts from 0"
    )
    plate_mode: choice("Background", update=_background_chosen)(
        "The picture without smoke",
        ("ESTIMATE", "From the Clip", "Estimate the background from frames where no smoke covers it"),
        ("FILE", "Clean Plate", "Picture of the same view without smoke; for a moving camera, one for each frame"),
        ("FRAMES", "Frames", "Frames of the clip in which there is no smoke"),
        ("COLOR", "Color", "One color, as behind stock footage on black; at first the one that the clip shows"),
    )
    plate_color: vector("Background Color", subtype="COLOR", min=0.0, soft_max=1.0)(
        "Color of all that is behind the smoke"
    )
    plate: string("Clean Plate")(
        "Picture of the same view without smoke. For a moving camera: a video, or the first image of a sequence, with "
        "one image for each frame of the clip"
    )
    plate_frames: string("Frames")("Frames of the clip without smoke, counted from 1 and separated by commas")
    strokes: link("Strokes", bpy.types.Image)(
        "Image of the clip's size: painted green where smoke is, red where none is, blue where a pixel shows the "
        "background. Nothing is said of the rest, which is transparent"
    )
    drawn_mask: link("Mask", bpy.types.Mask)(
        "Mask of the Clip Editor: smoke may be inside its lines, or outside those of a layer that is inverted, and "
        "nowhere else, whatever moves there"
    )
    mask: string("Mask File")(
        "Picture that is white where smoke may be and black where none is, whatever moves there; or a video, or "
        "mask_####.png, with one for each frame of the clip"
    )
    fps: number("Frame Rate", min=0.0, soft_max=1000.0)(
        "Frame rate at which the clip was filmed, if it plays in slow motion; automatic is the clip's own"
    )
    use_fps: automatic_unless("fps", "Frame Rate", 120.0)
    transfer: choice("Color Space")(
        "Color space of the clip",
        ("AUTO", "From the Clip", "As the clip's settings in the Movie Clip Editor say"),
        ("srgb", "sRGB", "Ordinary video and pictures"),
        ("linear", "Linear Rec.709", "Proportional to light"),
    )


def _add_dropped(this: bpy.types.Operator, context: bpy.types.Context, event: bpy.types.Event) -> set[str]:
    return this.execute(context) if this.filepath else ChoosesFile.invoke(this, context, event)


@operator("Smoke from Video", base=ChoosesFile, given={"filepath": FILE}, bl_options=UNDO, invoke=_add_dropped)
def add(context: bpy.types.Context, _smoke: bpy.types.Object | None, filepath: str) -> None:
    """Add smoke that is made from a video or an image sequence"""
    clip = None
    with suppress(RuntimeError):
        clip = bpy.data.movieclips.load(filepath, check_existing=True)
    if clip is None or clip.frame_duration < 1:  # Blender takes any file for a clip
        if clip is not None and clip.users == 0:
            bpy.data.movieclips.remove(clip)
        raise ShotError(rpt_("{:s} is no video and no picture that Blender can read: choose another.").format(filepath))
    new_smoke(context.scene, clip)
    if not bpy.app.background and context.area is not None and context.area.type == "VIEW_3D":
        open_tab(context.area)


@operator("Use All Files", needs_clip, bl_options=UNDO)
def use_all_files(_context: bpy.types.Context, smoke: bpy.types.Object) -> None:
    """Use all pictures of the sequence, also those after missing ones, where it ends for Blender"""
    smoke.smokelift.last = frame_count(smoke.smokelift.clip)


@operator("Match Scene to Clip", needs_clip, bl_options=UNDO)
def match_clip(_context: bpy.types.Context, smoke: bpy.types.Object) -> None:
    """Set the scene's resolution and frame rate to the clip's, and its length to the result's or its part in use"""
    shot_setup.match_clip(smoke)


_needs_distortion = Need(
    "The clip's lens has no distortion: calibrate it in the Movie Clip Editor",
    lambda _, smoke: is_distorted(smoke.smokelift.clip),
)


@operator("Undistort Clip", needs_clip, _needs_distortion, bl_options=UNDO)
def undistort(_context: bpy.types.Context, smoke: bpy.types.Object) -> None:
    """Write the clip without its lens's distortion, and use that. Blender waits meanwhile"""
    settings = smoke.smokelift
    if settings.plate_mode == "FILE":
        raise ShotError("The clean plate is distorted too: choose Background: From the Clip first.")
    if settings.mask or settings.drawn_mask is not None:
        raise ShotError("The mask is distorted too: clear it, and draw one over the undistorted clip.")
    if settings.strokes is not None:
        raise ShotError("The strokes are distorted too: clear them, and paint new ones afterwards.")
    clip, unchanged = settings.clip, {name: getattr(settings, name) for name in UNCHANGED}
    folder = smoke_takes.output_folder(smoke) / "undistorted"
    try:
        settings.clip = undistorted(clip, folder)
    except RuntimeError:
        raise ShotError(rpt_("{:s} cannot be written to: choose another Output.").format(str(folder))) from None
    if clip.source == "MOVIE" and not unchanged["fps"]:
        unchanged["fps"] = clip.fps  # pictures have no rate of their own
    for name, value in unchanged.items():
        setattr(settings, name, value)


@operator("Plate from This Frame", needs_clip, bl_options=UNDO)
def plate_from_frame(_context: bpy.types.Context, smoke: bpy.types.Object) -> None:
    """Take this frame of the clip, in which there is no smoke, as the clean plate. More frames lessen the noise"""
    settings = smoke.smokelift
    number = shown_frame(smoke)
    chosen = settings.plate_frames.replace(",", " ").split() if settings.plate_mode == "FRAMES" else []
    if str(number) not in chosen:
        chosen.append(str(number))
    settings.plate_frames, settings.plate_mode = ", ".join(chosen), "FRAMES"


def _ask_beside_clip(this: bpy.types.Operator, context: bpy.types.Context, event: bpy.types.Event) -> set[str]:
    settings = active_smoke(context.scene).smokelift
    chosen = getattr(settings, this.setting)
    this.filepath = str(absolute(chosen)) if chosen else f"{file_of(settings.clip).parent}{os.sep}"
    return ChoosesFile.invoke(this, context, event)


PICTURE = {"filepath": FILE, "setting": HIDDEN}


@operator("Choose Picture", needs_clip, base=ChoosesFile, given=PICTURE, bl_options=UNDO, invoke=_ask_beside_clip)
def choose_picture(_context: bpy.types.Context, smoke: bpy.types.Object, filepath: str, setting: str) -> None:
    """Choose a picture or a video; those of the clip's folder come first"""
    setattr(smoke.smokelift, setting, relative(absolute(filepath)))


@operator("Clear Frames", needs_clip, bl_options=UNDO)
def clear_plate_frames(_context: bpy.types.Context, smoke: bpy.types.Object) -> None:
    """Take none of these frames as the clean plate"""
    smoke.smokelift.plate_frames, smoke.smokelift.plate_mode = "", "ESTIMATE"


@operator("New Mask", needs_clip, bl_options=UNDO)
def new_mask(context: bpy.types.Context, smoke: bpy.types.Object) -> None:
    """Draw over the clip, in the Clip Editor, where smoke may be. Where the mask is black there is none"""
    settings = smoke.smokelift
    if settings.drawn_mask is None:
        mask = bpy.data.masks.new(smoke.name)
        mask.layers.new(name="Smoke")
        mask.frame_start, mask.frame_end = context.scene.frame_start, context.scene.frame_end
        settings.drawn_mask = mask
    first, last = used_range(settings)
    if not first <= context.scene.frame_current <= last:
        context.scene.frame_set(first)  # what is drawn on a frame that is not used helps little
    editors.show_clip(settings.clip, settings.drawn_mask)


@operator("Show Clip", needs_clip)
def show_clip(_context: bpy.types.Context, smoke: bpy.types.Object) -> None:
    """Open the clip in the Clip Editor, to choose its frames, track its camera, or stabilize it (Stabilization)"""
    editors.show_clip(smoke.smokelift.clip)


def draw_clip(layout: bpy.types.UILayout, context: bpy.types.Context, smoke: bpy.types.Object) -> None:
    scene, settings = context.scene, smoke.smokelift
    clip = settings.clip
    if not file_of(clip).is_file():
        draw_text(layout, "{:s} is not there: choose the clip again.", "ERROR", str(file_of(clip)))
    row = layout.row(align=True)
    row.prop(settings, "first", text="Frames")
    row.prop(settings, "last", text="")
    row.operator("smokelift.show_clip", text="", icon="FILE_MOVIE")
    if (found := unseen_pictures(settings)) is not None:
        column = layout.column(align=True)
        if found.missing:
            draw_text(column, "Missing: {:s}.", "ERROR", found.missing_names())
        if settings.last < found.count:
            icon = "BLANK1" if found.missing else "INFO"
            draw_text(column, "Blender sees {:d} of {:d} frames.", icon, clip.frame_duration, found.count)
            column.operator("smokelift.use_all_files")
        else:
            draw_text(column, "A neighboring picture stands in for each.", "BLANK1")
    if is_distorted(clip):
        text = "The clip's lens bends lines, and smoke is made for one that does not: undistort it."
        draw_hint(layout, text, "smokelift.undistort")
    said, size = [], (scene.render.resolution_x, scene.render.resolution_y)
    if size != tuple(clip.size):
        said.append(iface_("The clip has {:d} x {:d} pixels, the scene {:d} x {:d}.").format(*clip.size, *size))
    if clip.source == "MOVIE" and abs(clip.fps - frame_rate(scene)) > 0.01:  # pictures have no rate of their own
        text = iface_("The clip has {:g} frames per second, the scene {:g}.")
        said.append(text.format(clip.fps, frame_rate(scene)))
    if said:
        draw_hint(layout, " ".join(said), "smokelift.match_clip")


def draw_mask(layout: bpy.types.UILayout, settings: bpy.types.PropertyGroup) -> None:
    """The mask that is drawn, and which side of it is smoke; without one, the field for a file."""
    drawn = settings.drawn_mask is not None
    row = layout.row(align=True)
    row.prop(settings, "drawn_mask")
    row.operator("smokelift.new_mask", text="" if drawn else "New", icon="GREASEPENCIL" if drawn else "ADD")
    if drawn:
        layout.label(text="Smoke may be inside its lines", icon="INFO")
    else:
        draw_picture(layout, settings, "mask", iface_("white may be smoke"))


def draw_picture(layout: bpy.types.UILayout, settings: bpy.types.PropertyGroup, name: str, placeholder: str) -> None:
    """The path of a picture, and the button that chooses it: Blender's own would list all files."""
    row = layout.row(align=True)
    row.prop(settings, name, text=" ", placeholder=placeholder)
    row.operator("smokelift.choose_picture", text="", icon="FILEBROWSER").setting = name


def _draw_add(menu: bpy.types.Menu, _context: bpy.types.Context) -> None:
    menu.layout.operator("smokelift.add", text="Smoke from Video...", icon="FILE_MOVIE")


HANDLERS = ((bpy.types.VIEW3D_MT_volume_add, _draw_add),)
