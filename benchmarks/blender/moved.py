"""Make the picture of the projection in docs/: ``python -m benchmarks.blender.moved demo/sequence``.

The camera moves away from the clip's. It takes a Python with bpy, and the example's sequence from `make demo`.
"""

from __future__ import annotations

import sys
import tempfile
from pathlib import Path

import bpy
from mathutils import Vector

from addon.scene import projection
from benchmarks.blender.looks import FRAME, RIM, rendered, shown_example
from benchmarks.blender.pictures import beside, save
from tests.example_shot import add

SAMPLES = 24
AIM = Vector((0.0, 0.0, 1.5))
MOVED = Vector((1.7, -6.6, 1.8))
WALL, ROOM = 1.6, 4.0
"""Metres from the smoke to the wall, and half the width of the floor."""


def main() -> None:
    """Render and write it."""
    scene, obj = shown_example(Path(sys.argv[1]), SAMPLES, FRAME)
    obj.smokelift.plate_place = "PROJECTION"
    bpy.ops.smokelift.set_up()
    place_geometry(scene)
    with tempfile.TemporaryDirectory() as folder:
        pictures = [rendered(scene, Path(folder))]
        scene.camera.location = MOVED
        scene.camera.rotation_euler = (AIM - MOVED).to_track_quat("-Z", "Y").to_euler()
        pictures.append(rendered(scene, Path(folder)))
        for piece in (projection.CARD, "Ground"):
            scene.objects[piece].hide_render = True
        obj.smokelift.plate_place = "WORLD"
        bpy.ops.smokelift.set_up()
        pictures.append(rendered(scene, Path(folder)))
    save("blender_projection.png", beside(pictures))


def place_geometry(scene: bpy.types.Scene) -> None:
    """Put the card where the wall is, and a floor before it."""
    card = scene.objects[projection.CARD]
    card.location.y = WALL
    mesh = bpy.data.meshes.new("Ground")
    corners = [(-ROOM, -ROOM), (ROOM, -ROOM), (ROOM, WALL), (-ROOM, WALL)]
    mesh.from_pydata([(x, y, -RIM) for x, y in corners], [], [(0, 1, 2, 3)])
    mesh.materials.append(card.data.materials[0])
    add(scene, "Ground", mesh)


if __name__ == "__main__":
    main()
