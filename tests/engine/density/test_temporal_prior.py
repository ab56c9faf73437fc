"""How much of the carried density a frame starts from: a share, or its detail with the smooth density's low pass."""

from dataclasses import dataclass, replace

import numpy as np
import pytest
from scipy import ndimage

from smokelift.density import AdvectedDetail, DepthEstimate, Observation, RoundDepth, Start, ViewSet
from smokelift.density.observation import eight_bit_plate
from smokelift.density.temporal_prior import MAX_ADVECTED_GAIN, RETENTION
from smokelift.render import Volume, render, scene_optics
from smokelift.scene import completed

BLEND = 0.5


@dataclass(frozen=True, eq=False)
class Moment:
    """A frame of the plume: what the depth prior says of its picture, and the true density."""

    depth: DepthEstimate
    true: Volume

    @property
    def prior(self) -> Volume:
        """The depth prior's density."""
        return self.depth.density

    def start(self, carried: Volume, smooth: Volume | None = None) -> Start:
        """Where the fit starts with a carried density, which is its own smooth density unless that is given."""
        return AdvectedDetail(BLEND).start(self.depth, carried, carried if smooth is None else smooth)


@pytest.fixture(scope="module")
def moment(plume) -> Moment:
    """The third frame, before black with the noise of 8 bits."""
    scene, true = plume.scene, plume.densities[2]
    plate = eight_bit_plate(np.zeros(3, np.float32), scene.camera.size)
    views = ViewSet.of([Observation(scene.camera, render(true, scene), plate)], scene_optics(completed(scene)))
    return Moment(RoundDepth().estimate(views), true)


def test_a_fraction_is_taken_over(moment) -> None:
    start = moment.start(moment.true)
    assert start.figures == {"share": BLEND}
    np.testing.assert_allclose(start.density, (moment.prior + moment.true) / 2, rtol=1e-6)


@pytest.mark.parametrize("empty", ["prior", "carried"])
def test_without_smoke_the_priors_density_stays(moment, empty) -> None:
    nothing = np.zeros_like(moment.true)
    prior, carried = (nothing, moment.true) if empty == "prior" else (moment.prior, nothing)
    start = replace(moment, depth=replace(moment.depth, density=prior)).start(carried)
    np.testing.assert_array_equal(start.density, prior)
    assert start.figures == {"share": 0.0}


def blurred(density: Volume) -> Volume:
    """A density without what the simulation decides."""
    return ndimage.gaussian_filter(density, 5.0, truncate=3.0)


@dataclass(frozen=True, eq=False)
class Lobes:
    """Detail whose lobes are some voxels wide."""

    views: ViewSet
    smooth_density: Volume

    def added(self, density: Volume, *, fresh: bool) -> Volume:
        return density

    def low_pass(self, density: Volume) -> np.ndarray:
        return blurred(density)[self.views.hull]


@pytest.fixture(scope="module")
def detailed(moment) -> Moment:
    """The same with a depth prior that has made something up: its smooth density beside a density."""
    density = 0.9 * moment.prior + 0.1 * blurred(moment.prior)
    detail = Lobes(moment.depth.views, moment.prior)
    return replace(moment, depth=replace(moment.depth, density=density, detail=detail))


def test_a_simulation_is_guided_to_the_smooth_answers_low_pass(moment, detailed) -> None:
    """Coarsely the start is the smooth density, finely it is what was carried, however much that was."""
    hull = moment.depth.views.hull
    starts = [detailed.start(np.float32(factor) * moment.true, moment.prior).density for factor in (1.0, 8.0)]
    wanted, found = blurred(moment.prior)[hull], blurred(starts[0])[hull]
    assert np.linalg.norm(found - wanted) < 0.15 * np.linalg.norm(wanted)
    detail, carried = ((density - blurred(density))[hull] for density in (starts[0], moment.true))
    assert np.corrcoef(detail, carried)[0, 1] > 0.8
    np.testing.assert_allclose(starts[1], starts[0], rtol=1e-3, atol=1e-6)


def test_detail_is_born_where_nothing_is_carried(moment, detailed) -> None:
    hull = moment.depth.views.hull
    empty = detailed.start(np.zeros_like(moment.true))
    np.testing.assert_array_equal(empty.density[hull], detailed.prior[hull])
    assert empty.figures["share"] == 0
    little = detailed.start(np.float32(0.01) * moment.prior)
    assert 0 < little.figures["share"] <= 0.011 * MAX_ADVECTED_GAIN
    np.testing.assert_allclose(little.density.sum(), detailed.prior[hull].sum(), rtol=0.02)
    assert detailed.start(moment.prior).figures["share"] == pytest.approx(RETENTION, rel=0.02)


def test_a_layer_that_entered_is_filled_though_it_is_thinner_than_a_lobe(detailed) -> None:
    """What is beside it grows no denser for it."""
    gap = np.ones(detailed.true.shape, np.float32)
    gap[:, :, 10:12] = 0
    starts = [detailed.start(factor * detailed.prior, factor * detailed.prior).density for factor in (gap, gap**0)]
    row_sums = [start.sum((0, 1)) for start in starts]
    np.testing.assert_allclose(*row_sums, rtol=0.05, atol=0.01 * row_sums[1].max())
