"""Figures of a run whose densities are known: the truth's own, and its front drawn out in depth."""

import numpy as np
import pytest

from benchmarks.accuracy.scenes import KnownScene
from benchmarks.accuracy.score import score
from benchmarks.baked import BLACK
from smokelift.render import scene_renderer
from smokelift.scene import completed, orbit
from tests.benchmarks.ball import scene, truth

SHAPE, FRAMES, VOXEL = (16, 16, 24), 10, 0.125
SCENE = scene(SHAPE, (48, 72), 5.0)


def density(frame: int) -> np.ndarray:
    """A structured ball that rises by a voxel every other frame."""
    x, y, z = np.indices(SHAPE) - np.array([7.5, 7.5, 8 + frame / 2])[:, None, None, None]
    structure = 1 + 0.5 * np.sin(1.9 * x + y) * np.cos(1.7 * y) * np.sin(1.5 * z - x)
    return np.maximum(np.exp(-(x**2 + y**2 + z**2) / 14) * structure - 0.05, 0).astype(np.float32)


@pytest.fixture(scope="module")
def known(tmp_path_factory) -> KnownScene:
    path = tmp_path_factory.mktemp("ball") / "scene.toml"
    SCENE.save(path)
    known = truth(np.stack([density(frame) for frame in range(FRAMES)]), VOXEL)
    cameras = {str(angle): orbit(SCENE.camera, SCENE.domain, angle) for angle in (0, 20, 45, 90)}
    renderers = {view: scene_renderer(completed(SCENE), camera, BLACK) for view, camera in cameras.items()}
    span = range(FRAMES)
    seen = {(view, k): renderer.image(known.density(k)) for view, renderer in renderers.items() for k in span}
    return KnownScene(
        "ball", path, span, span, cameras, lambda view, frame: seen[view, frame], lambda *_: seen["0", 0], known
    )


def test_the_truth_has_the_truth_s_orbit(known, tmp_path) -> None:
    row = score(known, "truth", tmp_path)
    assert row["ssim_new"] == pytest.approx(1)
    assert row["patches"] == 0 < row["patches_own"]
    assert (row["edges"], row["flicker"]) == pytest.approx((1, 1))
