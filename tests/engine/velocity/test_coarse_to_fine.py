"""The velocity estimate: what it recovers, what it does not depend on, what it refuses."""

import dataclasses

import numpy as np
import pytest

from smokelift.baselines.velocity import PaperVelocity
from smokelift.transport import face_shapes
from smokelift.velocity import CoarseToFine, DensityPair, ProjectedCG, Velocity, VelocitySettings, estimate_velocity
from smokelift.velocity.coarse_to_fine import ONE_VIEW_SMOOTHNESS
from smokelift.velocity.estimator import refined_to
from tests.engine.velocity.known_motions import (
    DT,
    LARGE,
    SHAPE,
    VOXEL,
    error_in_smoke,
    positions,
    rotation,
    structured_density,
    translation,
)

DEFAULT, PAPER = CoarseToFine(), PaperVelocity()


# The data term, the grids and the solver: so smooth that little else decides
SMOOTH = VelocitySettings(smoothness=3.0, solver=ProjectedCG(tolerance=0.003, iterations=100))


@pytest.mark.parametrize("motion", [(0.7, 0.0, 0.0), (0.3, -0.5, 1.2), (-0.6, 1.0, -0.9), (1.5, -1.0, 3.5)])
def test_recovers_a_translation(motion):
    before, after, truth = translation(np.array(motion), **LARGE)
    velocity = estimate_velocity(before, after, DT, VOXEL, SMOOTH)
    assert error_in_smoke(velocity, after, truth) < 0.2
    assert velocity.figures["divergence"] < 1e-5


def test_an_estimate_of_one_view_is_smoother():
    smooth = dataclasses.replace(VelocitySettings(), smoothness=ONE_VIEW_SMOOTHNESS * VelocitySettings().smoothness)
    assert DEFAULT.of_one_view() == CoarseToFine(smooth)
    assert PAPER.of_one_view() == PAPER


@pytest.mark.parametrize(("coarsening", "limit"), [(1, 0.2), (2, 0.25)])
def test_a_coarser_grid_finds_what_is_large(coarsening, limit):
    """Waves of 16 voxels, in a box that does not halve evenly; what comes out has the grid of the densities."""
    motion = np.array((0.6, -1.0, 1.6))
    before, after, truth = translation(motion, (49, 46, 51), 14.0)
    velocity = estimate_velocity(before, after, DT, VOXEL, dataclasses.replace(SMOOTH, coarsening=coarsening))
    assert error_in_smoke(velocity, after, truth) < limit
    assert velocity.figures["divergence"] < 1e-5
    assert velocity.shape == velocity.confidence.shape == after.shape
    assert velocity.voxel_size == VOXEL


def test_a_coarser_grid_knows_inlets_and_predictions():
    """They are put onto it: marked voxels are not taken for motion, and a true prediction is trusted."""
    before, after, truth = translation(np.array((0.8, 0.4, 1.2)), (44, 44, 44), 10.0)
    coarse = VelocitySettings(coarsening=1, solver=SMOOTH.solver)
    inflow = np.zeros(after.shape, bool)
    inflow[20:24, 20:24, 2:6] = True
    new = after + 2 * inflow
    marked, not_marked = (
        error_in_smoke(estimate_velocity(before, new, DT, VOXEL, coarse, inflow=where), after, truth)
        for where in (inflow, None)
    )
    assert marked < 0.7 * not_marked
    faces = tuple(np.full(n, v * VOXEL / DT) for n, v in zip(face_shapes(after.shape), truth[0, 0, 0], strict=True))
    guided = estimate_velocity(before, after, DT, VOXEL, coarse, prediction=Velocity(faces, VOXEL))
    assert guided.figures["trust"] > 0.95
    assert error_in_smoke(guided, after, truth) < 0.15


@pytest.mark.parametrize("angle", [0.12, -0.12])
def test_recovers_a_rotation(angle):
    before, after, truth = rotation(angle, **LARGE)
    velocity = estimate_velocity(before, after, DT, VOXEL, SMOOTH)
    assert error_in_smoke(velocity, after, truth) < 0.28


@pytest.mark.parametrize("motion", [(0.7, -0.4, 0.9), (2.1, -1.2, 2.7)])
def test_default_finds_the_motion_of_a_smooth_blob(motion):
    """A blob without texture tells the flow around it as little as to the eye: its mass has to go where it went."""
    x, y, z = positions((48, 48, 48))

    def blob(x, y, z):
        centres = ((3, -2, 1, 70, 1.0), (-4, -3, 5, 50, 0.8), (1, 6, -4, 60, 0.6))
        return sum(a * np.exp(-((x - i) ** 2 + (y - j) ** 2 + (z - k) ** 2) / s) for i, j, k, s, a in centres)

    before, after = blob(x, y, z), blob(x - motion[0], y - motion[1], z - motion[2])
    velocity = estimate_velocity(before, after, DT, VOXEL)
    mean = np.average(velocity.centres().reshape(-1, 3), axis=0, weights=after.ravel()) * DT / VOXEL
    assert np.linalg.norm(mean - motion) < 0.15 * np.linalg.norm(motion)


