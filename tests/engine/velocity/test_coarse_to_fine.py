"""The velocity estimate: what it recovers, what it does not depend on, how it fails, what it refuses."""

import dataclasses

import numpy as np
import pytest

from smokelift import Velocity, _core, estimate_velocity
from smokelift.baselines.paper_method import PaperVelocity
from smokelift.scene import SIDES, Camera, Domain
from smokelift.transport import divergence, face_shapes
from smokelift.velocity import CoarseToFine, DensityPair, PicturePair, ProjectedCG, VelocitySettings, predict_velocity
from smokelift.velocity.coarse_to_fine import ONE_VIEW_SMOOTHNESS
from smokelift.velocity.optical_flow import correct_by_optical_flow
from smokelift.velocity.pyramid import refine
from tests.engine.velocity.known_motions import (
    DT,
    LARGE,
    SHAPE,
    VOXEL,
    error_in_smoke,
    mean_motion,
    positions,
    rotation,
    structured_density,
    translation,
    uniform,
    voxels_per_frame,
)

DEFAULT, PAPER = CoarseToFine(), PaperVelocity()
BOTH = pytest.mark.parametrize("estimator", [DEFAULT, PAPER], ids=["default", "paper"])

SMOOTH = VelocitySettings(smoothness=3.0, solver=ProjectedCG(tolerance=0.003, iterations=100))
"""For the data term, the grids and the solver: so smooth that little else decides."""


@pytest.mark.parametrize(
    ("motion", "coarsening", "limit"),
    [
        (translation((0.7, 0.0, 0.0), **LARGE), 0, 0.2),
        (translation((1.5, -1.0, 3.5), **LARGE), 0, 0.2),
        (rotation(0.12, **LARGE), 0, 0.28),
        # waves of 16 voxels, in a box that does not halve evenly
        (translation((0.6, -1.0, 1.6), (49, 46, 51), 14.0), 1, 0.2),
        (translation((0.6, -1.0, 1.6), (49, 46, 51), 14.0), 2, 0.25),
    ],
)
def test_recovers_a_translation_and_a_turn(motion, coarsening, limit):
    """On the densities' grid and on coarser ones; what comes out has the grid of the densities."""
    before, after, truth = motion
    velocity = estimate_velocity(before, after, DT, VOXEL, dataclasses.replace(SMOOTH, coarsening=coarsening))
    assert error_in_smoke(velocity, after, truth) < limit
    assert velocity.figures["divergence"] < 1e-5
    assert (velocity.shape, velocity.voxel_size) == (after.shape, VOXEL)


@BOTH
def test_an_estimate_of_one_view_is_smoother_and_corrected_by_its_pictures(estimator):
    """The paper's is not."""
    before, after, _ = translation((0.4, 0.2, 0.6))
    pair = DensityPair(before, after, DT, VOXEL)
    domain = Domain((0.0, 0.0, 0.0), tuple(VOXEL * n for n in before.shape), before.shape)
    camera = Camera.look_at((0, -9, 0), domain.centre, fov_y_degrees=30, size=(24, 24))
    pictures = PicturePair(*np.random.default_rng(0).random((2, 24, 24), np.float32), camera, domain)
    found = estimator.estimate(pair, None, pictures)
    expected = estimator.estimate(pair)
    if estimator is DEFAULT:
        usual = VelocitySettings()
        smooth = dataclasses.replace(usual, smoothness=ONE_VIEW_SMOOTHNESS * usual.smoothness)
        expected = correct_by_optical_flow(CoarseToFine(smooth).estimate(pair), pictures, after, DT)
    for component, wanted in zip(found.faces, expected.faces, strict=True):
        np.testing.assert_array_equal(component, wanted)


def test_a_coarser_grid_knows_inlets():
    """They are put onto it: marked voxels are not taken for motion."""
    before, after, truth = translation((0.8, 0.4, 1.2), (44, 44, 44), 10.0)
    coarse = VelocitySettings(coarsening=1, solver=SMOOTH.solver)
    inflow = np.zeros(after.shape, bool)
    inflow[20:24, 20:24, 2:6] = True
    marked, not_marked = (
        error_in_smoke(estimate_velocity(before, after + 2 * inflow, DT, VOXEL, coarse, inflow=where), after, truth)
        for where in (inflow, None)
    )
    assert marked < 0.7 * not_marked


