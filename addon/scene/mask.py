"""The mask in a scene file: white where smoke may be, from a file or from a Mask that is drawn in the Clip Editor.

Blender's own compositor makes pictures of a drawn one, so they show what the Clip Editor does: white inside its lines,
or outside where a layer is inverted, for every frame if it moves. What is half white and more counts as white.
"""

import hashlib
import shutil
from pathlib import Path
from typing import Any

import bpy

from ..core import ShotError
from .blender import absolute
from .clip import frame_count
from .nodes import add_node
from .pictures import picture_scene
from .smoke import scene_of

PATTERN = "mask_####.png"  # names of the pictures of a mask that moves; without the number of one that does not

LAYER = ("alpha", "blend", "falloff", "invert", "hide_render", "use_fill_holes", "use_fill_overlap")

LINE = ("use_cyclic", "use_fill", "offset_mode", "weight_interpolation")

POINT = ("co", "handle_left", "handle_right", "weight")
"""What of layers, lines and points decides how a mask looks."""


def mask_path(smoke: bpy.types.Object, quick: bool = False) -> Path | None:
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
            if shape not in made:
                made[shape] = _rendered(scene, frame).replace(file)
            else:
                shutil.copyfile(made[shape], file)
    return found


def _rendered(scene: bpy.types.Scene, frame: int) -> Path:
    """Render a frame: as an animation of one, since a still shows masks as they are in the window."""
    scene.frame_start = scene.frame_end = frame
    try:
        bpy.ops.render.render(animation=True, scene=scene.name)
    except RuntimeError as error:
        raise ShotError(f"The mask cannot be drawn: {error}") from error
    return Path(scene.render.frame_path(frame=frame))


def _shape(scene: bpy.types.Scene, mask: bpy.types.Mask, frame: int) -> str:
    """How a mask looks in a frame, as a text to compare it by."""
    scene.frame_set(frame)
    layers = mask.evaluated_get(scene.view_layers[0].depsgraph).layers
    lines = [line for layer in layers for line in layer.splines]
    points = [point for line in lines for point in line.points]
    feather = [(each.u, each.weight) for point in points for each in point.feather_points]
    followed = frame if any(point.parent.id is not None for point in points) else None  # a track moves it
    parts = [_values(layers, LAYER), _values(lines, LINE), _values(points, POINT), feather, followed]
    return repr([*parts, [len(layer.splines) for layer in layers], [len(line.points) for line in lines]])


def _values(owners: Any, names: tuple[str, ...]) -> list[Any]:
    values = [getattr(owner, name) for owner in owners for name in names]
    return [tuple(value) if hasattr(value, "__len__") and not isinstance(value, str) else value for value in values]
