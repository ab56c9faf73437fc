"""Pictures that Blender's own compositor makes of a clip: without its lens's distortion, and of masks drawn over it.

The engine's camera is a pinhole. Where the clip's lens was calibrated in the Movie Clip Editor, such a camera films the
undistorted pictures. A mask is white where smoke may be, as the Clip Editor shows it, for every frame if it moves; what
is half white and more counts as white.
"""

import hashlib
import shutil
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import bpy

from ..core import ShotError
from .blender import absolute
from .clip import frame_count
from .nodes import SINCE_5, Socket, Tree, add_node, compositor, set_kind
from .smoke import scene_of

UNDISTORTED_BITS, FILMED_BITS = "16", "8"  # per channel of a picture that is computed anew, and as it was filmed

COEFFICIENTS = {
    "POLYNOMIAL": ("k1", "k2", "k3"),
    "DIVISION": ("division_k1", "division_k2"),
    "NUKE": ("nuke_k1", "nuke_k2"),
    "BROWN": ("brown_k1", "brown_k2", "brown_k3", "brown_k4", "brown_p1", "brown_p2"),
}
"""Names of a lens's coefficients by its distortion model."""

PATTERN = "mask_####.png"  # names of the pictures of a mask that moves; without the number of one that does not


@contextmanager
def picture_scene(clip: bpy.types.MovieClip) -> Iterator[tuple[bpy.types.Scene, Tree, Socket]]:
    """A scene of its own that renders PNG of a clip's size, the nodes of its compositor, and what they are shown by."""
    scene = bpy.data.scenes.new("Smokelift Pictures")
    scene.camera = bpy.data.objects.new("Smokelift Pictures", bpy.data.cameras.new("Smokelift Pictures"))
    tree, shown = compositor(scene)
    try:
        scene.collection.objects.link(scene.camera)
        render = scene.render
        render.resolution_x, render.resolution_y, render.resolution_percentage = *clip.size, 100
        render.image_settings.file_format = "PNG"
        for node in [node for node in tree.nodes if node.type == "R_LAYERS"]:
            tree.nodes.remove(node)
        yield scene, tree, shown
    finally:
        bpy.data.objects.remove(scene.camera)
        bpy.data.scenes.remove(scene)
        if SINCE_5:
            bpy.data.node_groups.remove(tree)


def write_pictures(clip: bpy.types.MovieClip, first: int, last: int, prefix: Path, undistort: bool = False) -> Path:
    """Write frames of a clip as PNG, numbers after the prefix; returns the first one. RuntimeError if that fails."""
    with picture_scene(clip) as (scene, tree, shown):
        scene.frame_start, scene.frame_end = first, last
        scene.view_settings.view_transform = "Standard"
        scene.render.filepath = str(prefix)
        picture = scene.render.image_settings
        picture.color_mode, picture.color_depth = "RGB", UNDISTORTED_BITS if undistort else FILMED_BITS
        pictures = add_node(tree, "CompositorNodeMovieClip", 0, 0, clip=clip).outputs["Image"]
        if undistort:
            lens = add_node(tree, "CompositorNodeMovieDistortion", 1, 0, pictures, clip=clip)
            set_kind(lens, "Undistort", "distortion_type")
            pictures = lens.outputs["Image"]
        tree.links.new(pictures, shown)
        bpy.ops.render.render(animation=True, scene=scene.name)
        return Path(scene.render.frame_path(frame=first))


def is_distorted(clip: bpy.types.MovieClip) -> bool:
    """Whether a clip's lens was calibrated, and bends lines."""
    lens = clip.tracking.camera
    return any(getattr(lens, name) != 0.0 for name in COEFFICIENTS.get(lens.distortion_model, ()))


def undistorted(clip: bpy.types.MovieClip, folder: Path) -> bpy.types.MovieClip:
    """Write a clip's undistorted pictures (PNG, 16 bits) into a folder; returns them as a clip of the same frames."""
    last = clip.frame_start + clip.frame_duration - 1
    first = write_pictures(clip, clip.frame_start, last, folder / "undistorted_", undistort=True)
    made = bpy.data.movieclips.load(str(first))
    made.name = f"{clip.name} undistorted"
    made.frame_start = clip.frame_start
    for name in ("sensor_width", "focal_length", "pixel_aspect"):
        setattr(made.tracking.camera, name, getattr(clip.tracking.camera, name))
    return made


