"""Noise on lattices, the detail and the wandering of smoke that are made of it, and how rough a clip is."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

import smokelift._core as _core
from smokelift import Camera, Domain, Scene
from smokelift.density import Observation, RoundDepth, ViewSet
from smokelift.density.lattice_noise import DEVIATION, NODE_BLUR, NODES, Wander, lattices, stretched_noise
from smokelift.density.observation import eight_bit_plate
from smokelift.density.texture import roughness
from smokelift.render import render, scene_optics
from smokelift.scene import Background, Medium, completed


@pytest.mark.parametrize("axes", [1, 2, 3])
def test_noise_has_unit_variance_between_nodes(axes) -> None:
    """Over all of a lattice, whatever its axes; the mean is that of the nodes, and neither has a seam."""
    random = np.random.default_rng(5)
    places = random.uniform(-NODES, 2 * NODES, (axes, 20000))
    found = [lattice.read(places) for lattice in lattices(1, 24, axes)]
    assert np.mean([values.var() for values in found]) == pytest.approx(1, rel=0.1)
    np.testing.assert_allclose(lattices(1, 1, axes)[0].read(places + NODES), found[0], atol=1e-6)


def test_a_node_adds_what_a_blur_does_without_a_crease() -> None:
    places = np.linspace(-NODES / 2, NODES / 2, 6401)[None]
    (lattice,) = lattices(0, 1, 1)
    one = lattice._replace(values=np.eye(1, NODES, dtype=np.float32)[0], corner=np.zeros(1))
    added = one.read(places)
    assert np.sqrt(np.average(places[0] ** 2, weights=added)) == pytest.approx(NODE_BLUR, rel=1e-3)
    slopes = np.gradient(added, places[0])
    assert np.abs(np.diff(slopes)).max() < 0.05 * np.abs(slopes).max()


def test_compiled_code_reads_what_python_does() -> None:
    random = np.random.default_rng(0)
    lattice = lattices(3, 1, 3)[0]
    small = lattice._replace(values=np.ascontiguousarray(lattice.values[:5, :6, :7]))
    marked = random.random((12, 13, 14)) > 0.5
    index = np.array(np.nonzero(marked))
    motion = random.uniform(-40, 40, index.shape).astype(np.float32)
    motion[:, :200] = np.round(motion[:, :200])
    shift = np.array((-3.0, 4.5, 50.0))
    expected = small.read(0.5 * index + shift[:, None] + 0.25 * motion)
    where = _core.MarkedVoxels(marked)
    found = where.read_lattice(small.values, 0.5, (shift + small.corner).tolist(), motion, 0.25)
    np.testing.assert_allclose(found, expected, atol=2e-4)


WIDTH = 8.0
NONE = (0.0, 0.0, 0.0)


def level(shape) -> SimpleNamespace:
    """A grid that may hold smoke everywhere."""
    where = _core.MarkedVoxels(np.ones(shape, np.bool_))
    return SimpleNamespace(views=SimpleNamespace(where=where), coarseness=1, coarser=None)


def body(shape) -> np.ndarray:
    """Smooth smoke along the last axis, of a Gaussian profile as wide as `WIDTH`."""
    x, y = ((np.arange(count) - (count - 1) / 2) / WIDTH for count in shape[:2])
    return np.exp(-(x[:, None, None] ** 2 + y[:, None] ** 2) / 2) * np.ones(shape)


def picture(strengths, seed) -> np.ndarray:
    """Optical depth of that smoke with noise."""
    shape = (48, 48, 64)
    noise = stretched_noise(level(shape), np.zeros(3), WIDTH, strengths, seed).reshape(shape)
    return (body(shape) * np.exp(noise)).sum(1).astype(np.float32)


@pytest.mark.parametrize("strength", [0.5, 1.0])
def test_roughness_is_the_strength_of_noise(strength) -> None:
    found = roughness([picture((strength,) * 3, seed) for seed in range(6)], WIDTH)
    assert found == pytest.approx((strength,) * 3, rel=0.3)


@pytest.mark.parametrize("octave", [1, 2])
def test_roughness_is_found_on_its_scale(octave) -> None:
    with_it, without = (
        roughness([picture(tuple(0.8 * (each == number) for each in range(3)), 0)], WIDTH) for number in (octave, -1)
    )
    gains = np.array(with_it) / np.array(without)
    assert gains[octave] > 1.8
    assert gains[0] < 1.3


def test_laminar_smoke_is_smooth() -> None:
    coarse, middle, fine = roughness([picture(NONE, 0)], WIDTH)
    assert fine < 0.1
    assert middle < 0.25
    assert coarse < 0.6


def test_noise_has_its_strengths() -> None:
    noise = stretched_noise(level((64, 64, 64)), np.zeros(3), 4.0, (0.3, 0.4), 0)
    assert noise.std() == pytest.approx(0.5, rel=0.1)
    assert noise.mean() == pytest.approx(0, abs=0.05)
    assert not stretched_noise(level((8, 8, 8)), np.zeros(3), WIDTH, NONE, 0).any()


def test_noise_moves_with_the_smoke() -> None:
    shape = (12, 12, 24)
    before, after = (
        stretched_noise(level(shape), np.array([0.0, 0.0, by]), WIDTH, (0.5, 0.5, 0.5), 3).reshape(shape)
        for by in (0.0, 4.0)
    )
    np.testing.assert_allclose(after[..., 4:], before[..., :-4], atol=1e-4)


def test_fine_octaves_are_drawn_out() -> None:
    """They vary more along one direction than along another, voxel by voxel, than one octave alone as fine as they."""
    shape = (48, 48, 48)

    def drawn_out(width: float, strengths: tuple[float, ...]) -> float:
        noise = stretched_noise(level(shape), np.zeros(3), width, strengths, 0)
        slopes = np.stack(np.gradient(noise.reshape(shape)))
        tensor = np.einsum("i...,j...->...ij", slopes, slopes).reshape(6, 8, 6, 8, 6, 8, 3, 3).mean((1, 3, 5))
        least, _, most = np.moveaxis(np.linalg.eigvalsh(tensor), -1, 0)
        return float(np.median(most / least))

    assert drawn_out(WIDTH, (0.0, 0.0, 1.0)) > 1.5 * drawn_out(WIDTH / 4, (1.0,))


WANDER = Wander(np.array([0.0, 0.0, 2.5]), 5.0, (0.8, 0.6, 0.4), 1)
PLANE = np.stack(np.meshgrid(np.arange(160.0), np.arange(80.0), indexing="ij"))

SCENE = Scene(
    camera=Camera.look_at((0, -8, 0.75), (0, 0, 0.75), fov_y_degrees=14, size=(32, 48)),
    domain=Domain((-0.5, -0.5, 0), (0.5, 0.5, 1.5), (32, 32, 48)),
    medium=Medium(extinction=2),
    background=Background(color=(1.0, 1.0, 1.0)),
    scattering="absorption",
)


def column() -> np.ndarray:
    """A straight column (nx, ny, nz)."""
    x, y, _ = SCENE.domain.offsets(SCENE.domain.centre)
    return np.broadcast_to(np.exp(-(((x**2 + y**2) / 0.03) ** 2)), SCENE.domain.resolution).astype(np.float32)


def spread_by(prior: RoundDepth, cameras: tuple[Camera, ...] = (SCENE.camera,), frame: int = 0) -> np.ndarray:
    """The density that a prior finds for the column's pictures."""
    pictures = [render(column(), replace(SCENE, camera=camera)) for camera in cameras]
    plate = eight_bit_plate(np.ones(3, np.float32), SCENE.camera.size)
    seen = [Observation(camera, picture, plate) for camera, picture in zip(cameras, pictures, strict=True)]
    return prior.estimate(ViewSet.of(seen, scene_optics(completed(SCENE)), frame)).density