@pytest.mark.parametrize("estimator", [DEFAULT, PAPER], ids=["default", "paper"])
@pytest.mark.parametrize("scale", [0.01, 100])
def test_scale_of_density_does_not_matter(estimator, scale):
    before, after, _ = translation(np.array([0.4, 0.2, 0.6]))
    reference = estimator.estimate(DensityPair(before, after, DT, VOXEL)).centres()
    scaled = estimator.estimate(DensityPair(scale * before, scale * after, DT, VOXEL)).centres()
    assert np.linalg.norm(scaled - reference) < 0.01 * np.linalg.norm(reference)


@pytest.mark.parametrize("estimator", [DEFAULT, PAPER], ids=["default", "paper"])
def test_units_of_space_and_time_do_not_matter(estimator):
    before, after, _ = translation(np.array([0.4, 0.2, 0.6]))
    reference = estimator.estimate(DensityPair(before, after, DT, VOXEL)).centres()
    centimetres = estimator.estimate(DensityPair(before, after, DT, 100 * VOXEL)).centres()
    slower = estimator.estimate(DensityPair(before, after, 10 * DT, VOXEL)).centres()
    assert np.linalg.norm(centimetres / 100 - reference) < 0.01 * np.linalg.norm(reference)
    assert np.linalg.norm(slower * 10 - reference) < 0.01 * np.linalg.norm(reference)


@pytest.mark.parametrize("estimator", [DEFAULT, PAPER], ids=["default", "paper"])
def test_number_of_threads_does_not_matter(estimator, set_threads):
    before, after, _ = rotation(0.1)
    set_threads(2)
    two = estimator.estimate(DensityPair(before, after, DT, VOXEL))
    set_threads(1)
    one = estimator.estimate(DensityPair(before, after, DT, VOXEL))
    for a, b in zip(two.faces, one.faces, strict=True):
        np.testing.assert_array_equal(a, b)


def growing_source():
    """Smoke that stays where it is, and an inlet in it."""
    x, y, z = positions(SHAPE)
    before = structured_density(x, y, z)
    source = (x**2 + y**2 < 9) & (abs(z + 6) < 2)
    return before, before + 0.3 * source, source


def test_marked_inflow_is_no_motion():
    before, after, source = growing_source()
    plain = estimate_velocity(before, after, DT, VOXEL)
    marked = estimate_velocity(before, after, DT, VOXEL, inflow=source)
    assert np.linalg.norm(marked.centres()) < 0.1 * np.linalg.norm(plain.centres())


def test_a_true_prediction_is_trusted_and_a_wrong_one_is_not():
    before, after, truth = rotation(0.2)
    faces = turning_faces(0.2)
    right = estimate_velocity(before, after, DT, VOXEL, prediction=faces)
    wrong = Velocity([-component for component in faces.faces], VOXEL)
    refused = estimate_velocity(before, after, DT, VOXEL, prediction=wrong)
    assert right.figures["trust"] > 0.9
    assert error_in_smoke(right, after, truth) < 0.15
    assert refused.figures["trust"] == 0
    np.testing.assert_array_equal(refused.centres(), estimate_velocity(before, after, DT, VOXEL).centres())


def turning_faces(angle):
    """The displacement of `rotation` on faces, in m/s."""
    c, s = np.cos(angle), np.sin(angle)
    faces = []
    for axis in range(3):
        shape = [n + (d == axis) for d, n in enumerate(SHAPE)]
        x, _, z = (
            i - (n - 1) / 2 - 0.5 * (d == axis) for d, (i, n) in enumerate(zip(np.indices(shape), SHAPE, strict=True))
        )
        faces.append([x - (c * x + s * z), 0 * x, z - (c * z - s * x)][axis] * VOXEL / DT)
    return Velocity(faces, VOXEL)


def test_buoyancy_is_found_beside_a_prediction():
    """Smoke that has gained speed since the prediction was made: the gain is fitted, not left to smoothness."""
    before, after, truth = translation(np.array([0.0, 0.0, 1.0]), **LARGE)
    zero = Velocity.zero(before.shape, VOXEL)
    slower = Velocity([c + np.float32(0.7 * VOXEL / DT) * (a == 2) for a, c in enumerate(zero.faces)], VOXEL)
    found = estimate_velocity(before, after, DT, VOXEL, prediction=slower)
    assert error_in_smoke(found, after, truth) < 0.5 * error_in_smoke(slower, after, truth)


