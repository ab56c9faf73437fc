"""How thick the smoke is: measured where a textured background shows through it, undetermined elsewhere."""

import numpy as np
import pytest

from smokelift.footage.noise import lasting_noise
from smokelift.footage.plate import Plate
from smokelift.setup.estimate import UNDETERMINED
from smokelift.setup.first_estimate import SmokeSamples
from smokelift.setup.medium import source_radiance
from smokelift.setup.thickness import seen_texture, smoke_thickness

SIZE = (80, 96)
SOURCE = np.array((0.7, 0.6, 0.5))


def backdrop(texture):
    """A wall of middle grey with so much texture."""
    rng = np.random.default_rng(1)
    return (0.2 + texture * rng.standard_normal((*SIZE, 1)) * np.array((1.0, 0.8, 0.6))).astype("f4")


def transmittance(depth, frame):
    """A blob of an optical depth that rises from frame to frame."""
    y, x = np.mgrid[: SIZE[0], : SIZE[1]]
    return np.exp(-depth * np.exp(-((x - 48) ** 2 + (y - 55 + 4 * frame) ** 2) / 300))[..., None]


def thickness(depth=1.0, texture=0.04, noise=0.003, frames=5, fade=1.0, confidence=1.0):
    """What clips of that blob tell; the background of its pictures is `fade` times as strong as it was."""
    behind, rng, seen = backdrop(texture), np.random.default_rng(2), []
    plate = Plate(behind, np.full(SIZE, confidence, np.float32), lasting_noise(max(noise, 0.004)))
    for frame in range(frames):
        clear = transmittance(depth, frame)
        picture = clear * (0.2 + fade * (behind - 0.2)) + (1 - clear) * SOURCE + noise * rng.standard_normal((*SIZE, 3))
        seen.append(seen_texture(picture.astype("f4"), plate, clear[..., 0] < 0.95))
    return smoke_thickness(seen)


@pytest.mark.parametrize("depth", [0.3, 1.0, 3.0])
def test_texture_tells_thick_smoke_from_thin(depth) -> None:
    source, choice = thickness(depth)
    assert source == pytest.approx(SOURCE, rel=0.15)
    assert choice.spread < 0.15
    assert choice.source == "measured"


@pytest.mark.parametrize(
    "clip",
    [
        {"texture": 0.0},
        {"texture": 0.002},
        {"frames": 2},
        {"frames": 0},
        {"noise": 0.5},
        {"depth": 0.0},
        {"confidence": 0.2},
    ],
    ids=["no texture", "noise for texture", "few frames", "no smoke", "noise", "clear", "unsure background"],
)
def test_what_nothing_tells_is_undetermined(clip) -> None:
    source, choice = thickness(**clip)
    assert source is None
    assert choice.value == UNDETERMINED
    assert choice.source == "assumed"


def test_texture_that_is_lost_without_smoke_tells_nothing() -> None:
    """A codec that smooths the wall looks like smoke; the clear parts of the picture show that it is none."""
    assert thickness(fade=0.7)[0] is None
    assert thickness(fade=0.98)[0] is not None


def test_a_background_that_may_be_smoke_tells_nothing_of_thin_smoke() -> None:
    assert thickness(depth=0.3, confidence=0.95)[0] is None
    assert thickness(depth=3.0, confidence=0.95)[0] is not None


def test_thin_smoke_is_lit_as_strongly_as_it_hides() -> None:
    clear = transmittance(0.3, 0)
    smoky = clear[..., 0] < 0.95
    behind = backdrop(0.0)
    colours, hidden = (clear * behind + (1 - clear) * SOURCE)[smoky], behind[smoky]
    samples = SmokeSamples(1.0, smoky, ~smoky, colours.astype("f4"), hidden, (0,), {})
    assert source_radiance(samples).max() < 0.6 * SOURCE.max()
    assert source_radiance(samples, SOURCE) == pytest.approx(SOURCE)
    assert (source_radiance(samples, 0.1 * SOURCE) >= colours.max(0) * 0.97).all()  # what is there is reached
