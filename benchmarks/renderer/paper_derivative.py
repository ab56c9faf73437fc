"""How far the exact and the paper's derivative are from finite differences, voxel by voxel, as smoke gets thicker.

    python -m benchmarks.renderer.paper_derivative [--voxels 150]

Each gradient is compared with that of its own discrete picture, restated in float64 (tests/engine/*_reference.py) and
differentiated by a complex step: what central differences give, without their rounding. Optical depth is that of the
thickest column of smoke. Prints a Markdown table.
"""

from __future__ import annotations

import argparse

import numpy as np

from smokelift.baselines.renderer import PaperRenderer
from smokelift.render import Renderer
from smokelift.scene import Camera, DirectionalLight, Domain, Medium
from tests.engine import paper_reference, renderer_reference

GRID = 24
DEPTHS = (0.1, 1.0, 3.0, 10.0)
DOMAIN = Domain((-0.5, -0.5, -0.5), (0.5, 0.5, 0.5), (GRID, GRID, GRID))
CAMERA = Camera.look_at((1.7, -1.9, 1.3), (0.0, 0.0, 0.0), fov_y_degrees=28, size=(GRID, GRID))
SUN = DirectionalLight((0.57, 0.45, -0.68), (9.0, 9.0, 9.0))
BLACK = np.zeros(3, np.float32)


def billows() -> np.ndarray:
    """A lumpy ball of smoke before nothing."""
    x, y, z = np.meshgrid(*[(np.arange(GRID) + 0.5) / GRID * 2 - 1] * 3, indexing="ij")
    lumps = 1 + 0.6 * np.sin(9 * x + 2 * z) * np.cos(8 * y - 1) * np.sin(7 * z + 3 * x)
    return np.maximum(np.exp(-5 * (x**2 + y**2 + z**2)) * lumps - 0.05, 0).astype(np.float32)


def compare(renderer_class, reference, density, medium, voxels, weights) -> tuple[float, float, float]:
    """Relative error over voxels of smoke, share of them with the wrong sign, error for density added everywhere."""
    setup = (CAMERA, DOMAIN, medium, (SUN,), BLACK)
    renderer = renderer_class(*setup)
    if renderer_class is Renderer:
        renderer.image(density, keep_record=True)
    else:
        renderer.image(density)
    gradient = renderer.gradient(weights)

    def slope(direction: np.ndarray) -> float:
        return float(np.sum(weights * reference.render(density + 1e-30j * direction, *setup)).imag / 1e-30)

    expected = np.zeros(len(voxels))
    for number, voxel in enumerate(voxels):
        direction = np.zeros(density.shape)
        direction[tuple(voxel)] = 1
        expected[number] = slope(direction)
    found = gradient[tuple(voxels.T)]
    common = slope(np.ones(density.shape))
    return (
        float(np.linalg.norm(found - expected) / np.linalg.norm(expected)),
        float(np.mean(np.sign(found) != np.sign(expected))),
        float(abs(gradient.sum(dtype=np.float64) / common - 1)),
    )


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--voxels", type=int, default=150)
    options = parser.parse_args()
    density = billows()
    rng = np.random.default_rng(0)
    voxels = rng.choice(np.argwhere(density > 0), options.voxels, replace=False)
    weights = rng.random((GRID, GRID, 3))
    print(
        "| optical depth | exact: per voxel | paper: per voxel | paper: wrong sign | paper: density added everywhere |"
    )
    print("|---|---|---|---|---|")
    for depth in DEPTHS:
        medium = Medium(depth / (density.sum(1).max() * DOMAIN.voxel_size), 0.9, 0.0)
        exact, _, _ = compare(Renderer, renderer_reference, density, medium, voxels, weights)
        paper, wrong, common = compare(PaperRenderer, paper_reference, density, medium, voxels, weights)
        print(f"| {depth:g} | {exact:.1e} | {paper:.2g} | {100 * wrong:.0f} % | {common:.0e} |")


if __name__ == "__main__":
    main()
