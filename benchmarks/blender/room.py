"""Make the picture of two smokes in a room in docs/: ``python -m benchmarks.blender.room FIRST SECOND``.

It takes a Python with bpy and two sequences: the example's from `make demo`, and one of a scene that
`benchmarks/truth` makes: ``smokelift reconstruct SCENES/puff-1/scene.toml --quality draft --frames 14:18``.
"""

from __future__ import annotations

import math
import sys
import tempfile
from pathlib import Path

import bpy
from mathutils import Vector

import addon
from addon.core.take import Take
from addon.scene import volume
from addon.scene.smoke import new_smoke
from benchmarks.blender.looks import rendered
from benchmarks.blender.pictures import save
from tests.example_shot import FULL_SIZE, add, add_camera, set_world

SIZE, SAMPLES = (640, 400), 32
FRAME = 40
SHOWN = (32, 5)
"""Frames of the two sequences that are seen at once."""

FLOOR, WALL = (0.1, 0.085, 0.07), (0.05, 0.06, 0.075)
STAND = 0.3
"""Height of what the smokes rise from, and half its width (metres)."""


def main() -> None:
    """Render and write it."""
    bpy.ops.wm.read_factory_settings(use_empty=True)
    addon.register()
    scene = bpy.context.scene
    scene.render.engine = "CYCLES"
    scene.render.resolution_x, scene.render.resolution_y = SIZE
    scene.cycles.samples, scene.cycles.use_denoising = SAMPLES, True
    scene.cycles.max_bounces = 4
    if hasattr(scene.cycles, "volume_biased"):
        scene.cycles.volume_biased = True  # marching through the volume is ten times as fast
    scene.view_settings.view_transform = "Standard"
    make_room(scene)
    clips = bpy.data.movieclips.load(str(FULL_SIZE / "clip.mp4")), None
    for clip, x, folder, preset, shown in zip(clips, (-1.3, 0.5), sys.argv[1:], ("SMOKE", "DUST"), SHOWN, strict=True):
        obj = new_smoke(scene, clip)
        volume.show(obj, Take(Path(folder).absolute()))
        obj.location = (x, 0.0, STAND)
        obj.data.frame_start += FRAME - shown
        bpy.ops.smokelift.use_look(preset=preset)
        bpy.ops.mesh.primitive_cylinder_add(radius=STAND, depth=STAND, location=(x, 0.0, STAND / 2))
        bpy.context.object.data.materials.append(painted((0.04, 0.04, 0.04)))
    scene.frame_set(FRAME)
    with tempfile.TemporaryDirectory() as folder:
        save("blender_room.png", rendered(scene, Path(folder)))


def make_room(scene: bpy.types.Scene) -> None:
    """A floor, two walls, a sun and a little light from everywhere."""
    low, high, back, right = -9.0, 5.0, 1.8, 3.4
    panel(scene, [(low, low, 0), (right, low, 0), (right, back, 0), (low, back, 0)], FLOOR)
    panel(scene, [(low, back, 0), (right, back, 0), (right, back, high), (low, back, high)], WALL)
    panel(scene, [(right, low, 0), (right, back, 0), (right, back, high), (right, low, high)], WALL)
    sun = add(scene, "Sun", bpy.data.lights.new("Sun", "SUN"))
    sun.data.energy, sun.data.angle = 14.0, math.radians(1.0)
    sun.rotation_euler = Vector((0.6, 0.42, -0.75)).to_track_quat("-Z", "Y").to_euler()
    set_world(scene, (0.12, 0.14, 0.18))
    place = Vector((-0.6, -8.0, 2.6))
    camera = add_camera(scene, place, (Vector((0.2, 0.0, 1.25)) - place).to_track_quat("-Z", "Y").to_euler())
    camera.data.lens = 42.0


def panel(scene: bpy.types.Scene, corners: list[tuple[float, float, float]], color: tuple[float, float, float]) -> None:
    """A flat piece of the room."""
    mesh = bpy.data.meshes.new("Panel")
    mesh.from_pydata(corners, [], [(0, 1, 2, 3)])
    mesh.materials.append(painted(color))
    add(scene, "Panel", mesh)


def painted(color: tuple[float, float, float]) -> bpy.types.Material:
    """A dull paint."""
    material = bpy.data.materials.new("Paint")
    if material.node_tree is None:
        material.use_nodes = True
    shader = material.node_tree.nodes["Principled BSDF"]
    shader.inputs["Base Color"].default_value, shader.inputs["Roughness"].default_value = (*color, 1.0), 0.9
    return material


if __name__ == "__main__":
    main()