def test_an_estimate_on_a_coarser_grid_guides_the_next_one() -> None:
    """It leads back to the densities' grid, and its prediction guides as the same one on that grid does."""
    before, after, _ = translation((0.8, 0.4, 1.2), (25, 24, 28), 10.0)
    estimator = CoarseToFine(dataclasses.replace(SMOOTH, coarsening=1))
    found = estimator.estimate(DensityPair(before, after, DT, VOXEL))
    assert (found.shape, found.voxel_size) == ((13, 12, 14), 2 * VOXEL)
    fine = refine(found, before.shape)
    assert (fine.shape, fine.voxel_size) == (before.shape, VOXEL)
    assert refine(fine, fine.shape) is fine
    wanted = estimate_velocity(before, after, DT, VOXEL, estimator.settings)
    np.testing.assert_array_equal(fine.centres(), wanted.centres())
    prediction = estimator.predict(found, DT)
    for given in (prediction, refine(prediction, before.shape)):
        assert estimator.estimate(DensityPair(before, after, DT, VOXEL), given).figures["trust"] > 0.5


@BOTH
def test_units_do_not_matter(estimator):
    before, after, _ = translation((0.4, 0.2, 0.6))
    reference = estimator.estimate(DensityPair(before, after, DT, VOXEL)).centres()
    for density, length, time in ((0.01, 1, 10), (100, 100, 1)):
        other = estimator.estimate(DensityPair(density * before, density * after, time * DT, length * VOXEL)).centres()
        assert np.linalg.norm(other * (time / length) - reference) < 0.01 * np.linalg.norm(reference)


@BOTH
def test_number_of_threads_does_not_matter(estimator):
    before, after, _ = rotation(0.1)
    _core.set_threads(2)
    two = estimator.estimate(DensityPair(before, after, DT, VOXEL))
    _core.set_threads(1)
    one = estimator.estimate(DensityPair(before, after, DT, VOXEL))
    for a, b in zip(two.faces, one.faces, strict=True):
        np.testing.assert_array_equal(a, b)


def test_marked_inflow_is_no_motion():
    """Smoke that stays where it is, and an inlet in it."""
    x, y, z = positions(SHAPE)
    before, source = structured_density(x, y, z), (x**2 + y**2 < 9) & (abs(z + 6) < 2)
    plain, marked = (
        np.linalg.norm(estimate_velocity(before, before + 0.3 * source, DT, VOXEL, inflow=inflow).centres())
        for inflow in (None, source)
    )
    assert marked < 0.1 * plain


def test_a_true_prediction_is_trusted_and_a_wrong_one_is_not():
    before, after, truth = rotation(0.2)
    right = estimate_velocity(before, after, DT, VOXEL, prediction=turning_faces(0.2))
    assert right.figures["trust"] > 0.9
    assert error_in_smoke(right, after, truth) < 0.15
    refused = estimate_velocity(before, after, DT, VOXEL, prediction=turning_faces(-0.2))
    assert refused.figures["trust"] == 0
    np.testing.assert_array_equal(refused.centres(), estimate_velocity(before, after, DT, VOXEL).centres())


def turning_faces(angle):
    """The displacement of `rotation` on faces, in m/s."""
    c, s = np.cos(angle), np.sin(angle)
    faces = []
    for axis, shape in enumerate(face_shapes(SHAPE)):
        x, _, z = positions(shape)
        faces.append([x - (c * x + s * z), 0 * x, z - (c * z - s * x)][axis] * VOXEL / DT)
    return Velocity(faces, VOXEL)


def test_prediction_is_free_of_divergence_and_keeps_a_uniform_flow():
    steady = uniform((0.3, -0.2, 0.5))
    for a, b in zip(predict_velocity(steady, DT).faces, steady.faces, strict=True):
        np.testing.assert_allclose(a, b, atol=1e-5)
    turning = estimate_velocity(*rotation(0.2)[:2], DT, VOXEL)
    predicted = predict_velocity(turning, DT)
    assert np.abs(divergence(predicted)).max() * VOXEL < 1e-4 * np.abs(predicted.centres()).max()


def test_buoyancy_is_found_beside_a_prediction():
    """Smoke that has gained speed since the prediction was made: the gain is fitted, not left to smoothness."""
    before, after, truth = translation((0.0, 0.0, 1.0), **LARGE)
    slower = uniform((0.0, 0.0, 0.7), before.shape)
    found = estimate_velocity(before, after, DT, VOXEL, prediction=slower)
    assert error_in_smoke(found, after, truth) < 0.5 * error_in_smoke(slower, after, truth)


@pytest.mark.parametrize("noise", [0.01, 0.1])
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


