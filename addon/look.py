"""Making the scene look like the clip: its size and speed, its background, its light, its colours.

Everything that is made here has a name of its own and is found again by it, so that doing it twice changes nothing.
"""

import math
import re
from pathlib import Path
from typing import Any

import bpy
from mathutils import Matrix, Vector

from .take import Take

NAME = "Smokelift"
SENSOR = 36.0


def match_clip(scene: bpy.types.Scene) -> None:
    """Give the scene the clip's size, frame rate and length."""
    clip = scene.smokelift.clip
    render = scene.render
    render.resolution_x, render.resolution_y = clip.size
    if clip.source == "MOVIE" and clip.fps > 0.0:
        render.fps = math.ceil(clip.fps - 1e-3)
        render.fps_base = render.fps / clip.fps
    scene.frame_start = clip.frame_start
    scene.frame_end = clip.frame_start + clip.frame_duration - 1


def set_up(scene: bpy.types.Scene, take: Take, index: dict[str, Any]) -> None:
    """Make a Cycles render from the camera look like the clip.

    Parameters
    ----------
    scene
        It has the smoke already.
    take, index
        What the smoke was made from.
    """
    match_clip(scene)
    scene.camera = guessed_camera(scene, index) or scene.camera
    _show_clip_behind(scene.camera.data, scene.smokelift.clip)
    if scene.smokelift.light_mode == "ESTIMATE":
        _estimated_sun(scene, index)
    _plate_world(scene, take, index["scene"])
    scene.render.engine = "CYCLES"
    scene.view_settings.view_transform = "Standard"
    scene.view_settings.look = "None"
    scene.view_settings.exposure, scene.view_settings.gamma = 0.0, 1.0


def guessed_camera(scene: bpy.types.Scene, index: dict[str, Any]) -> bpy.types.Object | None:
    """The camera that the engine took for granted, made or moved; None if the scene's own was used."""
    if scene.smokelift.camera_mode != "GUESS":
        return None
    table = index["scene"]["camera"]
    name = f"{NAME} Camera"
    camera = scene.objects.get(name)
    if camera is None or camera.type != "CAMERA":
        camera = bpy.data.objects.new(name, bpy.data.cameras.new(name))
        scene.collection.objects.link(camera)
    camera.matrix_world = Matrix(table["matrix"])
    camera.data.sensor_fit = "AUTO"
    camera.data.sensor_width = SENSOR
    camera.data.lens = table["fx"] * SENSOR / max(table["size"])
    if scene.camera is None:
        scene.camera = camera
    return camera


def _show_clip_behind(camera: bpy.types.Camera, clip: bpy.types.MovieClip) -> None:
    camera.show_background_images = True
    if any(behind.source == "MOVIE_CLIP" and behind.clip == clip for behind in camera.background_images):
        return
    behind = camera.background_images.new()
    behind.source = "MOVIE_CLIP"
    behind.clip = clip
    behind.alpha = 1.0
    behind.display_depth = "BACK"


def _estimated_sun(scene: bpy.types.Scene, index: dict[str, Any]) -> None:
    """The light that the engine assumed: it reaches all of the smoke, so it throws no shadows."""
    table = index["scene"]["lights"][0]
    name = f"{NAME} Light"
    sun = scene.objects.get(name)
    if sun is None or sun.type != "LIGHT":
        sun = bpy.data.objects.new(name, bpy.data.lights.new(name, "SUN"))
        scene.collection.objects.link(sun)
    strongest = max(table["irradiance"]) or 1.0
    sun.data.energy = strongest
    sun.data.color = [part / strongest for part in table["irradiance"]]
    sun.data.use_shadow = index["settings"]["density"]["scattering"] == "single"
    sun.rotation_euler = Vector(table["direction"]).to_track_quat("-Z", "Y").to_euler()


def _plate_world(scene: bpy.types.Scene, take: Take, tables: dict[str, Any]) -> None:
    """A world that shows the camera what is behind the smoke, and lights the smoke as the old one did."""
    world = scene.world
    if world is None or not world.name.startswith(NAME):
        if world is None:
            world = bpy.data.worlds.new(NAME)
        else:
            world.use_fake_user = True  # or it would not be saved any more
            world = world.copy()
            world.name, world.use_fake_user = NAME, False
        scene.world = world
    if world.node_tree is None:  # since 5.0 there always is one
        world.use_nodes = True
    nodes, links = world.node_tree.nodes, world.node_tree.links
    output = next((node for node in nodes if node.type == "OUTPUT_WORLD" and node.is_active_output), None)
    output = output or nodes.new("ShaderNodeOutputWorld")
    mix = nodes.get(NAME)
    if mix is None:
        mix = nodes.new("ShaderNodeMixShader")
        mix.name = mix.label = NAME
        mix.location = output.location - Vector((0.0, 200.0))
        if output.inputs["Surface"].links:
            links.new(output.inputs["Surface"].links[0].from_socket, mix.inputs[1])
        links.new(mix.outputs[0], output.inputs["Surface"])
        rays = nodes.new("ShaderNodeLightPath")
        links.new(rays.outputs["Is Camera Ray"], mix.inputs[0])
        seen = nodes.new("ShaderNodeBackground")
        links.new(seen.outputs[0], mix.inputs[2])
        for node, left in ((rays, 400.0), (seen, 200.0)):
            node.location = mix.location - Vector((left, 200.0))
    seen = mix.inputs[2].links[0].from_node
    picture = _wire_plate(world.node_tree, seen, take, tables.get("background") or {})
    if picture is not None:
        _play_plate(picture, scene.smokelift.clip, "matrices" in tables["camera"])


def _wire_plate(
    tree: bpy.types.NodeTree, seen: bpy.types.ShaderNode, take: Take, background: dict[str, Any]
) -> bpy.types.ShaderNode | None:
    """Show a clean plate or a colour; returns the plate's node."""
    colour = seen.inputs["Color"]
    if "image" not in background:
        for link in list(colour.links):
            tree.links.remove(link)
        colour.default_value = (*background.get("color", (0.0, 0.0, 0.0)), 1.0)
        return None
    if not colour.links:
        place = tree.nodes.new("ShaderNodeTexCoord")
        picture = tree.nodes.new("ShaderNodeTexImage")
        picture.extension = "EXTEND"
        tree.links.new(place.outputs["Window"], picture.inputs["Vector"])
        tree.links.new(picture.outputs["Color"], colour)
        for node, left in ((picture, 300.0), (place, 500.0)):
            node.location = seen.location - Vector((left, 0.0))
    path = Path(background["image"])
    path = path if path.is_absolute() else take.directory / path
    node = colour.links[0].from_node
    node.image = bpy.data.images.load(str(path), check_existing=True)
    return node


def _play_plate(node: bpy.types.ShaderNode, clip: bpy.types.MovieClip, tracked: bool) -> None:
    """Let a plate with a picture for every frame play beside the clip."""
    image, user = node.image, node.image_user
    number = re.search(r"(\d+)\.\w+$", image.filepath)
    if tracked and image.source == "FILE" and number:
        image.source = "SEQUENCE"
    if image.source == "FILE":
        return
    # Blender counts a sequence's pictures by the numbers in their names, and a video's frames from 1
    before = int(number[1]) - 1 if number and image.source == "SEQUENCE" else 0
    user.frame_start, user.frame_duration = clip.frame_start, clip.frame_duration
    user.frame_offset = before + clip.frame_offset
    user.use_auto_refresh = True
