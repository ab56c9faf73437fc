"""Make the picture of Cycles' two ways through smoke in docs/: ``python -m benchmarks.blender.noise demo/sequence``.

It takes a Python with bpy 5.0 or later, and the example's sequence from `make demo`. On the left is null scattering, on
the right marching, without denoising. It prints the processor's seconds of each, and its noise beside a picture of many
samples.
"""

from __future__ import annotations

import sys
import tempfile
import time
from pathlib import Path

import bpy
import numpy as np
from PIL import Image

from benchmarks.blender.looks import shown_example
from benchmarks.blender.pictures import beside, save

FRAME, PERCENT = 30, 75
SAMPLES, MANY = 32, 256


def main() -> None:
    """Render and write it."""
    scene, _ = shown_example(Path(sys.argv[1]), SAMPLES, FRAME)
    bpy.ops.smokelift.set_up()
    scene.frame_set(FRAME)
    scene.cycles.use_denoising = False
    scene.render.resolution_percentage = PERCENT
    scene.render.image_settings.file_format = "PNG"
    pictures = []
    with tempfile.TemporaryDirectory() as folder:
        for biased in (False, True):
            scene.cycles.volume_biased = biased
            few, seconds = _rendered(scene, Path(folder), SAMPLES)
            many, _ = _rendered(scene, Path(folder), MANY)
            difference = np.asarray(few, np.float32) - np.asarray(many, np.float32)
            print(f"volume_biased {biased}: {seconds:.1f} s, noise {np.sqrt(np.mean(difference**2)):.2f} of 255")
            pictures.append(few)
    save("blender_noise.png", beside(pictures))


def _rendered(scene: bpy.types.Scene, folder: Path, samples: int) -> tuple[Image.Image, float]:
    scene.cycles.samples = samples
    scene.render.filepath = str(folder / "render.png")
    began = time.process_time()
    bpy.ops.render.render(write_still=True)
    return Image.open(folder / "render.png").convert("RGB"), time.process_time() - began


if __name__ == "__main__":
    main()
