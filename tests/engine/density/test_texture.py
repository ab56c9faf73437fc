"""The texture of a clip: its axis, scales and drift; patches, their kernels, and pictures that take them over."""

from dataclasses import dataclass

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy import ndimage

from smokelift import Camera, Domain, Medium, _core
from smokelift.density import Observation
from smokelift.density.observation import eight_bit_plate
from smokelift.density.texture import SIZE, ClipTexture, Exemplar, enlarged, fine_energy
from smokelift.render import Optics
from smokelift.transport import block_means

DOMAIN = Domain((-0.8, -0.6, 0), (0.8, 0.6, 1.6), (32, 24, 32))
CAMERA = Camera.look_at((0, -6, 0.8), (0, 0, 0.8), fov_y_degrees=16, size=(36, 36))
WHITE = np.ones(3, np.float32)


def smoke(seed: int, fineness: float, shape: tuple[int, int] = (48, 64)) -> np.ndarray:
    """Optical depth of a blob with detail of a size in pixels."""
    random = np.random.default_rng(seed)
    noise = ndimage.gaussian_filter(random.normal(size=shape), fineness)
    x, z = (
        np.arange(n)[:, None].T + 0.5 - n / 2 if k else np.arange(n)[:, None] + 0.5 - n / 2 for k, n in enumerate(shape)
    )
    blob = np.exp(-((np.hypot(x / 14, z / 22)) ** 4))
    return np.asarray(blob * np.clip(1 + noise / noise.std(), 0, None), np.float32)


def fine(picture: np.ndarray) -> float:
    """How strong its detail is."""
    return float(np.linalg.norm(picture - ndimage.gaussian_filter(picture, 1.5)) / np.linalg.norm(picture))


def test_unfolding_and_folding_are_plain_slices_and_means() -> None:
    random = np.random.default_rng(0)
    picture = random.random((12, 15), np.float32)
    at = np.array([[1, 1, 6, 10], [1, 2, 9, 13]], np.int32)
    pixels = _core.unfold(picture, at, 3)
    expected = [picture[r - 1 : r + 2, c - 1 : c + 2].ravel() for r, c in at.T]
    np.testing.assert_array_equal(pixels.T, expected)
    values = random.random(pixels.shape, np.float32)
    total, count = np.zeros((12, 15)), np.zeros((12, 15))
    for n, (r, c) in enumerate(at.T):
        total[r - 1 : r + 2, c - 1 : c + 2] += values[:, n].reshape(3, 3)
        count[r - 1 : r + 2, c - 1 : c + 2] += 1
    np.testing.assert_allclose(_core.fold(values, at, 3, (12, 15)), total / np.maximum(count, 1), rtol=1e-6)


@given(st.integers(1, 300), st.integers(1, 40), st.integers(0, 2**32 - 1))
def test_moved_values_have_the_wanted_distribution(count, known, seed) -> None:
    """Sorted, they are the wanted quantiles, whose order is kept; equal values keep the order of their places."""
    random = np.random.default_rng(seed)
    values = np.round(random.normal(size=(2, count)), 1).astype(np.float32) + np.float32(0)
    wanted = np.sort(random.normal(size=(2, known))).astype(np.float32)
    moves = values.copy()
    _core.to_quantiles(moves, wanted)
    for before, move, quantiles in zip(values, moves, wanted, strict=True):
        at = np.clip((np.arange(count) + 0.5) / count * known - 0.5, 0, known - 1)
        expected = np.interp(at, np.arange(known), quantiles)
        order = np.argsort(before, kind="stable")
        np.testing.assert_allclose((before + move)[order], expected, atol=1e-5)


def test_reducing_keeps_means_and_enlarging_keeps_lines() -> None:
    picture = np.random.default_rng(2).random((13, 10), np.float32)
    assert block_means(picture, 4).sum() * 16 == pytest.approx(picture.sum(), rel=1e-5)
    line = np.broadcast_to(np.arange(16, dtype=np.float32)[:, None], (16, 8)).copy()
    np.testing.assert_allclose(enlarged(block_means(line, 4), 4, line.shape)[2:14], line[2:14], atol=1e-5)


