"""The example's smoke in Blender, which goes on around a ball: ``python -m benchmarks.blender.around_a_ball PICTURE``.

Needs bpy and Pillow. Everything is done by the add-on's own buttons.
"""

from __future__ import annotations

import shutil
import sys
import tempfile
from pathlib import Path

import bpy
from PIL import Image

import addon
from tests.example_shot import FULL_SIZE, set_up_example, smoke

FIRST, LAST, ADDED = 21, 28, 28
SHOWN = (LAST, 36, 44, LAST + ADDED)
LONGEST_SIDE = 64
BALL = {"radius": 0.28, "location": (0.05, 0.0, 1.35)}
SAMPLES, PERCENTAGE = 128, 75


def main(picture: Path) -> None:
    """Make the smoke, direct it and render it."""
    bpy.ops.wm.read_factory_settings(use_empty=True)
    addon.register()
    with tempfile.TemporaryDirectory() as folder:
        shutil.copytree(FULL_SIZE, folder, dirs_exist_ok=True)
        scene = set_up_example(bpy.context.scene, Path(folder))
        obj = smoke(scene)
        settings = obj.smokelift
        settings.first, settings.last, settings.longest_side = FIRST, LAST, LONGEST_SIDE
        settings.output = str(Path(folder) / "out")
        bpy.context.view_layer.objects.active = obj
        bpy.ops.smokelift.run()
        settings.directing.effectors, settings.directing.frames = effectors(scene), ADDED
        bpy.context.view_layer.objects.active = obj
        bpy.ops.smokelift.direct()
        bpy.ops.smokelift.set_up()
        rendered(scene, Path(folder)).save(picture, optimize=True)
    addon.unregister()


def effectors(scene: bpy.types.Scene) -> bpy.types.Collection:
    """A collection with a round mesh."""
    collection = bpy.data.collections.new("Effectors")
    scene.collection.children.link(collection)
    bpy.ops.mesh.primitive_uv_sphere_add(segments=48, ring_count=24, **BALL)
    ball = bpy.context.object
    ball.data.polygons.foreach_set("use_smooth", [True] * len(ball.data.polygons))
    scene.collection.objects.unlink(ball)
    collection.objects.link(ball)
    return collection


def rendered(scene: bpy.types.Scene, folder: Path) -> Image.Image:
    """The shown frames in one row, by Cycles."""
    scene.render.resolution_percentage = PERCENTAGE
    scene.cycles.samples = SAMPLES
    if hasattr(scene.cycles, "volume_biased"):
        scene.cycles.volume_biased = True  # marching through the volume is ten times as fast
    pictures = []
    for frame in SHOWN:
        scene.frame_set(frame)
        scene.render.filepath = str(folder / f"{frame}.png")
        bpy.ops.render.render(write_still=True)
        pictures.append(Image.open(scene.render.filepath).convert("RGB"))
    row = Image.new("RGB", (sum(one.width for one in pictures), pictures[0].height))
    for number, one in enumerate(pictures):
        row.paste(one, (number * one.width, 0))
    return row.quantize(256, dither=Image.Dither.FLOYDSTEINBERG)


if __name__ == "__main__":
    main(Path(sys.argv[1]).absolute())
