"""How files encode light: the curves and matrices of the standards, and colors beside alpha.

Those are straight, premultiplied in linear light or premultiplied in code values; all are read alike.
"""

from pathlib import Path

import numpy as np
import pytest

from smokelift.footage.clip import Clip
from smokelift.footage.image_files import (
    PRIMARIES,
    association,
    hlg_to_linear,
    may_be_straight,
    pq_to_linear,
    read_layer,
    to_bt709,
)
from smokelift.footage.images import linear_to_srgb, srgb_to_linear
from tests.engine.films import encode, write_exr

STRAIGHT, IN_LIGHT, IN_CODES = "straight", "premultiplied in linear light", "premultiplied in code values"
COUNT, HEIGHT, WIDTH = 5, 64, 48
TINT = np.array([1.0, 0.97, 0.93])


def test_hlg_is_light_at_the_camera_and_pq_is_absolute() -> None:
    # BT.2100, table 5: a signal of 1/2 is a twelfth of the peak, 1 is the peak; BT.2408 has white at 75 %
    black, twelfth, white, peak = hlg_to_linear([0.0, 0.5, 0.75, 1.0])
    assert (black, white) == (0.0, 1.0)
    assert peak / twelfth == pytest.approx(12, rel=1e-5)
    # BT.2408, table 1: 100 cd/m2 are at 51 % of the signal, 203 at 58 %, 1000 at 75 %
    found = pq_to_linear([0.0, 0.508, 0.581, 0.752, 1.0]) * 203
    np.testing.assert_allclose(found, [0, 100, 203, 1000, 10_000], rtol=0.005)


@pytest.mark.parametrize("primaries", [1, 2, 5, 6, 7, 9, 12])
def test_white_stays_white(primaries) -> None:
    np.testing.assert_allclose(to_bt709(np.ones((1, 1, 3), np.float32), primaries), 1.0, rtol=1e-5)
    assert (primaries in PRIMARIES) == (primaries not in (1, 2))


def test_wider_colors() -> None:
    # BT.2087, the inverse of its matrix; what BT.709 cannot show is clipped
    found = to_bt709(np.array([[[0.5, 0.4, 0.3], [0.0, 1.0, 0.0]]], np.float32), 9)[0]
    matrix = np.array([[1.6605, -0.5876, -0.0728], [-0.1246, 1.1329, -0.0083], [-0.0182, -0.1006, 1.1187]])
    np.testing.assert_allclose(found[0], matrix @ [0.5, 0.4, 0.3], atol=2e-4)
    np.testing.assert_allclose(found[1], [0, 1.1329, 0], atol=2e-4)


def opacity(n: int, most: float = 0.9) -> np.ndarray:
    """The opacity (rows, columns, 1) of a soft puff that rises."""
    rows, columns = np.mgrid[:HEIGHT, :WIDTH]
    distance = np.hypot(rows - HEIGHT + 14 + 8 * n, columns - WIDTH / 2)
    return (most * np.clip(1.4 - distance / 12, 0, 1) * (1 + 0.1 * np.sin(n + rows / 3)))[..., None].clip(0, 1)


def stored(held: str, n: int, gray: float, shade: float = 0.0, most: float = 0.9) -> np.ndarray:
    """Encoded values (rows, columns, rgba) of smoke of a linear gray whose light varies by a share."""
    alpha, (rows, columns) = opacity(n, most), np.mgrid[:HEIGHT, :WIDTH]
    own = np.clip(gray * (1 + shade * np.sin(columns / 7 + n) * np.cos(rows / 9))[..., None] * TINT, 0, 1)
    colors = {
        STRAIGHT: linear_to_srgb(own) * (alpha > 0),
        IN_LIGHT: linear_to_srgb(own * alpha),
        IN_CODES: linear_to_srgb(own) * alpha,
    }[held]
    return np.concatenate([colors, alpha], -1)


def written(folder: Path, kind: str, pictures: list[np.ndarray]) -> Path:
    """Write a clip: ProRes 4444, numbered PNG, TIFF of 16 or 8 bits, or DPX pictures."""
    codes = [np.rint(picture * 65535).astype(np.uint16) for picture in pictures]
    if kind == "mov":
        return encode(folder / "a.mov", codes, "prores_ks", "yuva444p10le")
    codec, pixels = {"png": ("png", "rgba64be"), "dpx": ("dpx", "rgba"), "tif": ("tiff", "rgba64le")}.get(
        kind, ("tiff", "rgba")
    )
    for n, picture in enumerate(codes):
        encode(folder / f"a{n}.{kind}", [picture], codec, pixels)
    return folder / f"a#.{kind}"