@BOTH
@pytest.mark.parametrize("density", [np.zeros(SHAPE), np.ones(SHAPE), translation((0, 0, 0))[0]])
def test_what_does_not_change_has_no_velocity(estimator, density):
    assert not estimator.estimate(DensityPair(density, density, DT, VOXEL)).centres().any()


# how estimates fail in the field: whatever is put in, what comes out stays sound. Smooth blobs without noise are not
# what the default's weights are for, so the bounds are not those of an exact estimate


@pytest.mark.parametrize("speed", [0.1, 1, 10])
def test_speeds_from_a_tenth_of_a_voxel_to_ten(speed):
    motion = speed * np.array((0.48, -0.6, 0.64))
    before, after, truth = translation(motion, (48, 48, 56), radius=9.0)
    found = estimate_velocity(before, after, DT, VOXEL)
    assert error_in_smoke(found, after, truth) < 0.55
    speeds = np.linalg.norm(voxels_per_frame(found), axis=-1)
    assert 0.7 < speeds[after > 0.1 * after.max()].mean() / speed < 1.3
    assert speeds.max() < 3 * speed


def test_a_chain_of_frames_settles():
    angle, prediction = 0.12, None
    errors, speeds = [], []
    for frame in range(8):
        before, after, truth = rotation(angle, before=angle * frame)
        found = estimate_velocity(before, after, DT, VOXEL, prediction=prediction)
        prediction = predict_velocity(found, DT)
        errors.append(error_in_smoke(found, after, truth))
        largest = np.linalg.norm(truth[after > 0.1 * after.max()], axis=-1).max()
        speeds.append(np.linalg.norm(voxels_per_frame(found), axis=-1).max() / largest)
    assert max(errors[3:]) < 0.85 * errors[0] < 0.65
    assert min(speeds[4:]) > 0.7 and max(speeds[4:]) < 1.6


def test_the_velocity_is_found_in_a_box_of_walls():
    before, after, _ = translation((0.5, -0.3, 0.6))
    found = estimate_velocity(before, after, DT, VOXEL, closed=SIDES)
    assert mean_motion(found, after) == pytest.approx((0.5, -0.3, 0.6), abs=0.2)
    for axis, component in enumerate(found.faces):
        assert not component.take((0, -1), axis).any()


@pytest.mark.parametrize("prediction", [None, uniform((0.5, -0.5, 0.5), SHAPE)], ids=["alone", "predicted"])
def test_smoke_that_is_gone_has_no_velocity(prediction):
    before, _, _ = translation((0.3, 0.2, 0.5))
    gone = estimate_velocity(before, np.zeros(SHAPE), DT, VOXEL, prediction=prediction)
    assert np.abs(voxels_per_frame(gone)).max() < 0.2
    never = estimate_velocity(np.zeros(SHAPE), np.zeros(SHAPE), DT, VOXEL, prediction=prediction)
    assert not never.centres().any()


@pytest.mark.parametrize(
    ("before", "after", "most"),
    [(0.0, 1, 0), (1e-3, 1, 0), *((1, left, 0.05) for left in (1.02, 1.5, 10, 0.95, 0.8, 0.5))],
)
def test_smoke_that_appears_flickers_or_dissolves_does_not_move(before, after, most):
    density = translation((0, 0, 0))[0].astype(np.float32)
    found = estimate_velocity(before * density, after * density, DT, VOXEL)
    assert np.abs(voxels_per_frame(found)).max() <= most
    if after < 1:
        assert found.figures["dissipation"] == pytest.approx(1 - after, abs=0.01)


# what is refused


@pytest.mark.parametrize(
    "change",
    [
        {"after": np.ones((4, 4, 4))},
        {"before": np.ones((4, 4)), "after": np.ones((4, 4))},
        {"dt": 0.0},
        {"dt": float("nan")},
        {"voxel_size": -1.0},
        {"inflow": np.ones((3, 3, 3), bool)},
        {"prediction": Velocity.zero((3, 3, 3), VOXEL)},
        # half of it would fit half of the densities
        {"prediction": Velocity.zero((31, 28, 40), VOXEL), "settings": VelocitySettings(coarsening=1)},
    ],
)
def test_bad_input_is_refused(change):
    before, after, _ = translation((0.1, 0.0, 0.0))
    with pytest.raises(ValueError):
        estimate_velocity(**{"before": before, "after": after, "dt": DT, "voxel_size": VOXEL} | change)


@pytest.mark.parametrize("counts", [{"linearizations": 0}, {"coarsening": -1}, {"linearizations": 2.5}])
def test_grids_and_linearizations_are_counted(counts):
    with pytest.raises(ValueError):
        VelocitySettings(**counts)