@pytest.mark.parametrize("scale", [1, 2])
def test_a_smooth_picture_takes_over_the_detail_of_an_exemplar(scale) -> None:
    exemplar = Exemplar.of([smoke(seed, 1.5 * scale) for seed in range(4)], scale)
    smooth = block_means(smoke(9, 12.0), scale)
    like = block_means(smoke(8, 1.5 * scale), scale)
    found = smooth
    for turn in range(4):
        found = exemplar.towards(found, turn)
    assert fine(found) > 0.6 * fine(like)
    assert fine(smooth) < 0.4 * fine(like)
    kept = exemplar.towards(like, 0)
    assert np.linalg.norm(kept - like) < 0.5 * np.linalg.norm(like - ndimage.gaussian_filter(like, SIZE / 2))


def test_detail_that_stands_counts_and_level_layers_do_not() -> None:
    """The same from all sides: smoke with layers alone has none across, that with threads has all of it."""
    body, ripples = np.ones((48, 64), np.float32), 0.2 * np.cos(np.pi * np.arange(64) / 2).astype(np.float32)
    standing, level = body + ripples[:48, None], body + ripples
    energies = [fine_energy([picture]) for picture in (standing, body + (standing - body) / 2, level, body)]
    assert energies[1] == pytest.approx(energies[0] / 4, rel=0.01)
    assert max(energies[2:]) < 0.05 * energies[0]
    assert fine_energy([np.zeros((8, 8), np.float32)]) == 0


@pytest.mark.parametrize("line", [np.s_[0, 3:9], np.s_[-1, :], np.s_[:, 0], np.s_[7, 7]])
def test_smoke_along_an_edge_has_patches(line) -> None:
    """Shifted pictures of it are empty."""
    picture = np.zeros((32, 24), np.float32)
    picture[line] = 0.5
    for scale in (1, 2, 4):
        found = Exemplar.of([picture], scale)
        assert np.isfinite(found.quantiles).all()
        assert np.isfinite(found.towards(block_means(picture, scale), 0)).all()


@dataclass(frozen=True)
class Shadows:
    """A clip of dark smoke before white: its optical depths (rows, columns), and no more of `ObservedClip`."""

    pictures: tuple[np.ndarray, ...]

    @property
    def optics(self) -> Optics:
        """Of smoke that only absorbs."""
        return Optics(DOMAIN, Medium(extinction=1.0), (), "absorption")

    @property
    def length(self) -> int:
        """Number of frames."""
        return len(self.pictures)

    def spread(self, count: int) -> tuple[int, ...]:
        """All of them."""
        return tuple(range(self.length))

    def observe(self, frame: int) -> tuple[Observation, ...]:
        """The picture of a frame."""
        clear = np.exp(-self.pictures[frame]).astype(np.float32)[..., None] * WHITE
        return (Observation(CAMERA, clear, eight_bit_plate(WHITE, CAMERA.size)),)


def moving(step: tuple[int, int], frames: int = 4, width: float = 6.0) -> Shadows:
    """A blob with detail that moves by some rows and columns per frame."""
    random = np.random.default_rng(0)
    noise = ndimage.gaussian_filter(random.normal(size=(36, 36)), 1.5)
    rows, columns = np.meshgrid(np.arange(36) - 17.5, np.arange(36) - 17.5, indexing="ij")
    blob = np.exp(-((np.hypot(rows / 9, columns / width)) ** 4)) * np.clip(1 + 0.5 * noise / noise.std(), 0, None)
    pictures = [np.roll(blob, (n * step[0], n * step[1]), (0, 1)) for n in range(frames)]
    return Shadows(tuple(picture.astype(np.float32) for picture in pictures))


@pytest.mark.parametrize(("step", "axis"), [((-1, 0), 2), ((0, 1), 0), ((0, 0), 2)])
def test_smoke_turns_about_the_axis_that_it_travels_along(step, axis) -> None:
    texture = ClipTexture.of(moving(step))
    assert texture.turntable.axis == axis
    assert texture.drift == pytest.approx(abs(step[0]) + abs(step[1]), abs=0.25)


def test_wider_smoke_has_more_scales_and_none_has_no_texture() -> None:
    narrow, wide = (ClipTexture.of(moving((-1, 0), width=width)) for width in (3.0, 12.0))
    assert [each.scale for each in narrow.exemplars] == [2, 1]
    assert [each.scale for each in wide.exemplars] == [8, 4, 2, 1]
    assert wide.width > 2 * narrow.width
    assert ClipTexture.of(Shadows((np.zeros((36, 36), np.float32),))) is None
