"""Make the picture of the presets and of the composite in docs/: ``python -m benchmarks.blender.looks demo/sequence``.

It takes a Python with bpy, and the example's sequence from `make demo`.
"""

from __future__ import annotations

import sys
import tempfile
from pathlib import Path

import bpy
from PIL import Image

import addon
from addon.core.take import Take
from addon.scene import compositing, look, volume
from benchmarks.blender.pictures import beside, save
from tests.example_shot import FULL_SIZE, set_up_example, smoke

FRAME = 30
PERCENT, SMALL, SAMPLES = 75, 30, 24
RIM = 0.3
"""Metres from the floor to the bowl's rim, where the smoke's box begins."""


def main() -> None:
    """Render and write it."""
    scene, obj = shown_example(Path(sys.argv[1]), SAMPLES, FRAME)
    with tempfile.TemporaryDirectory() as folder:
        pictures = []
        bpy.ops.smokelift.set_up()
        for preset in look.PRESETS:
            bpy.ops.smokelift.use_look(preset=preset)
            pictures.append(rendered(scene, Path(folder), SMALL))
        obj.smokelift.plate_place = "COMPOSITE"
        bpy.ops.smokelift.set_up()
        scene.objects[compositing.FLOOR].location.z -= RIM
        bpy.ops.smokelift.use_look(preset="SMOKE")
        pictures.append(rendered(scene, Path(folder), SMALL))
        obj.location.x += 0.55
        bpy.data.objects["Sun"].rotation_euler = (0.9, 0.0, 0.9)
        bpy.ops.smokelift.use_look(preset="SOOT")
        pictures.append(rendered(scene, Path(folder), SMALL))
    save("blender_looks.png", beside(pictures))


def shown_example(sequence: Path, samples: int, frame: int) -> tuple[bpy.types.Scene, bpy.types.Object]:
    """The example's scene with a sequence as its smoke, and that smoke, ready to be rendered in a frame."""
    bpy.ops.wm.read_factory_settings(use_empty=True)
    addon.register()
    scene = set_up_example(bpy.context.scene, FULL_SIZE)
    obj = smoke(scene)
    volume.show(obj, Take(sequence.absolute()))
    scene.cycles.samples, scene.cycles.use_denoising = samples, True
    if hasattr(scene.cycles, "volume_biased"):
        scene.cycles.volume_biased = True  # marching through the volume is ten times as fast
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
