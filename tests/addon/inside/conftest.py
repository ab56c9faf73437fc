"""A Blender without a window, with the add-on registered, as new for every test."""

from __future__ import annotations

import math
import os
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import bpy
import pytest
from mathutils import Vector

import addon

EXAMPLE = Path(__file__).parents[3] / "examples" / "plume"


@pytest.fixture(autouse=True)
def blender(tmp_path, monkeypatch) -> Iterator[Any]:
    """An empty file; Blender's own talk goes to a log."""
    monkeypatch.chdir(tmp_path)
    bpy.ops.wm.read_factory_settings(use_empty=True)
    addon.register()
    yield bpy
    addon.unregister()


@pytest.fixture
def scene(blender) -> bpy.types.Scene:
    """The empty scene."""
    return bpy.context.scene


@pytest.fixture
def shot(scene) -> bpy.types.Scene:
    """The example as an artist would have it: camera, box, sun, black world, clip and plate."""
    world = scene.world = bpy.data.worlds.new("World")
    if world.node_tree is None:
        world.use_nodes = True
    world.node_tree.nodes["Background"].inputs["Color"].default_value = (0.0, 0.0, 0.0, 1.0)
    camera = add_camera(scene, (0.0, -7.0, 1.5), (math.pi / 2, 0.0, 0.0))
    camera.data.sensor_fit, camera.data.sensor_height = "VERTICAL", 24.0
    camera.data.lens = 12.0 / math.tan(math.radians(15.0))
    sun = add(scene, "Sun", bpy.data.lights.new("Sun", "SUN"))
    sun.data.energy = 18.0
    sun.rotation_euler = Vector((0.57, 0.46, -0.68)).to_track_quat("-Z", "Y").to_euler()
    settings = scene.smokelift
    settings.clip = bpy.data.movieclips.load(str(EXAMPLE / "clip.mp4"))
    settings.box = add_box(scene, (-1.0, -1.0, 0.0), (1.0, 1.0, 3.0))
    settings.plate_mode, settings.plate = "FILE", str(EXAMPLE / "plate.png")
    settings.light_mode = "SCENE"
    settings.quality = "draft"
    scene.render.resolution_x, scene.render.resolution_y = 256, 384
    return scene


def add(scene: bpy.types.Scene, name: str, data: Any) -> bpy.types.Object:
    """A new object in a scene."""
    thing = bpy.data.objects.new(name, data)
    scene.collection.objects.link(thing)
    return thing


def add_camera(scene: bpy.types.Scene, location: Any, rotation: Any = (0.0, 0.0, 0.0)) -> bpy.types.Object:
    """A new camera, the scene's own."""
    camera = scene.camera = add(scene, "Camera", bpy.data.cameras.new("Camera"))
    camera.location, camera.rotation_euler = location, rotation
    return camera


def add_box(scene: bpy.types.Scene, low: Any, high: Any) -> bpy.types.Object:
    """A new box between two corners."""
    mesh = bpy.data.meshes.new("Box")
    mesh.from_pydata([(x, y, z) for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)], [], [])
    box = add(scene, "Box", mesh)
    box.location = (Vector(low) + Vector(high)) / 2
    box.scale = (Vector(high) - Vector(low)) / 2
    return box


def rendered(scene: bpy.types.Scene, path: Path) -> Any:
    """The current frame as Cycles renders it: linear (rows, columns, 3) for .exr, else as displayed."""
    import numpy as np

    scene.render.filepath = str(path)
    scene.render.image_settings.file_format = "OPEN_EXR" if path.suffix == ".exr" else "PNG"
    scene.render.image_settings.color_mode = "RGB"
    quietly(lambda: bpy.ops.render.render(write_still=True))
    return np.ascontiguousarray(pixels(path))


def pixels(path: Path) -> Any:
    """A picture file as Blender keeps its numbers, row 0 at the top."""
    import numpy as np

    image = bpy.data.images.load(str(path))
    values = np.empty(len(image.pixels), np.float32)
    image.pixels.foreach_get(values)
    width, height = image.size
    bpy.data.images.remove(image)
    return values.reshape(height, width, -1)[::-1, :, :3]


def quietly(do: Any) -> None:
    """Keep what Blender prints by itself out of the tests' output."""
    sys.stdout.flush()
    kept = os.dup(1)
    with Path(os.devnull).open("wb") as nowhere:
        os.dup2(nowhere.fileno(), 1)
    try:
        do()
    finally:
        os.dup2(kept, 1)
        os.close(kept)
