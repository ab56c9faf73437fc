"""The paper's algorithms 2 and 3 (gradRec), in Taichi: its Riemann sum, and its derivative, which is not exact."""

import numpy as np

from benchmarks.renderer.peers import Iteration
from benchmarks.renderer.peers.ours import iteration
from benchmarks.renderer.scene import BenchScene
from smokelift.baselines.paper_renderer import PaperRenderer
from smokelift.render import Optics


def prepare(scene: BenchScene) -> Iteration:
    """Set up the renderer and its record."""
    background = np.array(scene.background, np.float32)
    renderer = PaperRenderer(Optics(scene.domain, scene.medium, scene.lights), scene.camera, background)
    return iteration(scene, renderer.image, renderer.gradient)
