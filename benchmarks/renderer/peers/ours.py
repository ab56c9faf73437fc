"""Smokelift's own renderer."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from benchmarks.renderer.peers import Iteration
from benchmarks.renderer.scene import BenchScene
from smokelift.render import Renderer

Volume = NDArray[np.float32]


def prepare(scene: BenchScene) -> Iteration:
    """Set up the renderer, which knows the voxels that may hold smoke."""
    background = np.array(scene.background, np.float32)
    renderer = Renderer(scene.camera, scene.domain, scene.medium, scene.lights, background, support=scene.support)

    gradient = np.zeros(scene.density.shape, np.float32)

    def run(density: Volume) -> tuple[Volume, Volume]:
        image = renderer.image(density, keep_record=True)
        return image, renderer.gradient(2 * (image - scene.target), out=gradient)

    return Iteration(upload=np.asarray, run=run, download=lambda image, gradient: (image, gradient))
