"""Make the picture of the front page, docs/blender_render.png: ``python -m benchmarks.blender.front_page SEQUENCE``.

It takes a Python with bpy, and a sequence of the example:
``smokelift reconstruct examples/plume/scene.toml --quality final --frames 25:36 --out SEQUENCE``.
"""

import math
import sys
import tempfile
from pathlib import Path

import bpy
from mathutils import Matrix, Vector
from PIL import Image

from benchmarks.blender.looks import rendered, shown_example
from benchmarks.blender.pictures import beside, save
from smokelift.footage.clip import Clip
from smokelift.footage.images import area_average, linear_to_srgb
from tests.example_shot import FULL_SIZE, add, add_sun, set_world

FRAME = 36
SIZE, SAMPLES = (640, 960), 32  # three quarters of it are rendered

TURNS = (40, 90)
"""Degrees by which the clip's camera is carried around the smoke."""

SUNS = ((0.57, 0.46, -0.68), (-0.75, -0.55, -0.35))
"""Directions of the clip's sun, and of a low one from the right and behind."""


def main() -> None:
    """Render and write it: the clip, the front, two turned cameras, and another sun."""
    scene, obj = shown_example(Path(sys.argv[1]), SAMPLES, FRAME)
    scene.render.resolution_x, scene.render.resolution_y = SIZE
    with tempfile.TemporaryDirectory() as folder, Clip.open(FULL_SIZE / "clip.mp4") as clip:
        bpy.ops.smokelift.set_up()
        front = rendered(scene, Path(folder))
        filmed = 255 * linear_to_srgb(area_average(clip.frame(FRAME - 1), *front.size)) + 0.5
        pictures = [Image.fromarray(filmed.astype("uint8")), front]
        build_stage(scene, keep={obj, scene.camera})
        for degrees, sun in [*((turn, SUNS[0]) for turn in TURNS), (TURNS[0], SUNS[1])]:
            light(scene, sun, degrees)
            camera, place = scene.camera, scene.camera.matrix_world.copy()
            camera.matrix_world = Matrix.Rotation(math.radians(degrees), 4, "Z") @ place
            pictures.append(rendered(scene, Path(folder)))
            camera.matrix_world = place
    save("blender_render.png", beside(pictures))


def build_stage(scene: bpy.types.Scene, keep: set[bpy.types.Object]) -> None:
    """Leave the smoke and the camera only, and put a dark floor below them."""
    for obj in list(scene.objects):
        if obj not in keep:
            bpy.data.objects.remove(obj)
    scene.render.film_transparent = False
    mesh = bpy.data.meshes.new("Floor")
    mesh.from_pydata([(-20, -20, 0), (20, -20, 0), (20, 20, 0), (-20, 20, 0)], [], [(0, 1, 2, 3)])
    mesh.materials.append(painted((0.012, 0.0115, 0.011)))
    add(scene, "Floor", mesh)
    bpy.ops.mesh.primitive_cylinder_add(radius=0.3, depth=0.1, location=(-0.14, 0.10, 0.05))
    bpy.context.object.data.materials.append(painted((0.01, 0.01, 0.01)))
    set_world(scene, (0.006, 0.0075, 0.01))


def painted(color: tuple[float, float, float]) -> bpy.types.Material:
    """A dull paint."""
    material = bpy.data.materials.new("Paint")
    if material.node_tree is None:
        material.use_nodes = True
    shader = material.node_tree.nodes["Principled BSDF"]
    shader.inputs["Base Color"].default_value, shader.inputs["Roughness"].default_value = (*color, 1.0), 0.9
    return material


def light(scene: bpy.types.Scene, direction: tuple[float, float, float], degrees: float) -> None:
    """One sun, which shines in a direction as the turned camera sees it."""
    for obj in [obj for obj in scene.objects if obj.type == "LIGHT"]:
        bpy.data.objects.remove(obj)
    turned = Matrix.Rotation(math.radians(degrees), 3, "Z") @ Vector(direction)
    add_sun(scene, 20.0, turned.to_track_quat("-Z", "Y").to_euler()).data.angle = math.radians(1.0)


if __name__ == "__main__":
    main()
