"""The paper's density fit, depth prior and velocity estimate."""

import dataclasses

import numpy as np
import pytest
from scipy import ndimage

from smokelift.baselines.paper_method import FixedRateDescent, OrthogonalCopy, PaperVelocity
from smokelift.density import FittedDensity, Observation, ViewSet
from smokelift.render import DeviceError, device, render, scene_optics
from smokelift.scene import Scene, completed, orbit
from smokelift.velocity import VelocitySettings
from smokelift.velocity.estimator import DensityPair
from tests.engine.velocity.known_motions import DT, SHAPE, VOXEL, error_in_smoke, rotation, translation


def fitted(
    scene: Scene, images: dict[float, np.ndarray], iterations: int, initial: np.ndarray | None = None
) -> FittedDensity:
    """The density found from pictures, by the degrees by which their cameras are carried around the box."""
    observations = [Observation(orbit(scene.camera, scene.domain, angle), image) for angle, image in images.items()]
    views = ViewSet.of(observations, scene_optics(completed(scene)))
    return FixedRateDescent(iterations=iterations).fit(views, OrthogonalCopy().estimate(views), initial)


def test_without_taichi_the_fit_is_refused(monkeypatch) -> None:
    monkeypatch.setattr(device, "has_taichi", lambda: False)
    with pytest.raises(DeviceError, match="Taichi"):
        FixedRateDescent()


def test_an_empty_picture_gives_zeros(small) -> None:
    nothing = np.zeros((42, 30, 3), np.float32)
    for initial in (None, np.ones(small.domain.resolution, np.float32)):
        found = fitted(small, {0.0: nothing}, 5, initial)
        assert not found.density.any()
        assert found.figures["hull_share"] == 0


def test_the_descent_lowers_the_loss(plume, small) -> None:
    target = render(plume.densities[1], small)
    found = [fitted(small, {0.0: target}, count) for count in (0, 5, 15)]
    losses = [density.figures["loss"] for density in found]
    assert losses[0] > losses[1] > losses[2]
    assert found[-1].density.min() >= 0


PAPER = PaperVelocity()


def test_paper_mode_recovers_small_motion():
    before, after, truth = translation(np.array([0.1, 0.2, 0.3]))
    velocity = PAPER.estimate(DensityPair(before, after, DT, VOXEL))
    assert error_in_smoke(velocity, after, truth) < 0.15
    assert velocity.figures["divergence"] < 1e-5


def test_paper_mode_does_not_know_the_limits_of_the_default():
    """It stops by its own rule: neither the default's few iterations nor measured noise have a part in it."""
    before, after, _ = rotation(0.15)
    noise = np.random.default_rng(2).standard_normal(SHAPE)
    before = np.maximum(before + 0.1 * noise * (before > 0.01), 0)
    found = PAPER.estimate(DensityPair(before, after, DT, VOXEL))
    assert found.figures["iterations"] > VelocitySettings().solver.iterations
    blurred = [ndimage.gaussian_filter(a.astype(np.float32), PAPER.blur) for a in (before, after)]
    alone = dataclasses.replace(PAPER, blur=0.0).estimate(DensityPair(*blurred, DT, VOXEL))
    # either blur rounds in its own way, which an inner solve may answer by one step more
    np.testing.assert_allclose(found.centres(), alone.centres(), atol=1e-3 * np.abs(alone.centres()).max())