@pytest.mark.parametrize("kind", ["png", "tif", "tiff", "dpx", "mov"])
@pytest.mark.parametrize("held", [STRAIGHT, IN_LIGHT, IN_CODES])
@pytest.mark.parametrize("gray", [0.715, 0.1])
def test_smoke_is_as_bright_however_a_program_held_it(tmp_path, kind, held, gray) -> None:
    path = written(tmp_path, kind, [stored(held, n, gray) for n in range(COUNT)])
    with Clip.open(path, fps=24) as clip:
        assert clip.alpha_background == float(gray < 0.2)
        for n in range(COUNT):
            alpha = opacity(n)
            shown = gray * TINT * alpha + (1 - alpha) * clip.alpha_background
            np.testing.assert_allclose(clip.frame(n), shown, atol=0.012)
        assert [note.figures.get("held") for note in clip.findings()] == ([] if held == STRAIGHT else [held])


@pytest.mark.parametrize("held", [STRAIGHT, IN_LIGHT, IN_CODES])
@pytest.mark.parametrize("gray", [0.1, 0.3, 0.7])
@pytest.mark.parametrize("noise", [0.0, 0.005])
def test_shading_and_grain_do_not_hide_the_convention(held, gray, noise) -> None:
    random = np.random.default_rng(0)
    pictures = [stored(held, n, gray, shade=0.5) for n in range(COUNT)]
    for picture in pictures:
        picture[..., :3] += random.normal(0, noise, picture[..., :3].shape)
    assert association([picture.clip(0, 1) for picture in pictures], srgb_to_linear) == held


def test_opaque_and_empty_pictures_are_straight() -> None:
    picture = np.random.default_rng(0).random((8, 8, 4)).astype(np.float32)
    for alpha in (0.0, 1.0):
        picture[..., 3] = alpha
        assert association([picture], srgb_to_linear) == STRAIGHT
    assert association([], srgb_to_linear) == STRAIGHT


@pytest.mark.parametrize("first", [0, 2])
@pytest.mark.parametrize("channels", ["RGB", "RGBA"])
def test_pictures_that_lack_the_alpha_of_the_others_are_no_solid_smoke(tmp_path, first, channels) -> None:
    """Nor is a clip without alpha that begins so. Where alpha grows to all of a picture, or begins so, it is smoke."""
    for n in range(8):
        picture = stored(IN_LIGHT, n, 0.7)
        if n in (first, first + 1):
            picture = np.full_like(picture, 1.0)[..., : len(channels)]
        write_exr(tmp_path / f"a{n}.exr", {channels if n in (first, first + 1) else "RGBA": picture.astype(np.float32)})
        grown = np.full((HEIGHT, WIDTH, 4), 0.35 * n + 0.2).clip(0, 1)
        write_exr(tmp_path / f"b{n}.exr", {"RGBA": grown.astype(np.float32)})
    with Clip.open(tmp_path / "a#.exr", fps=24) as clip, Clip.open(tmp_path / "b#.exr", fps=24) as solid:
        lacking = first > 0 or channels == "RGB"
        assert clip.damaged == ((first, first + 1) if lacking else ())
        assert (clip.alpha(first).mean() < 0.5) == lacking
        assert solid.damaged == ()


def test_a_stray_alpha_and_a_value_that_is_not_finite_spoil_one_picture(tmp_path) -> None:
    for n in range(8):
        picture = np.full((HEIGHT, WIDTH, 4 if n == 0 else 3), 0.4, np.float32)
        picture[0, 0] = np.nan if n == 5 else 0.3
        write_exr(tmp_path / f"a{n}.exr", {"RGBA" if n == 0 else "RGB": picture})
    with Clip.open(tmp_path / "a#.exr", fps=24) as clip:
        assert clip.alpha_background is None
        assert clip.damaged == (5,)


@pytest.mark.parametrize("gray", [0.1, 0.715])
def test_an_exr_is_premultiplied_in_linear_light_and_doubted_where_it_can_hardly_be(tmp_path, gray) -> None:
    for n in range(COUNT):
        alpha = opacity(n)
        own = gray * TINT * (alpha > 0)
        write_exr(tmp_path / f"a{n}.exr", {"RGBA": np.concatenate([own, alpha], -1).astype(np.float32)})
        write_exr(tmp_path / f"b{n}.exr", {"RGBA": np.concatenate([own * alpha, alpha], -1).astype(np.float32)})
    for name, said in (("a", ["perhaps straight colors"]), ("b", [])):
        with Clip.open(tmp_path / f"{name}#.exr", fps=24) as clip:
            assert [note.kind for note in clip.findings()] == said
            shown = read_layer(tmp_path / f"{name}2.exr")[0] + (1 - opacity(2)) * clip.alpha_background
            np.testing.assert_allclose(clip.frame(2), shown, rtol=1e-5, atol=1e-6)


def test_a_flame_over_thin_alpha_is_premultiplied() -> None:
    """Its light exceeds its alpha, as that of straight colors does, but beside it there is none."""
    alpha, core = opacity(2) ** 2, opacity(0, 1.0) ** 4
    smoke, fire = 0.4 * alpha * TINT, 3 * core * (alpha > 0) * [1, 0.4, 0.1]
    assert not may_be_straight([np.concatenate([smoke + fire, alpha], -1)])
    assert may_be_straight([np.concatenate([0.4 * TINT * (alpha > 0), alpha], -1)])