@pytest.mark.parametrize("noise", [0.01, 0.03, 0.1])
def test_noise_is_not_turbulence(noise):
    before, after, _ = rotation(0.15)
    rng = np.random.default_rng(1)
    noisy = (np.maximum(a + noise * a.max() * rng.standard_normal(SHAPE) * (a > 0.01), 0) for a in (before, after))
    inside = after > 0.1 * after.max()
    speed, clean = (
        np.linalg.norm(estimate_velocity(*pair, DT, VOXEL).centres()[inside], axis=-1)
        for pair in (noisy, (before, after))
    )
    assert speed.max() < 1.4 * clean.max()
    assert speed.mean() < 1.4 * clean.mean()


def test_confidence_is_where_there_is_structure():
    before, after, _ = rotation(0.1)
    confidence = estimate_velocity(before, after, DT, VOXEL).confidence
    assert confidence.shape == SHAPE
    assert confidence.min() >= 0 and confidence.max() <= 1
    assert confidence[after > 0.3 * after.max()].mean() > 0.5 > 0.05 > confidence[:3, :3, :3].max()


@pytest.mark.parametrize("estimator", [DEFAULT, PAPER], ids=["default", "paper"])
@pytest.mark.parametrize("density", [np.zeros(SHAPE), np.ones(SHAPE)])
def test_nothing_to_see_gives_zero(estimator, density):
    velocity = estimator.estimate(DensityPair(density, density, DT, VOXEL))
    assert not velocity.centres().any()


@pytest.mark.parametrize("estimator", [DEFAULT, PAPER], ids=["default", "paper"])
def test_smoke_at_rest_has_no_velocity(estimator):
    before, _, _ = translation(np.zeros(3))
    velocity = estimator.estimate(DensityPair(before, before, DT, VOXEL))
    assert not velocity.centres().any()


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"before": np.full(SHAPE, np.nan)}, "before holds densities that are not finite"),
        ({"after": np.full(SHAPE, -1.0)}, "after holds negative densities"),
        ({"after": np.ones((4, 4, 4))}, "after has shape"),
        ({"before": np.ones((4, 4))}, "three-dimensional"),
        ({"dt": 0.0}, "dt must be positive"),
        ({"dt": float("nan")}, "dt must be positive"),
        ({"voxel_size": -1.0}, "voxel_size must be positive"),
        ({"inflow": np.ones((3, 3, 3), bool)}, "inflow has shape"),
        ({"prediction": Velocity.zero((3, 3, 3), VOXEL)}, "prediction has shape"),
        # half of it would fit half of the densities
        (
            {"prediction": Velocity.zero((31, 28, 40), VOXEL), "settings": VelocitySettings(coarsening=1)},
            "prediction has shape",
        ),
        ({"closed": ("top",)}, "closed must be a list of sides"),
    ],
)
def test_bad_input_is_refused(change, message):
    before, after, _ = translation(np.array([0.1, 0.0, 0.0]))
    arguments = {"before": before, "after": after, "dt": DT, "voxel_size": VOXEL} | change
    with pytest.raises(ValueError, match=message):
        estimate_velocity(**arguments)


@pytest.mark.parametrize("counts", [{"linearisations": 0}, {"coarsening": -1}, {"linearisations": 2.5}])
def test_grids_and_linearisations_are_counted(counts):
    (name,) = counts
    with pytest.raises(ValueError, match=f"{name} must be a whole number from"):
        VelocitySettings(**counts)


def test_estimate_on_a_coarser_grid_guides_the_next_one() -> None:
    """It leads back to the densities' grid, and its prediction guides as the same one on that grid does."""
    before, after, _ = translation(np.array((0.8, 0.4, 1.2)), (25, 24, 28), 10.0)
    estimator = CoarseToFine(dataclasses.replace(SMOOTH, coarsening=1))
    found = estimator.estimate(DensityPair(before, after, DT, VOXEL))
    assert found.shape == (13, 12, 14)
    assert found.voxel_size == 2 * VOXEL
    fine = refined_to(found, before.shape)
    assert fine.shape == before.shape
    assert fine.voxel_size == VOXEL
    assert refined_to(fine, fine.shape) is fine
    np.testing.assert_array_equal(
        fine.centres(), estimate_velocity(before, after, DT, VOXEL, estimator.settings).centres()
    )
    prediction = estimator.predict(found, DT)
    finely = refined_to(prediction, before.shape)
    for given in (prediction, finely):
        guided = estimator.estimate(DensityPair(before, after, DT, VOXEL), given)
        assert guided.figures["trust"] > 0.5
