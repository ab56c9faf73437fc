"""How much of the carried density a frame starts from: as much as the picture bears out."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
import pytest
from scipy import ndimage

from smokelift.density import (
    BlendCarried,
    DepthEstimate,
    GuidedSimulation,
    Observation,
    RoundDepth,
    Smoke,
    Start,
    ViewSet,
)
from smokelift.density.objective import Term
from smokelift.density.temporal_prior import LARGEST_GAIN
from smokelift.footage.noise import lasting_noise
from smokelift.footage.plate import Plate
from smokelift.render import Volume, render, scene_optics
from smokelift.scene import completed

LARGEST = 0.5


@dataclass(frozen=True, eq=False)
class Moment:
    """A frame of the plume: its picture, what the depth prior says, the true density, and that of the frame before."""

    views: ViewSet
    depth: DepthEstimate
    true: Volume
    before: Volume

    @property
    def prior(self) -> Volume:
        """The depth prior's density."""
        return self.depth.density

    def start(self, carried: Volume) -> Start:
        """Where the fit starts with a carried density."""
        return BlendCarried(LARGEST).start(self.views, self.depth, Smoke(carried), Smoke(self.before))


@pytest.fixture(scope="module")
def moment(plume) -> Moment:
    """The third frame, before black with the noise of 8 bits."""
    scene, before, true = plume.scene, *plume.densities[1:3]
    image = render(true, scene)
    plate = Plate(np.zeros_like(image), np.ones(image.shape[:2], np.float32), lasting_noise(1e-4 * 12.92))
    views = ViewSet.of([Observation(scene.camera, image, plate)], scene_optics(completed(scene)))
    return Moment(views, RoundDepth().estimate(views), true, before)


def test_what_proves_right_is_taken_over(moment) -> None:
    """Carried to where the picture shows it, the density gets nearly all of the share that it may have."""
    start = moment.start(moment.true)
    assert 0.9 * LARGEST < start.figures["share"] <= LARGEST
    assert 0.9 * LARGEST < start.figures["amounts"] <= LARGEST
    assert np.linalg.norm(start.density - moment.true) < 0.7 * np.linalg.norm(moment.prior - moment.true)


@pytest.mark.parametrize("step", [-3, -1, 8])
def test_a_wrong_motion_is_rejected(moment, step) -> None:
    """Carried downward, or far too fast, the density is no better than left in place, and none of it is taken over."""
    assert moment.start(np.roll(moment.before, step, axis=2)).figures["share"] == 0


def test_amounts_that_are_worse_than_the_pictures_own_are_not_taken_over(moment) -> None:
    for wrong in (0.02, 12.0):
        carried = np.float32(wrong) * moment.true
        start = moment.start(carried)
        share = start.figures["share"]
        assert start.figures["amounts"] == 0
        np.testing.assert_allclose(start.density, (1 - share) * moment.prior + share * carried, rtol=1e-5)


@pytest.mark.parametrize("empty", ["prior", "carried"])
def test_without_smoke_the_priors_density_stays(moment, empty) -> None:
    nothing = np.zeros_like(moment.true)
    prior, carried = (nothing, moment.true) if empty == "prior" else (moment.prior, nothing)
    start = replace(moment, depth=replace(moment.depth, density=prior)).start(carried)
    np.testing.assert_array_equal(start.density, prior)
    assert start.figures == {"share": 0.0, "amounts": 0.0}


def blurred(density: Volume) -> Volume:
    """A density without what the simulation decides."""
    return ndimage.gaussian_filter(density, 5.0, truncate=3.0)


@dataclass(frozen=True, eq=False)
class Lobes:
    """Detail whose lobes are some voxels wide."""

    views: ViewSet
    smooth: Volume

    def added(self, density: Volume, cameras: Sequence[Term], *, fresh: bool) -> Volume:
        return density

    def amounts(self, density: Volume) -> np.ndarray:
        return blurred(density)[self.views.hull]


@pytest.fixture(scope="module")
def prior_start(moment) -> DepthEstimate:
    """What a depth prior says that has made something up: its smooth answer beside a density."""
    density = 0.9 * moment.prior + 0.1 * blurred(moment.prior)
    return replace(moment.depth, density=density, detail=Lobes(moment.views, moment.prior))


def guided(moment: Moment, prior_start: DepthEstimate, carried: Volume, smooth: Volume | None = None) -> Start:
    """Where a guided simulation starts, with all of what is carried."""
    carried_smoke, before = Smoke(carried, smooth), Smoke(moment.before)
    return GuidedSimulation(LARGEST, kept=1.0).start(moment.views, prior_start, carried_smoke, before)


def test_a_simulation_is_guided_to_the_smooth_answers_amounts(moment, prior_start) -> None:
    """Coarsely the start is the smooth answer, finely it is what was carried, however much that was."""
    hull = moment.views.hull
    starts = [guided(moment, prior_start, np.float32(factor) * moment.true).density for factor in (1.0, 8.0)]
    wanted, found = blurred(moment.prior)[hull], blurred(starts[0])[hull]
    assert np.linalg.norm(found - wanted) < 0.15 * np.linalg.norm(wanted)
    detail, carried = ((density - blurred(density))[hull] for density in (starts[0], moment.true))
    assert np.corrcoef(detail, carried)[0, 1] > 0.8
    np.testing.assert_allclose(starts[1], starts[0], rtol=1e-3, atol=1e-6)


def test_detail_is_born_where_nothing_is_carried(moment, prior_start) -> None:
    hull = moment.views.hull
    empty = guided(moment, prior_start, np.zeros_like(moment.true))
    np.testing.assert_array_equal(empty.density[hull], prior_start.density[hull])
    assert empty.figures["share"] == 0
    little = guided(moment, prior_start, np.float32(0.01) * moment.prior)
    assert 0 < little.figures["share"] <= 0.011 * LARGEST_GAIN
    np.testing.assert_allclose(little.density.sum(), prior_start.density[hull].sum(), rtol=0.02)


def test_a_hole_that_smoke_entered_through_is_filled(moment, prior_start) -> None:
    """It is narrower than the blur; where the smooth answer came along, a gap is detail and stays."""
    smooth, holed = moment.prior, moment.true.copy()
    entrance = np.zeros_like(moment.views.hull)
    row = int(smooth.sum((0, 1)).argmax())
    entrance[:, :, row] = moment.views.hull[:, :, row]
    holed[entrance] = 0
    gap, hole = (
        guided(moment, prior_start, holed, came).density for came in (smooth, np.where(entrance, np.float32(0), smooth))
    )
    np.testing.assert_array_equal(gap, guided(moment, prior_start, holed).density)
    dense = entrance & (smooth > smooth[moment.views.hull].mean())
    np.testing.assert_allclose(hole[dense], prior_start.density[dense], rtol=0.1)
    assert gap[dense].sum() < 0.5 * hole[dense].sum()
    np.testing.assert_array_equal(hole[~entrance], gap[~entrance])


def test_without_anything_made_up_the_carried_density_is_judged(moment) -> None:
    found = GuidedSimulation(LARGEST).start(moment.views, moment.depth, Smoke(moment.true), Smoke(moment.before))
    np.testing.assert_array_equal(found.density, moment.start(moment.true).density)
