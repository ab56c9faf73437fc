"""Pictures of smoke with scattering of all orders, by Mitsuba's path tracer. Needs Mitsuba 3 and nothing of Smokelift.

    MITSUBA_PYTHON -m benchmarks.renderer.multiple_reference SCENES/plume-1/truth.npz OUT.npz

OUT holds, for every albedo, optical depth and light, two pictures of the same smoke whose noise is independent.
"""

from __future__ import annotations

import argparse
import itertools
import math
from pathlib import Path

import mitsuba as mi
import numpy as np

from benchmarks.mitsuba_scene import ENDLESS, emitter, path_traced, sensor, smoke

ALBEDOS, DEPTHS = (0.7, 0.9, 0.99), (2.0, 6.0, 15.0)  # optical depths of the thickest column seen from the front
DIRECTIONS = {  # of travel, 35 degrees downwards
    "front": (0.0, 0.819152, -0.573576),
    "side": (-0.819152, 0.0, -0.573576),
    "back": (0.0, -0.819152, -0.573576),
}
DISTANCE, FOV = 7.0, 30.0  # of the camera from the axis (m); degrees
IRRADIANCE = 2 * math.pi


def main() -> None:
    """Trace all settings."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("truth", type=Path, help="baked by benchmarks.truth.bake")
    parser.add_argument("out", type=Path)
    parser.add_argument("--frame", type=int, default=20)
    parser.add_argument("--samples", type=int, default=64, help="paths a pixel of each of the two pictures")
    options = parser.parse_args()
    with np.load(options.truth) as file:
        density, voxel = file["density"][options.frame].astype(np.float32), float(file["voxel_size"])
    size = np.array(density.shape) * voxel
    low = np.array([-size[0] / 2, -size[1] / 2, 0.0])
    column = float(density.sum(1).max()) * voxel
    matrix = [[1.0, 0, 0, 0], [0, 0, -1.0, -DISTANCE], [0, 1.0, 0, size[2] / 2], [0, 0, 0, 1]]
    camera = {"matrix": matrix, "fov_y_degrees": FOV, "size": [density.shape[0], density.shape[2]]}
    traced = {}
    for albedo, depth, light in itertools.product(ALBEDOS, DEPTHS, DIRECTIONS):
        medium = {"extinction": depth / column, "albedo": albedo}
        sun = {"type": "directional", "direction": DIRECTIONS[light], "irradiance": [IRRADIANCE] * 3}
        scene = {
            "integrator": {"type": "volpath", "max_depth": -1, "rr_depth": ENDLESS, "hide_emitters": True},
            "camera": sensor(camera),
            "domain": smoke(density, low, low + size, medium, {"type": "isotropic"}),
            "light": emitter(sun),
        }
        traced[f"{albedo:g} {depth:g} {light}"] = path_traced(scene, 2, options.samples)[..., 0]
        print(albedo, depth, light, flush=True)
    np.savez_compressed(options.out, density=density, voxel_size=voxel, **traced)
    print(f"{options.out}: Mitsuba {mi.__version__}")


if __name__ == "__main__":
    main()
