"""The paper's density fit, depth prior and temporal prior."""

import numpy as np
import pytest

from smokelift.baselines.density import FixedRateDescent, OrthogonalCopy
from smokelift.density import FittedDensity, Observation, ViewSet
from smokelift.render import DeviceError, device, render, scene_optics
from smokelift.scene import Scene, completed, orbit


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
