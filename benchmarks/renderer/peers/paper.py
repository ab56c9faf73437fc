"""The paper's algorithms 2 and 3 (gradRec), in Taichi: its Riemann sum, and its derivative, which is not exact."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from benchmarks.renderer.peers import Iteration
from benchmarks.renderer.scene import BenchScene
from smokelift.baselines.paper_renderer import PaperRenderer

Volume = NDArray[np.float32]


def prepare(scene: BenchScene) -> Iteration:
    """Set up the renderer and its record."""
    background = np.array(scene.background, np.float32)
    renderer = PaperRenderer(scene.camera, scene.domain, scene.medium, scene.lights, background)

    def run(density: Volume) -> tuple[Volume, Volume]:
        image = renderer.image(density)
        return image, renderer.gradient(2 * (image - scene.target))

    return Iteration(upload=np.asarray, run=run, download=lambda image, gradient: (image, gradient))
