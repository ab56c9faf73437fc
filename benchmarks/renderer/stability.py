"""Errors of image and gradient as smoke gets thinner and thicker: a Markdown table.

    python -m benchmarks.renderer.stability

A plume of 40^3 voxels, albedo 1, the sun at 45 degrees, a camera at an oblique angle. The truth is the same sums and
their exact derivative in float64. The last column is the brightest pixel of the same smoke in a white room (radiance 1
from everywhere, before a white wall): above 1 the renderer would create light.
"""

from dataclasses import replace

import numpy as np

from benchmarks.renderer.reference import image_and_gradient
from benchmarks.renderer.scene import PLUME, BenchScene, bench_scene, plume, shining, spread
from benchmarks.tables import markdown
from smokelift.evaluation.metrics import volume_error
from smokelift.render import Optics, Volume
from smokelift.scene import Medium

SIZE = 40
DEPTHS = (0.001, 0.01, 0.1, 1.0, 10.0, 100.0)
ANISOTROPIES = (-0.9, 0.0, 0.9)
ROOM_LIGHTS = 64


def main() -> None:
    """Print the table."""
    density = plume(SIZE, PLUME)
    rows = [
        [f"{depth:g}", f"{anisotropy:g}", *row(at_depth(density, depth, anisotropy))]
        for depth in DEPTHS
        for anisotropy in ANISOTROPIES
    ]
    worst = "worst of the ten steepest voxels"
    print(markdown(["optical depth", "anisotropy", "image error", "gradient error", worst, "white room"], rows))


def at_depth(density: Volume, depth: float, anisotropy: float) -> BenchScene:
    """Return the benchmark's scene with this optical depth."""
    scene = bench_scene(density, np.full((SIZE, SIZE, 3), 0.1, np.float32))
    extinction = depth / float(density.sum(1).max() * scene.domain.voxel_size)
    return replace(scene, medium=Medium(extinction, 1.0, anisotropy))


def row(scene: BenchScene) -> list[str]:
    """Measure one scene."""
    background = np.array(scene.background, np.float32)
    optics = Optics(scene.domain, scene.medium, scene.lights[:1])
    renderer = optics.renderer(scene.camera, background, scene.density > 0)
    image = renderer.image(scene.density, keep_record=True)
    gradient = renderer.gradient(2 * (image - scene.target))
    exact_image, exact_gradient = image_and_gradient(scene)
    exact_gradient = np.where(scene.density > 0, exact_gradient, 0)
    steepest = np.argsort(np.abs(exact_gradient), axis=None)[-10:]
    worst = np.abs(gradient.flat[steepest] / exact_gradient.flat[steepest] - 1).max()
    errors = (volume_error(image, exact_image), volume_error(gradient, exact_gradient), worst)
    return [*(f"{error:.1e}" for error in errors), f"{white_room(scene):.4f}"]


def white_room(scene: BenchScene) -> float:
    """Return the brightest pixel where radiance 1 arrives from every side, in isotropic smoke."""
    lights = shining(spread(ROOM_LIGHTS, -1.0), (4 * np.pi,) * 3)
    room = replace(scene.medium, anisotropy=0.0)
    wall = np.ones(3, np.float32)
    return float(Optics(scene.domain, room, lights).renderer(scene.camera, wall).image(scene.density).max())


if __name__ == "__main__":
    main()
