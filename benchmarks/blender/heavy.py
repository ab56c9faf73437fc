"""What a proxy saves: write and play three frames of 288 x 288 x 496 voxels.

    python -m benchmarks.blender.heavy FOLDER

The smoke is a cone of noise that fills a quarter of the box, with its velocity.
"""

import json
import sys
import time
from pathlib import Path

import bpy
import numpy as np
import psutil
from scipy import ndimage

import addon
from addon.core.take import Take
from addon.scene import modifiers, volume
from smokelift.output.vdb import write_proxy, write_vdb
from smokelift.scene import Domain, Medium, Scene, scene_to_dict
from tests.example_shot import smoke

DOMAIN = Domain((-1.0, -1.0, 0.0), (1.0, 1.0, 2 * 496 / 288), (288, 288, 496))
FRAMES = 3


def main() -> None:
    """Write the frames unless they are there, and print the figures."""
    take = Take(Path(sys.argv[1]).resolve() / "take_0001")
    if take.read().index is None:
        _write(take)
    for kind in ("smoke", "proxy"):
        megabytes = (take.directory / f"{kind}_0001.vdb").stat().st_size / 1e6
        print(f"{kind}: {megabytes:.2f} MB per frame")
    bpy.ops.wm.read_factory_settings(use_empty=True)
    addon.register()
    obj = volume.show(smoke(bpy.context.scene), take)
    for shown in (True, False):
        modifiers.PROXY.modifier(obj).show_viewport = shown
        before = psutil.Process().memory_info().rss
        seconds = [_played(obj, frame) for frame in range(1, FRAMES + 1)]
        megabytes = (psutil.Process().memory_info().rss - before) / 1e6 / FRAMES
        print(f"{'proxy' if shown else 'smoke'}: {np.median(seconds):.3f} s and {megabytes:.1f} MB per frame")


def _played(obj: bpy.types.Object, frame: int) -> float:
    began = time.perf_counter()
    bpy.context.scene.frame_set(frame)
    data = obj.evaluated_get(bpy.context.evaluated_depsgraph_get()).data
    assert data.grids.load(), data.grids.error_message
    return time.perf_counter() - began


def _write(take: Take) -> None:
    take.directory.mkdir(parents=True)
    random = np.random.default_rng(0)
    shape = DOMAIN.resolution
    x, y, z = np.ogrid[-1:1:288j, -1:1:288j, 0:1:496j]
    rho = 1.2 - 1.2 * np.hypot(x, y) / (0.15 + 0.7 * z)
    for size, strength in ((32, 0.35), (12, 0.21), (5, 0.14)):
        coarse = random.standard_normal([n // size + 1 for n in shape]).astype(np.float32)
        rho += strength * ndimage.zoom(coarse, [n / m for n, m in zip(shape, coarse.shape, strict=True)], order=1)
    rho = np.maximum(rho, 0.0).astype(np.float32)
    velocity = np.zeros((*shape, 3), np.float32)
    velocity[..., 2] = 1.0 + ndimage.gaussian_filter(rho, 2.0)
    for number in range(1, FRAMES + 1):
        moved = np.roll(rho, 2 * number, axis=2)
        write_vdb(take.directory / f"smoke_{number:04d}.vdb", moved, velocity, DOMAIN)
        write_proxy(take.directory / f"proxy_{number:04d}.vdb", moved, DOMAIN)
    scene = scene_to_dict(Scene(domain=DOMAIN, medium=Medium(4.0, 0.8)))
    scene["clip"] = {"path": "clip.mp4", "fps": 24.0}
    frames = {str(number): {} for number in range(1, FRAMES + 1)}
    index = {"complete": True, "scene": scene, "settings": {}, "frames": frames}
    (take.directory / "sequence.json").write_text(json.dumps(index))


if __name__ == "__main__":
    main()
