"""Smokelift's own renderer."""

from collections.abc import Callable
from functools import partial

import numpy as np
from numpy.typing import NDArray

from benchmarks.renderer.peers import Iteration
from benchmarks.renderer.scene import BenchScene
from smokelift.render import Optics

Volume = NDArray[np.float32]


def prepare(scene: BenchScene) -> Iteration:
    """Set up the renderer, which knows the voxels that may hold smoke."""
    background = np.array(scene.background, np.float32)
    optics = Optics(scene.domain, scene.medium, scene.lights)
    renderer = optics.renderer(scene.camera, background, scene.support)
    gradient = np.zeros(scene.density.shape, np.float32)
    return iteration(scene, partial(renderer.image, keep_record=True), partial(renderer.gradient, out=gradient))


def iteration(scene: BenchScene, image: Callable[[Volume], Volume], gradient: Callable[[Volume], Volume]) -> Iteration:
    """Return the iteration of a renderer on arrays, whose gradient is that of its last image."""

    def run(density: Volume) -> tuple[Volume, Volume]:
        shown = image(density)
        return shown, gradient(2 * (shown - scene.target))

    return Iteration(upload=np.asarray, run=run, download=lambda image, gradient: (image, gradient))
