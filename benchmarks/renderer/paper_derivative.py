"""Errors of the exact and of the paper's derivative, voxel by voxel, as smoke gets thicker: a Markdown table.

    python -m benchmarks.renderer.paper_derivative [--voxels 150]

Each gradient is compared with the derivative of its own discrete picture, computed in float64 by the tests' references
and differentiated by a complex step: central differences without their rounding. Optical depth is that of the thickest
column of smoke.
"""

import argparse
from collections.abc import Callable
from typing import Any

import numpy as np
import numpy.typing as npt

from benchmarks.tables import markdown
from smokelift.baselines.paper_renderer import PaperRenderer
from smokelift.checks import Doubles
from smokelift.evaluation.metrics import volume_error
from smokelift.render import Optics, Volume
from smokelift.scene import Camera, DirectionalLight, Domain, Medium
from tests.engine import paper_reference, renderer_reference

GRID = 24
DEPTHS = (0.1, 1.0, 3.0, 10.0)
DOMAIN = Domain((-0.5, -0.5, -0.5), (0.5, 0.5, 0.5), (GRID, GRID, GRID))
CAMERA = Camera.look_at((1.7, -1.9, 1.3), (0.0, 0.0, 0.0), fov_y_degrees=28, size=(GRID, GRID))
SUN = DirectionalLight((0.57, 0.45, -0.68), (9.0, 9.0, 9.0))
BLACK = np.zeros(3, np.float32)

Complex = npt.NDArray[np.complex128]


def billows() -> Volume:
    """Return a lumpy ball of smoke."""
    x, y, z = np.meshgrid(*[(np.arange(GRID) + 0.5) / GRID * 2 - 1] * 3, indexing="ij")
    lumps = 1 + 0.6 * np.sin(9 * x + 2 * z) * np.cos(8 * y - 1) * np.sin(7 * z + 3 * x)
    ball = np.exp(-5 * (x**2 + y**2 + z**2)) * lumps
    return np.asarray(np.maximum(ball - 0.05, 0), np.float32)


def compare(
    gradient: Volume,
    reference: Callable[..., Complex],
    setup: tuple[Any, ...],
    density: Volume,
    voxels: npt.NDArray[np.int64],
    weights: Doubles,
) -> tuple[float, float, float]:
    """Compare the gradient of a weighted sum over a picture with the complex step of its reference.

    Returns
    -------
    tuple
        Relative error over voxels of smoke, fraction of them with the wrong sign, and the relative error for density
        that is added everywhere.
    """

    def slope(direction: Doubles) -> float:
        return float(np.sum(weights * reference(density + 1e-30j * direction, *setup)).imag / 1e-30)

    expected = np.zeros(len(voxels))
    for number, voxel in enumerate(voxels):
        direction = np.zeros(density.shape)
        direction[tuple(voxel)] = 1
        expected[number] = slope(direction)
    found = gradient[tuple(voxels.T)]
    common = slope(np.ones(density.shape))
    return (
        volume_error(found, expected),
        float(np.mean(np.sign(found) != np.sign(expected))),
        float(abs(gradient.sum(dtype=np.float64) / common - 1)),
    )


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description="Compare both derivatives with finite differences.")
    parser.add_argument("--voxels", type=int, default=150)
    options = parser.parse_args()
    density = billows()
    rng = np.random.default_rng(0)
    voxels = rng.choice(np.argwhere(density > 0), options.voxels, replace=False)
    weights = rng.random((GRID, GRID, 3))
    rows = []
    for depth in DEPTHS:
        medium = Medium(depth / (density.sum(1).max() * DOMAIN.voxel_size), 0.9, 0.0)
        setup = (CAMERA, DOMAIN, medium, (SUN,), BLACK)
        optics = Optics(DOMAIN, medium, (SUN,))
        ours, papers = optics.renderer(CAMERA, BLACK), PaperRenderer(optics, CAMERA, BLACK)
        ours.image(density, keep_record=True)
        papers.image(density)

        exact, _, _ = compare(ours.gradient(weights), renderer_reference.render, setup, density, voxels, weights)
        paper, wrong, common = compare(
            papers.gradient(weights), paper_reference.render, setup, density, voxels, weights
        )
        rows.append([f"{depth:g}", f"{exact:.1e}", f"{paper:.2g}", f"{100 * wrong:.0f} %", f"{common:.0e}"])
    papers_columns = ["paper: per voxel", "paper: wrong sign", "paper: density added everywhere"]
    print(markdown(["optical depth", "exact: per voxel", *papers_columns], rows))


if __name__ == "__main__":
    main()