def middles(density: np.ndarray) -> np.ndarray:
    """Mean depth (voxels) of the rays (lateral, height) through the column."""
    part = density[13:19, :, 8:40].astype(np.float64)
    return np.asarray(np.einsum("xyz,y->xz", part, np.arange(density.shape[1])) / part.sum(1))


def depth(density: np.ndarray) -> float:
    """Standard deviation (voxels) of the column's smoke in depth."""
    row = density[13:19, :, 8:40].sum((0, 2), dtype=np.float64)
    places = np.arange(len(row))
    middle = places @ row / row.sum()
    return float(np.sqrt((places - middle) ** 2 @ row / row.sum()))


def test_middles_scatter_as_much_as_the_pictures_are_rough() -> None:
    scatter = np.stack([replace(WANDER, seed=seed).offset(PLANE) for seed in range(8)])
    assert WANDER.deviation == pytest.approx(DEVIATION * np.hypot(0.8, 0.6))
    assert scatter.std((1, 2)).mean() == pytest.approx(WANDER.deviation, rel=0.15)
    assert np.abs(np.diff(scatter, axis=0)).max((1, 2)).min() > 0.5, "another seed wanders otherwise"


def test_scatter_travels_with_the_smoke() -> None:
    frame = 6
    height = 0.75 + frame * WANDER.velocity[2] * SCENE.domain.voxel_size
    risen = Camera.look_at((0, -8, height), (0, 0, height), fov_y_degrees=14, size=SCENE.camera.size)
    now, later = (
        WANDER.scatter(camera, SCENE.domain, number).offset for camera, number in ((SCENE.camera, 0), (risen, frame))
    )
    np.testing.assert_allclose(later, now, atol=1e-4)


def test_laminar_smoke_stands_straight() -> None:
    straight = replace(WANDER, roughness=(0.0, 0.0))
    np.testing.assert_array_equal(spread_by(RoundDepth(wander=straight)), spread_by(RoundDepth()))


def test_wandering_smoke_is_as_deep_as_smoke_that_stands_on_the_axis() -> None:
    round_smoke = spread_by(RoundDepth())
    found = [spread_by(RoundDepth(wander=replace(WANDER, seed=seed))) for seed in range(16)]
    assert middles(round_smoke).std() < 0.2
    assert np.mean([middles(each).std() for each in found]) > 0.6 * WANDER.deviation * depth(round_smoke)
    assert np.mean([depth(each) for each in found]) == pytest.approx(depth(round_smoke), rel=0.1)


def test_smoke_that_two_cameras_see_stands_where_they_show_it() -> None:
    both = (SCENE.camera, Camera.look_at((8, 0, 0.75), (0, 0, 0.75), fov_y_degrees=14, size=(32, 48)))
    np.testing.assert_array_equal(spread_by(RoundDepth(wander=WANDER), both), spread_by(RoundDepth(), both))
