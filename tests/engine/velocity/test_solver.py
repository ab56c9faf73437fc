"""The solvers, on a grid so small that the matrix of the linear problem can be written out."""

import itertools

import numpy as np
import pytest
from scipy import ndimage

from smokelift import _core
from smokelift.baselines.paper_method import PaperVelocity
from smokelift.transport import StaggeredGrid, face_shapes
from smokelift.velocity import DensityPair, PrimalDual
from tests.engine.transport.random_fields import names, random_faces
from tests.engine.velocity.known_motions import DT, VOXEL, translation

OPEN = [False] * 6
TINY = (5, 4, 6)


def tiny_faces(rng):
    return list(random_faces(rng, TINY))


def problem_of(shape, center, **given):
    """The linear problem of a center alone, but for what is given."""
    zero = np.zeros(shape, np.float32)
    cells = {"direction": [zero] * 3, "offset": zero, "weight": zero, "irrotational": zero}
    terms = {"first_order": 0.0, "second_order": 0.0, "kinetic": 0.0, "closed": OPEN}
    return _core.LeastSquares(center=center, **cells | terms | given)


def tiny_problem(rng, first_order=0.05, second_order=0.03, closed=OPEN):
    cells = [rng.standard_normal(TINY).astype(np.float32) for _ in range(4)]
    weights = {name: rng.random(TINY).astype(np.float32) for name in ("weight", "irrotational")}
    terms = {"first_order": first_order, "second_order": second_order, "kinetic": 0.01, "closed": closed}
    return problem_of(TINY, tiny_faces(rng), direction=cells[:3], offset=cells[3], **weights, **terms)


def flat(faces):
    return np.concatenate([a.ravel() for a in faces]).astype(float)


def split(vector):
    shapes = face_shapes(TINY)
    ends = np.cumsum([np.prod(s) for s in shapes])[:-1]
    return [a.reshape(s).astype(np.float32) for a, s in zip(np.split(vector, ends), shapes, strict=True)]


def matrix_of(linear, size):
    return np.stack([linear(split(row)) for row in np.eye(size)], axis=-1)


def constrained_minimum(problem, closed):
    """By a dense solve of the optimality conditions."""
    size = sum(a.size for a in tiny_faces(np.random.default_rng(0)))
    quadratic = matrix_of(lambda u: flat(problem.apply(u)), size)
    constraint = matrix_of(lambda u: _core.divergence(u).ravel().astype(float), size)
    walls = []
    for axis, high in itertools.product(range(3), range(2)):
        marks = split(np.zeros(size))
        marks[axis][tuple(-high if d == axis else slice(None) for d in range(3))] = 1
        if closed[2 * axis + high]:
            walls.append(np.eye(size)[flat(marks) > 0])
    constraint = np.concatenate([constraint, *walls])
    right = np.concatenate([flat(problem.right_hand_side()), np.zeros(len(constraint))])
    zeros = np.zeros((len(constraint), len(constraint)))
    system = np.block([[quadratic, constraint.T], [constraint, zeros]])
    return np.linalg.lstsq(system, right, rcond=None)[0][:size]


@pytest.mark.parametrize("orders", [(0.05, 0.0), (0.0, 0.03)])
@pytest.mark.parametrize("closed", [OPEN, [True, False, False, False, True, True], [True] * 6])
def test_both_solvers_reach_the_constrained_minimum(orders, closed):
    problem = tiny_problem(np.random.default_rng(1), *orders, closed)
    truth = constrained_minimum(problem, closed)
    start = split(np.zeros(truth.size))
    cg, _ = problem.projected_cg(start, tolerance=2e-5, limit=500)
    endless, _ = problem.projected_cg(start, tolerance=0.0, limit=500)
    splitting = PrimalDual(0.3, 3.0, 1.0, 0.0, 1e-5, 2000, inner_tolerance=0.01, inner_iterations=100)
    pd, figures = splitting.solve(problem, StaggeredGrid(tuple(start), 1.0, names(closed)))
    assert np.linalg.norm(flat(cg) - truth) < 3e-3 * np.linalg.norm(truth)
    assert np.linalg.norm(flat(pd.faces) - truth) < 1e-3 * np.linalg.norm(truth)
    # A tolerance out of reach of single precision does not lead away from the minimum again.
    assert np.linalg.norm(flat(endless) - truth) < 0.03 * np.linalg.norm(truth)
    assert figures["iterations"] < 2000


@pytest.mark.parametrize("closed", [OPEN, [True] * 6, [True, False, False, True, True, True]])
def test_the_preconditioner_knows_long_lines(closed):
    """With kinetic energy alone the minimum is the part of the center without divergence; the rest is a gradient.

    Sides of the box apart, the preconditioner is then exact: a few steps are enough, on lines of any length.
    """
    shape = (72, 66, 100)
    rng = np.random.default_rng(4)
    faces = list(random_faces(rng, shape))
    problem = problem_of(shape, faces, kinetic=0.5, closed=closed)
    u, figures = problem.projected_cg([np.zeros_like(a) for a in faces], tolerance=1e-4, limit=20)
    assert figures["iterations"] < 10
    assert np.abs(_core.divergence(u)).max() < 1e-4
    x, y, z = (a - b for a, b in zip(faces, u, strict=True))
    vorticity = np.diff(z[:, :, 1:-1], axis=1)[1:-1] - np.diff(y[:, 1:-1], axis=2)[1:-1]
    assert np.abs(vorticity).max() < 0.01
    vorticity = np.diff(y[:, 1:-1], axis=0)[:, :, 1:-1] - np.diff(x[1:-1], axis=1)[:, :, 1:-1]
    assert np.abs(vorticity).max() < 0.01


def test_a_uniform_flow_and_a_solid_turn_cost_no_second_order_smoothness():
    problem = problem_of(TINY, [0 * component for component in tiny_faces(np.random.default_rng(0))], second_order=1.0)
    nx, ny, nz = TINY
    turn = [
        np.broadcast_to(np.arange(ny, dtype=np.float32)[None, :, None], (nx + 1, ny, nz)),
        np.broadcast_to(-np.arange(nx, dtype=np.float32)[:, None, None], (nx, ny + 1, nz)),
        np.full((nx, ny, nz + 1), 3, np.float32),
    ]
    np.testing.assert_allclose(flat(problem.apply(turn)), 0, atol=1e-5)


@pytest.mark.parametrize("steps", [{"sigma": 1.0, "tau": 1.01}, {"sigma": -0.1}, {"theta": 1.5}, {"tau": float("nan")}])
def test_steps_that_do_not_converge_are_refused(steps):
    before, after, _ = translation(np.array([0.1, 0.0, 0.0]))
    estimator = PaperVelocity(solver=PrimalDual(**steps))
    with pytest.raises(ValueError, match=r"sigma = .*tau = .*theta = "):
        estimator.estimate(DensityPair(before, after, DT, VOXEL))


@pytest.mark.parametrize(("width", "truncate"), [(0.5, 4.0), (1.0, 3.0), (2.0, 3.0)])
@pytest.mark.parametrize("shape", [(9, 20, 13), (3, 2, 1)])
def test_blur_is_a_gaussian(shape, width, truncate):
    cells = np.random.default_rng(1).random(shape, np.float32)
    expected = ndimage.gaussian_filter(cells, width, truncate=truncate)
    np.testing.assert_allclose(_core.blur(cells, width, truncate), expected, rtol=1e-5)
