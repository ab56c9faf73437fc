"""The example in Blender as an artist would have set it up. For every Blender, with or without a window."""

import math
from pathlib import Path
from typing import Any

import bpy
from mathutils import Vector

EXAMPLE = Path(__file__).parent / "plume"
"""The example at two fifths of its size: what Blender and the engine do with it is the same, in half the time."""

FULL_SIZE = Path(__file__).parents[1] / "examples" / "plume"
"""The example itself, for pictures that are shown."""


def set_up_example(scene: bpy.types.Scene, folder: Path = EXAMPLE) -> bpy.types.Scene:
    """Give a scene the example's camera, box, sun, black world, clip and plate, at draft quality.

    Parameters
    ----------
    scene
        An empty one.
    folder
        Where the clip and the plate lie.
    """
    set_world(scene, (0.0, 0.0, 0.0))
    camera = add_camera(scene, (0.0, -7.0, 1.5), (math.pi / 2, 0.0, 0.0))
    camera.data.sensor_fit, camera.data.sensor_height = "VERTICAL", 24.0
    camera.data.lens = 12.0 / math.tan(math.radians(15.0))
    add_sun(scene, 20.0, Vector((0.57, 0.46, -0.68)).to_track_quat("-Z", "Y").to_euler())
    settings = smoke(scene).smokelift
    settings.clip = bpy.data.movieclips.load(str(folder / "clip.mp4"))
    settings.box = add_box(scene, (-1.0, -1.0, 0.0), (1.0, 1.0, 3.0))
    settings.plate_mode, settings.plate = "FILE", str(folder / "plate.png")
    settings.light_mode = "SCENE"
    settings.quality = "draft"
    scene.render.resolution_x, scene.render.resolution_y = 256, 384
    return scene


def smoke(scene: bpy.types.Scene) -> bpy.types.Object:
    """The smoke of a scene; if there is none, a new one."""
    for obj in scene.objects:
        if obj.type == "VOLUME" and obj.smokelift.is_smoke:
            return obj
    obj = add(scene, "Smoke", bpy.data.volumes.new("Smoke"))
    obj.smokelift.is_smoke = True
    return obj


def set_world(scene: bpy.types.Scene, color: tuple[float, float, float]) -> None:
    """Give a scene a new world of one color."""
    world = scene.world = bpy.data.worlds.new("World")
    if world.node_tree is None:
        world.use_nodes = True
    world.node_tree.nodes["Background"].inputs["Color"].default_value = (*color, 1.0)


def add(scene: bpy.types.Scene, name: str, data: Any) -> bpy.types.Object:
    """A new object in a scene."""
    obj = bpy.data.objects.new(name, data)
    scene.collection.objects.link(obj)
    return obj


def add_camera(scene: bpy.types.Scene, location: Any, rotation: Any = (0.0, 0.0, 0.0)) -> bpy.types.Object:
    """A new camera, the scene's own."""
    camera = scene.camera = add(scene, "Camera", bpy.data.cameras.new("Camera"))
    camera.location, camera.rotation_euler = location, rotation
    return camera


def add_sun(scene: bpy.types.Scene, energy: float, rotation: Any = (0.0, 0.0, 0.0)) -> bpy.types.Object:
    """A new sun."""
    sun = add(scene, "Sun", bpy.data.lights.new("Sun", "SUN"))
    sun.data.energy, sun.rotation_euler = energy, rotation
    return sun


def add_box(scene: bpy.types.Scene, low: Any, high: Any) -> bpy.types.Object:
    """A new box between two corners, as the add-on makes them."""
    mesh = bpy.data.meshes.new("Box")
    corners = [(x, y, z) for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)]
    edges = [(i, i | axis) for i in range(8) for axis in (1, 2, 4) if not i & axis]
    mesh.from_pydata(corners, edges, [])
    box = add(scene, "Box", mesh)
    box.location = (Vector(low) + Vector(high)) / 2
    box.scale = (Vector(high) - Vector(low)) / 2
    return box