def mask_path(smoke: bpy.types.Object, quick: bool) -> Path | None:
    """The picture of a smoke's mask, or the pattern of those that it has for every frame; None without a mask.

    A ``quick`` one is of the current frame only. ShotError if the file is missing, or nothing is drawn.
    """
    settings = smoke.smokelift
    if settings.drawn_mask is not None:
        return _drawn(smoke, quick)
    if not settings.mask:
        return None
    file = absolute(settings.mask)
    if "#" not in file.name and not file.is_file():  # a pattern is no file; the engine says what it finds
        raise ShotError(f"The mask {file} is not there: choose it again, or clear Mask.")
    return file


def _drawn(smoke: bpy.types.Object, quick: bool) -> Path:
    """The pictures of a drawn mask, in a folder of this session that keeps them until another is drawn."""
    mask, clip = smoke.smokelift.drawn_mask, smoke.smokelift.clip
    shown = [layer for layer in mask.layers if not layer.hide_render]
    if not any(line.use_cyclic for layer in shown for line in layer.splines):
        raise ShotError(
            f"The mask {mask.name} has no closed line yet: in the Clip Editor, Ctrl-click around where smoke may be, "
            "and close the line by Alt C. Or clear Mask."
        )
    # the engine counts the frames of the file, also those before the first that Blender shows
    before, count = clip.frame_start - clip.frame_offset, clip.frame_offset + frame_count(clip)
    frames = [scene_of(smoke).frame_current] if quick else [before + number for number in range(count)]
    with picture_scene(clip) as (scene, tree, output):
        shapes = [_shape(scene, mask, frame) for frame in frames]
        moves = len(set(shapes)) > 1
        looks = shapes if moves else shapes[:1]
        key = hashlib.sha256(repr((clip.size[:], looks)).encode()).hexdigest()[:16]
        folder = Path(bpy.app.tempdir) / f"smokelift_mask_{key}"
        found = folder / (PATTERN if moves else PATTERN.replace("_####", ""))
        files = [Path(str(found).replace("####", f"{number:04d}")) for number in range(len(looks))]
        if files[-1].is_file():
            return found
        if bpy.app.is_job_running("RENDER"):
            raise ShotError("Blender renders, and the mask has to be drawn: wait for its end.")
        tree.links.new(add_node(tree, "CompositorNodeMask", 0, 0, mask=mask).outputs[0], output)
        scene.view_settings.view_transform = "Raw"
        scene.render.image_settings.color_mode = "BW"
        scene.render.dither_intensity = 0.0  # noise, which takes a third of the time
        scene.render.filepath = str(folder / "drawn_")
        made: dict[str, Path] = {}
        for frame, shape, file in zip(frames, looks, files, strict=False):
            if shape in made:
                shutil.copyfile(made[shape], file)
                continue
            scene.frame_start = scene.frame_end = frame
            try:  # as an animation of one frame, since a still shows masks as they are in the window
                bpy.ops.render.render(animation=True, scene=scene.name)
            except RuntimeError as error:
                raise ShotError(f"The mask cannot be drawn: {error}") from error
            made[shape] = Path(scene.render.frame_path(frame=frame)).replace(file)
    return found


def _shape(scene: bpy.types.Scene, mask: bpy.types.Mask, frame: int) -> str:
    scene.frame_set(frame)
    layers = mask.evaluated_get(scene.view_layers[0].depsgraph).layers
    points = [point for layer in layers for line in layer.splines for point in line.points]
    followed = frame if any(point.parent.id is not None for point in points) else None  # a track moves it
    return repr(([_values(layer) for layer in layers], followed))


def _values(part: Any) -> list[Any]:
    """The values of a part of a mask and of all that is in it, but for what is selected."""
    found = []
    for setting in part.bl_rna.properties:
        value = getattr(part, setting.identifier)
        if setting.type == "COLLECTION":
            found.append([_values(each) for each in value])
        elif setting.type != "POINTER" and not setting.identifier.startswith("select"):
            found.append(value[:] if getattr(setting, "is_array", False) else value)
    return found
