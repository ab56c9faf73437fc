"""The clean plate: the background in a scene file, and a picture in Blender in step with the clip."""

import re
from collections.abc import Callable
from typing import Any

import bpy
from mathutils import Color, Vector

from ..core import ShotError
from . import volume
from .blender import absolute, relative
from .clip import frame_count, number_in_file
from .nodes import Socket, Tree, add_node
from .strokes import saved_strokes

MARK = "smokelift_plate"  # custom property of pictures that a camera's view shows behind smoke
BACKGROUND = "Smokelift Background"  # name of a picture of one color


def background_table(smoke: bpy.types.Object) -> dict[str, Any]:
    """The table; empty where the engine estimates the background. ShotError if a picture or a frame is missing."""
    settings, table = smoke.smokelift, {}
    if settings.plate_mode == "FILE":
        if not settings.plate:
            raise ShotError("Choose the clean plate, or choose From the Clip.")
        file = absolute(settings.plate)
        if not file.is_file():
            raise ShotError(f"The clean plate {file} is not there: choose it again.")
        table["image"] = str(file)
    elif settings.plate_mode == "FRAMES":
        table["frame"] = [number_in_file(settings.clip, number) for number in _clean_frames(settings)]
    elif settings.plate_mode == "COLOR":
        table["color"] = list(settings.plate_color)
    if settings.strokes is not None:
        table["strokes"] = str(saved_strokes(settings.strokes, settings.clip))
    return table


def _clean_frames(settings: bpy.types.PropertyGroup) -> list[int]:
    """The chosen frames, counted from 1 as in the panel."""
    words = settings.plate_frames.replace(",", " ").split()
    if not words:
        raise ShotError("Go to a frame without smoke and press Plate from This Frame, or choose another Background.")
    count = frame_count(settings.clip)
    if not all(word.isdecimal() and 1 <= int(word) <= count for word in words):
        raise ShotError(
            f"Frames {settings.plate_frames} are not in the clip: it has frames 1 to {count}, separated by commas."
        )
    return sorted({int(word) for word in words})


def shown_background(smoke: bpy.types.Object) -> tuple[bpy.types.Image | None, tuple[float, float, float, float]]:
    """The plate of the result on show, by a path relative to the .blend where there is one; or None, and one color."""
    background = volume.shown(smoke).scene.get("background") or {}
    color = (*background.get("color", (0.0, 0.0, 0.0)), 1.0)
    if "image" not in background:
        return None, color
    file = volume.shown_take(smoke).directory / background["image"]
    image = bpy.data.images.load(str(file), check_existing=True)
    if image.filepath != relative(file):
        image.filepath = relative(file)
    return image, color


def show_plate(smoke: bpy.types.Object, tree: Tree, shader: bpy.types.ShaderNode, place: Callable[[], Socket]) -> None:
    """Have a shader show the clean plate of the result on show, or one color if the background is that.

    It has an input Color. If no texture is connected to that yet, ``place`` makes coordinates in the plate.
    """
    color, (image, shown) = shader.inputs["Color"], shown_background(smoke)
    if image is None:
        for link in list(color.links):
            tree.links.remove(link)
        color.default_value = shown
        return
    if not color.links:
        texture = add_node(tree, "ShaderNodeTexImage", -1.5, 0, place(), near=shader, extension="EXTEND")
        texture.inputs[0].links[0].from_node.location = shader.location - Vector((500.0, 0.0))
        tree.links.new(texture.outputs["Color"], color)
    node = color.links[0].from_node
    node.image = image
    synchronize_plate(smoke, image, node.image_user)


def show_plate_behind(smoke: bpy.types.Object, camera: bpy.types.Camera) -> None:
    """Show in the view through a camera what a render shows behind the smoke; the clip can be shown over it.

    The second time only the picture changes: what the artist shows or hides stays.
    """
    camera.show_background_images = True
    pictures, (plate, color) = camera.background_images, shown_background(smoke)
    image = plate or bpy.data.images.get(BACKGROUND) or bpy.data.images.new(BACKGROUND, 8, 8)
    if plate is None:
        image.generated_color = (*Color(color[:3]).from_scene_linear_to_srgb(), 1.0)
    image[MARK] = True
    picture = next((each for each in pictures if each.source == "IMAGE" and each.image and each.image.get(MARK)), None)
    if picture is None:
        if (clip := clip_behind(smoke, camera)) is not None:
            pictures.remove(clip)  # it would be below
        picture = _new_picture(camera, "IMAGE")
        picture.frame_method = "STRETCH"
        _new_picture(camera, "MOVIE_CLIP").clip = smoke.smokelift.clip
        clip_behind(smoke, camera).show_background_image = False
    picture.image = image
    if plate is not None:
        synchronize_plate(smoke, plate, picture.image_user)


def show_clip_behind(smoke: bpy.types.Object, camera: bpy.types.Camera) -> None:
    """Show the clip in the view through a camera, behind everything."""
    camera.show_background_images = True
    if clip_behind(smoke, camera) is None:
        _new_picture(camera, "MOVIE_CLIP").clip = smoke.smokelift.clip
    clip_behind(smoke, camera).show_background_image = True


def clip_behind(smoke: bpy.types.Object, camera: bpy.types.Camera) -> bpy.types.CameraBackgroundImage | None:
    """The clip in the view through a camera, shown or hidden; None without one."""
    clip = smoke.smokelift.clip
    found = (each for each in camera.background_images if each.source == "MOVIE_CLIP" and each.clip == clip)
    return next(found, None)


def _new_picture(camera: bpy.types.Camera, source: str) -> bpy.types.CameraBackgroundImage:
    picture = camera.background_images.new()
    picture.source, picture.alpha, picture.display_depth = source, 1.0, "BACK"
    return picture


def synchronize_plate(smoke: bpy.types.Object, image: bpy.types.Image, user: Any) -> None:
    """Keep a plate of many pictures in step with the clip; one of a moving camera has a picture for every frame.

    The user, an image user or a node of the compositor, says which of them is shown.
    """
    clip, tracked = smoke.smokelift.clip, "matrices" in volume.shown(smoke).scene["camera"]
    number = re.search(r"(\d+)\.\w+$", image.filepath)
    if tracked and image.source == "FILE" and number:
        image.source = "SEQUENCE"
    if image.source == "FILE":
        return
    # Blender counts the images of a sequence by the numbers in their names, and the frames of a video from 1
    before = int(number[1]) - 1 if number and image.source == "SEQUENCE" else 0
    user.frame_start, user.frame_duration = clip.frame_start, clip.frame_duration
    user.frame_offset = before + clip.frame_offset
    user.use_auto_refresh = True
