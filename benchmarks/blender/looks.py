"""Make the pictures of presets, projection and noise in docs/: ``python -m benchmarks.blender.looks demo/sequence``.

It takes a Python with bpy 5.0 or later, and the example's sequence from `make demo`. It prints the processor's seconds
of null scattering and of marching, and their noise beside pictures of many samples.
"""

import sys
import tempfile
import time
from pathlib import Path

import bpy
import numpy as np
from mathutils import Vector
from PIL import Image

import addon
from addon.core.take import Take
from addon.scene import compositing, look, plate, volume
from benchmarks.blender.pictures import beside, save
from tests.example_shot import FULL_SIZE, add, set_up_example, smoke

FRAME = 30
PERCENT, SMALL, SAMPLES = 75, 30, 24
FEW, MANY = 32, 256
"""Samples of the picture of the noise, and of what it is compared with."""

RIM = 0.3
"""Meters from the floor to the bowl's rim, where the smoke's box begins."""

AIM = Vector((0.0, 0.0, 1.5))
MOVED = Vector((1.7, -6.6, 1.8))
WALL, ROOM = 1.6, 4.0
"""Meters from the smoke to the wall, and half the width of the floor."""


def main() -> None:
    """Render and write them."""
    sequence = Path(sys.argv[1])
    with tempfile.TemporaryDirectory() as folder:
        for name, make in (("looks", presets), ("projection", projected), ("noise", noise)):
            scene, obj = shown_example(sequence, SAMPLES, FRAME)
            save(f"blender_{name}.png", beside(make(scene, obj, Path(folder))))
            addon.unregister()


def presets(scene: bpy.types.Scene, obj: bpy.types.Object, folder: Path) -> list[Image.Image]:
    """Every preset, the smoke over its plate, and moved as soot in other light."""
    pictures = []
    bpy.ops.smokelift.set_up()
    for preset in look.PRESETS:
        bpy.ops.smokelift.use_look(preset=preset)
        pictures.append(rendered(scene, folder, SMALL))
    obj.smokelift.plate_place = "COMPOSITE"
    bpy.ops.smokelift.set_up()
    scene.objects[compositing.FLOOR].location.z -= RIM
    bpy.ops.smokelift.use_look(preset="SMOKE")
    pictures.append(rendered(scene, folder, SMALL))
    obj.location.x += 0.55
    bpy.data.objects["Sun"].rotation_euler = (0.9, 0.0, 0.9)
    bpy.ops.smokelift.use_look(preset="SOOT")
    return [*pictures, rendered(scene, folder, SMALL)]


def projected(scene: bpy.types.Scene, obj: bpy.types.Object, folder: Path) -> list[Image.Image]:
    """The clip's camera, one that has moved away from it, and the same with the plate in the world."""
    obj.smokelift.plate_place = "PROJECTION"
    bpy.ops.smokelift.set_up()
    card = scene.objects[plate.CARD]
    card.location.y = WALL
    mesh = bpy.data.meshes.new("Ground")
    corners = [(-ROOM, -ROOM), (ROOM, -ROOM), (ROOM, WALL), (-ROOM, WALL)]
    mesh.from_pydata([(x, y, -RIM) for x, y in corners], [], [(0, 1, 2, 3)])
    mesh.materials.append(card.data.materials[0])
    ground = add(scene, "Ground", mesh)
    pictures = [rendered(scene, folder)]
    scene.camera.location = MOVED
    scene.camera.rotation_euler = (AIM - MOVED).to_track_quat("-Z", "Y").to_euler()
    pictures.append(rendered(scene, folder))
    card.hide_render = ground.hide_render = True
    obj.smokelift.plate_place = "WORLD"
    bpy.ops.smokelift.set_up()
    return [*pictures, rendered(scene, folder)]


def noise(scene: bpy.types.Scene, _: bpy.types.Object, folder: Path) -> list[Image.Image]:
    """Null scattering and marching, without denoising."""
    bpy.ops.smokelift.set_up()
    scene.frame_set(FRAME)
    scene.cycles.use_denoising = False
    pictures = []
    for marches in (False, True):
        scene.cycles.volume_biased = marches
        scene.cycles.samples = FEW
        began = time.process_time()
        few = rendered(scene, folder)
        seconds = time.process_time() - began
        scene.cycles.samples = MANY
        difference = np.asarray(few, np.float32) - np.asarray(rendered(scene, folder), np.float32)
        print(f"volume_biased {marches}: {seconds:.1f} s, noise {np.sqrt(np.mean(difference**2)):.2f} of 255")
        pictures.append(few)
    return pictures


def shown_example(sequence: Path, samples: int, frame: int) -> tuple[bpy.types.Scene, bpy.types.Object]:
    """The example's scene with a sequence as its smoke, and that smoke, ready to be rendered in a frame."""
    bpy.ops.wm.read_factory_settings(use_empty=True)
    addon.register()
    scene = set_up_example(bpy.context.scene, FULL_SIZE)
    obj = smoke(scene)
    volume.show(obj, Take(sequence.absolute()))
    scene.cycles.samples, scene.cycles.use_denoising = samples, True
    if hasattr(scene.cycles, "volume_biased"):
        scene.cycles.volume_biased = True  # as a set-up does
    scene.frame_set(frame)
    return scene, obj


def rendered(scene: bpy.types.Scene, folder: Path, percent: int = PERCENT) -> Image.Image:
    """The current frame, small."""
    scene.render.resolution_percentage = percent
    scene.render.image_settings.file_format = "PNG"
    scene.render.filepath = str(folder / "render.png")
    bpy.ops.render.render(write_still=True)
    return Image.open(folder / "render.png").convert("RGB")


if __name__ == "__main__":
    main()
