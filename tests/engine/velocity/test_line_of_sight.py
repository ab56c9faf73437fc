"""The average along the line of sight: what it keeps, what it takes away."""

import numpy as np
import pytest

from smokelift.transport import Velocity, face_shapes, project
from smokelift.velocity.line_of_sight import averaged_along

SHAPE = (18, 16, 22)
LINES = [(0.0, 1.0, 0.0), (-3.0, 0.0, 0.0), (0.5, 1.0, -0.2)]


def swirling(seed: int = 0) -> Velocity:
    rng = np.random.default_rng(seed)
    x, y, z = (rng.standard_normal(shape).astype(np.float32) for shape in face_shapes(SHAPE))
    return project(Velocity((x, y, z), 0.1))


@pytest.mark.parametrize("line", LINES)
def test_a_uniform_flow_stays(line) -> None:
    x, y, z = (np.full(shape, value, np.float32) for shape, value in zip(face_shapes(SHAPE), (1, -2, 3), strict=True))
    flow = Velocity((x, y, z), 0.1)
    for mean, component in zip(averaged_along(flow, line).faces, flow.faces, strict=True):
        np.testing.assert_allclose(mean, component, rtol=1e-4)


@pytest.mark.parametrize("line", LINES)
def test_the_average_has_no_divergence_and_goes_either_way(line) -> None:
    mean = averaged_along(swirling(), line)
    assert project(mean).figures["divergence"] < 1e-5
    back = averaged_along(swirling(), tuple(-value for value in line))
    for here, there in zip(mean.faces, back.faces, strict=True):
        np.testing.assert_allclose(here, there, atol=1e-5)


def test_only_what_changes_along_the_line_is_averaged() -> None:
    z = np.zeros(face_shapes(SHAPE)[2], np.float32)
    waves = np.sin(2 * np.pi * np.arange(SHAPE[0]) / 8).astype(np.float32)
    still = tuple(np.zeros(shape, np.float32) for shape in face_shapes(SHAPE)[:2])
    for axis, left in ((0, 1.0), (1, 0.3)):
        upwards = z + np.moveaxis(waves[: SHAPE[axis], None, None], 0, axis)
        mean = averaged_along(Velocity((*still, upwards), 0.1), (0.0, 1.0, 0.0)).faces[2]
        middle = (slice(4, -4),) * 3
        share = float(np.linalg.norm(mean[middle]) / np.linalg.norm(upwards[middle]))
        assert share == pytest.approx(1.0, abs=0.02) if left == 1.0 else share < left


def test_what_is_known_of_a_velocity_stays() -> None:
    confidence = np.ones(SHAPE, np.float32)
    known = Velocity(swirling().faces, 0.1, closed=("z-",), figures={"trust": 0.5}, confidence=confidence)
    mean = averaged_along(known, (0.0, 1.0, 0.0))
    assert mean.closed == ("z-",)
    assert mean.figures == {"trust": 0.5}
    assert mean.confidence is confidence
    assert not mean.faces[2][..., 0].any()
