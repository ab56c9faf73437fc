"""The paper's density fit, depth prior and temporal prior."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from smokelift.baselines.density import AllCarried, FixedRateDescent, OrthogonalCopy
from smokelift.density import FittedDensity, Observation, Smoke, ViewSet
from smokelift.render import DeviceError, device, render, scene_optics
from smokelift.scene import Scene, completed, orbit


@pytest.fixture(scope="module")
def small(plume) -> Scene:
    """The plume's scene with a picture as fine as the grid."""
    return replace(plume.scene, camera=plume.scene.camera.resized(30, 42), clip=None)


def fitted(
    scene: Scene, images: dict[float, np.ndarray], iterations: int, initial: np.ndarray | None = None
) -> FittedDensity:
    """The density found from pictures, by the degrees by which their cameras are carried around the box."""
    observations = [Observation(orbit(scene.camera, scene.domain, angle), image) for angle, image in images.items()]
    views = ViewSet.of(observations, scene_optics(completed(scene)))
    return FixedRateDescent(iterations=iterations).fit(views, OrthogonalCopy().estimate(views), initial)


def test_without_taichi_the_fit_is_refused(monkeypatch) -> None:
    """Before anything is done, with what to install."""
    monkeypatch.setattr(device, "has_taichi", lambda: False)
    with pytest.raises(DeviceError, match=r"The paper's method cannot run, as Taichi is not installed: "):
        FixedRateDescent()


def test_an_empty_picture_gives_zeros(small) -> None:
    """No smoke, no density, even from a start that has some."""
    nothing = np.zeros((42, 30, 3), np.float32)
    for initial in (None, np.ones(small.domain.resolution, np.float32)):
        found = fitted(small, {0.0: nothing}, 5, initial)
        assert not found.density.any()
        assert found.figures["hull_share"] == 0


def test_the_descent_goes_on_from_its_own_result(plume, small) -> None:
    """A second run that starts where the first ended does not lead away from the pictures.

    What falls is the loss of both views together, so the front's may rise by a little.
    """
    target = render(plume.densities[1], small)
    first = fitted(small, {0.0: target}, 20)
    second = fitted(small, {0.0: target}, 20, first.density)
    assert second.figures["loss"] <= 1.01 * first.figures["loss"]


def test_the_descent_lowers_the_loss(plume, small) -> None:
    """The faithful loop gets nearer and stays non-negative."""
    target = render(plume.densities[1], small)
    found = [fitted(small, {0.0: target}, count) for count in (0, 5, 15)]
    losses = [density.figures["loss"] for density in found]
    assert losses[0] > losses[1] > losses[2]
    assert found[-1].density.min() >= 0


def test_true_views_take_the_place_of_the_copy(plume, small) -> None:
    """The side that is seen comes before the one that is made up."""
    truth = np.roll(plume.densities[1], 5, axis=1)
    front = {0.0: render(truth, small)}
    both = front | {90.0: render(truth, small, orbit(small.camera, small.domain, 90))}
    places = [
        np.average(np.indices(truth.shape)[1], weights=fitted(small, pictures, 15).density)
        for pictures in (front, both)
    ]
    assert places[1] > places[0] + 1


def test_all_of_the_carried_density_is_taken(plume, small) -> None:
    """As it is."""
    views = ViewSet.of([Observation(small.camera, render(plume.densities[1], small))], scene_optics(completed(small)))
    depth = OrthogonalCopy().estimate(views)
    carried, before = Smoke(plume.densities[1]), Smoke(plume.densities[0])
    assert AllCarried().start(views, depth, carried, before).density is carried.density
