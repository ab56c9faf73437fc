"""The texture of a clip: its axis, its scales, its drift."""

from dataclasses import dataclass

import numpy as np
import pytest
from scipy import ndimage

from smokelift.density import Observation
from smokelift.density.clip_texture import ClipTexture
from smokelift.density.observation import eight_bit_plate
from smokelift.render import Optics
from smokelift.scene import Camera, Domain, Medium

DOMAIN = Domain((-0.8, -0.6, 0), (0.8, 0.6, 1.6), (32, 24, 32))
CAMERA = Camera.look_at((0, -6, 0.8), (0, 0, 0.8), fov_y_degrees=16, size=(36, 36))
WHITE = np.ones(3, np.float32)


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
    """A blob with detail that moves by some rows and columns a frame."""
    random = np.random.default_rng(0)
    noise = ndimage.gaussian_filter(random.normal(size=(36, 36)), 1.5)
    rows, columns = np.meshgrid(np.arange(36) - 17.5, np.arange(36) - 17.5, indexing="ij")
    blob = np.exp(-((np.hypot(rows / 9, columns / width)) ** 4)) * np.clip(1 + 0.5 * noise / noise.std(), 0, None)
    pictures = [np.roll(blob, (n * step[0], n * step[1]), (0, 1)) for n in range(frames)]
    return Shadows(tuple(picture.astype(np.float32) for picture in pictures))


@pytest.mark.parametrize(("step", "axis"), [((-1, 0), 2), ((0, 1), 0), ((0, 0), 2)])
def test_smoke_turns_about_the_axis_that_it_travels_along(step, axis) -> None:
    texture = ClipTexture.of(moving(step))
    assert texture is not None
    assert texture.turntable.axis == axis
    assert texture.drift == pytest.approx(abs(step[0]) + abs(step[1]), abs=0.25)


def test_wider_smoke_has_more_scales() -> None:
    narrow, wide = (ClipTexture.of(moving((-1, 0), width=width)) for width in (3.0, 12.0))
    assert narrow is not None
    assert wide is not None
    assert [each.scale for each in narrow.exemplars] == [2, 1]
    assert [each.scale for each in wide.exemplars] == [8, 4, 2, 1]
    assert wide.width > 2 * narrow.width


def test_a_clip_without_smoke_has_no_texture() -> None:
    assert ClipTexture.of(Shadows((np.zeros((36, 36), np.float32),))) is None
