"""The velocity that one camera's pictures correct: what it takes from them, and what it leaves."""

from dataclasses import replace

import numpy as np
import pytest
from scipy import ndimage

from smokelift.pipeline import compose
from smokelift.scene import Camera, Domain, look_at_matrix
from smokelift.scene.camera import project_points
from smokelift.setup.settings import Settings
from smokelift.transport import Velocity, face_shapes, on_faces, project
from smokelift.velocity.optical_flow import PicturePair, averaged_along, correct_by_optical_flow
from tests.engine.transport.random_fields import random_velocity, uniform

DT = 1 / 24
DOMAIN = Domain((-0.5, -0.5, 0.0), (0.5, 0.5, 1.5), (32, 32, 48))
COARSE = (16, 16, 24)
BOX = np.s_[5:-5, 5:-5, 6:-6]
"""Away from the sides."""


def camera(kind: str) -> Camera:
    if kind == "perspective":
        return Camera.look_at((0, -6, 0.75), (0, 0, 0.75), fov_y_degrees=15, size=(40, 60))
    matrix = look_at_matrix((0, -6, 0.75), (0, 0, 0.75), (0, 0, 1))
    return Camera("orthographic", matrix, (40, 60), 38.0, 38.0, 20.0, 30.0)


def texture(seed: int = 0) -> np.ndarray:
    """Smoke all over a picture, with waves of some pixels."""
    noise = np.random.default_rng(seed).standard_normal((60, 40))
    waves = ndimage.gaussian_filter(noise, 2.0)
    return np.asarray(1 + 0.3 * waves / waves.std(), np.float32).clip(0.1)


def seen(velocity: Velocity, across: float, up: float, kind: str) -> Velocity:
    """The velocity corrected by a texture that moves so many pixels per frame to the right and upwards."""
    before = texture()
    after = ndimage.shift(before, (-up, across), order=3, mode="nearest")
    pictures = PicturePair(before, after, camera(kind), DOMAIN)
    return correct_by_optical_flow(velocity, pictures, np.ones(COARSE, np.float32), DT)


def rest() -> Velocity:
    return Velocity.zero(COARSE, 2 * DOMAIN.voxel_size)


@pytest.mark.parametrize("kind", ["perspective", "orthographic"])
def test_smoke_at_rest_is_moved_as_the_picture_moves(kind) -> None:
    """By meters that look as wide as the pixels, somewhat fewer; by none along the line of sight."""
    found = seen(rest(), 0.6, 0.9, kind).centres()[BOX] * DT
    (pixels, *_) = project_points(camera(kind), np.array([[0.0, 0.0, 0.75], [0.01, 0.0, 0.75]]))
    pixel = 0.01 / float(pixels[1, 0] - pixels[0, 0])
    assert 0.5 < found[..., 0].mean() / (0.6 * pixel) < 1
    assert 0.5 < found[..., 2].mean() / (0.9 * pixel) < 1
    assert abs(found[..., 1]).mean() < 0.1 * pixel


def test_motion_along_the_line_of_sight_is_left() -> None:
    towards = np.zeros((*COARSE, 3), np.float32)
    towards[..., 1] = -0.5
    velocity = Velocity(on_faces(towards), 2 * DOMAIN.voxel_size)
    found = seen(velocity, 0.0, 0.0, "orthographic").centres()[BOX]
    np.testing.assert_allclose(found[..., 1], -0.5, atol=0.02)


def test_it_has_no_divergence_and_keeps_what_is_known() -> None:
    known = replace(rest(), closed=("z-",), figures={"trust": 0.5})
    found = seen(known, 0.6, 0.9, "perspective")
    assert project(found).figures["divergence"] < 1e-5
    assert (found.closed, found.figures) == (("z-",), {"trust": 0.5})
    assert not found.faces[2][..., 0].any()


@pytest.mark.parametrize("picture", [np.zeros((60, 40), np.float32), np.ones((60, 40), np.float32)])
def test_a_picture_without_smoke_or_structure_corrects_nothing(picture: np.ndarray) -> None:
    pictures = PicturePair(picture, picture, camera("perspective"), DOMAIN)
    found = correct_by_optical_flow(rest(), pictures, np.zeros(COARSE, np.float32), DT)
    assert not any(component.any() for component in found.faces)


def test_the_paper_uses_no_optical_flow() -> None:
    assert compose(Settings.preset()).optical_flow
    assert not compose(Settings.preset(method="paper")).optical_flow


@pytest.mark.parametrize("size", [(1, 1), (1, 9), (9, 1)])
def test_a_picture_may_be_a_single_row_or_column(size) -> None:
    domain = Domain((-0.1, -0.1, 0.0), (0.1, 0.1, 0.2), (1, 1, 1))
    before, after = np.random.default_rng(0).random((2, *size[::-1]), np.float32)
    velocity = Velocity.zero(domain.resolution, domain.voxel_size)
    pictures = PicturePair(before, after, camera("perspective").resized(*size), domain)
    found = correct_by_optical_flow(velocity, pictures, np.ones((1, 1, 1), np.float32), DT)
    assert all(np.isfinite(component).all() for component in found.faces)


# the average along the line of sight

GRID = (18, 16, 22)
LINES = [(0.0, 1.0, 0.0), (-3.0, 0.0, 0.0), (0.5, 1.0, -0.2)]


def swirling() -> Velocity:
    return project(random_velocity(0, voxel_size=0.1, shape=GRID))


@pytest.mark.parametrize("line", LINES)
def test_the_average_keeps_a_uniform_flow_has_no_divergence_and_goes_either_way(line) -> None:
    flow, back = uniform((1, -2, 3), GRID, 0.1), tuple(-value for value in line)
    mean = averaged_along(swirling(), line)
    assert project(mean).figures["divergence"] < 1e-5
    for found, expected in ((averaged_along(flow, line), flow), (mean, averaged_along(swirling(), back))):
        for here, there in zip(found.faces, expected.faces, strict=True):
            np.testing.assert_allclose(here, there, rtol=1e-4, atol=1e-5)


def test_only_what_changes_along_the_line_is_averaged() -> None:
    z = np.zeros(face_shapes(GRID)[2], np.float32)
    waves = np.sin(2 * np.pi * np.arange(GRID[0]) / 8).astype(np.float32)
    still = tuple(np.zeros(shape, np.float32) for shape in face_shapes(GRID)[:2])
    for axis, left in ((0, 1.0), (1, 0.3)):
        upwards = z + np.moveaxis(waves[: GRID[axis], None, None], 0, axis)
        mean = averaged_along(Velocity((*still, upwards), 0.1), (0.0, 1.0, 0.0)).faces[2]
        middle = (slice(4, -4),) * 3
        ratio = float(np.linalg.norm(mean[middle]) / np.linalg.norm(upwards[middle]))
        assert ratio == pytest.approx(1.0, abs=0.02) if left == 1.0 else ratio < left
