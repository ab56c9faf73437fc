"""What formats of clips share: what alpha says is behind the smoke, the focal length, frames as they are stored."""

from pathlib import Path

import av
import numpy as np
import pytest
from PIL import Image

from smokelift.footage.backdrop import find_backdrop
from smokelift.footage.clip import Clip
from smokelift.footage.frame_source import Layer, StoredPicture, backdrop_of, shown_before
from smokelift.footage.images import area_average, code_values, linear_to_srgb, srgb_to_linear
from smokelift.scene import Background

QUICKTIME = "com.apple.quicktime.camera.focal_length.35mm_equivalent"


def film(path: Path, **tags: str) -> Path:
    with av.open(str(path), "w", options={"movflags": "use_metadata_tags"}) as out:
        out.metadata.update(tags)
        stream = out.add_stream("libx264", rate=24)
        stream.width, stream.height, stream.pix_fmt = 32, 16, "yuv420p"
        out.mux(stream.encode(av.VideoFrame.from_ndarray(np.zeros((16, 32, 3), np.uint8))))
        out.mux(stream.encode())
    return path


@pytest.mark.parametrize(("said", "lens"), [("26", 26.0), ("13.5", 13.5), ("0", None), ("nan", None), ("wide", None)])
def test_quicktime_tags(tmp_path: Path, said: str, lens: float | None) -> None:
    assert Clip.open(film(tmp_path / "a.mov", **{QUICKTIME: said})).lens == lens


@pytest.mark.parametrize("said", [28, 0, None])
def test_exif(tmp_path: Path, said: int | None) -> None:
    tags = Image.Exif()
    if said is not None:
        tags.get_ifd(0x8769)[0xA405] = said
    Image.new("RGB", (32, 16)).save(tmp_path / "a0.jpg", exif=tags)
    assert Clip.open(tmp_path / "a#.jpg").lens == (said or None)


def layer(gray: float, alpha: float | None) -> Layer:
    """Smoke of a linear gray over the left half."""
    picture, opacity = np.zeros((4, 6, 3), np.float32), np.zeros((4, 6), np.float32)
    picture[:, :3], opacity[:, :3] = gray * (1.0 if alpha is None else alpha), alpha or 0.0
    return picture, None if alpha is None else opacity


@pytest.mark.parametrize(("gray", "backdrop"), [(0.05, 1.0), (0.9, 0.0)])
def test_dark_smoke_stands_before_white_and_bright_smoke_before_black(gray: float, backdrop: float) -> None:
    clip = [layer(gray, 0.0), layer(gray, 0.5)]
    assert backdrop_of(clip) == backdrop
    shown = shown_before(clip[1], backdrop)
    np.testing.assert_allclose(shown[0, [0, 5]], [[0.5 * gray + 0.5 * backdrop] * 3, [backdrop] * 3], rtol=1e-6)


def test_the_backdrop_is_the_background_and_nothing_is_estimated(tmp_path: Path) -> None:
    for n in range(4):
        codes = np.full((24, 32, 4), 40, np.uint8)
        codes[..., 3] = 0
        codes[20 - 4 * n :, 10:20, 3] = 128
        Image.fromarray(codes).save(tmp_path / f"a{n}.png")
    with Clip.open(tmp_path / "a#.png", fps=24) as clip:
        half = 128 / 255
        np.testing.assert_allclose(clip.frame(3)[20, 15], srgb_to_linear(40 / 255) * half + 1 - half, rtol=1e-5)
        for given in (None, Background(color=(0.0, 0.0, 0.0))):
            found = find_backdrop(clip, None, given)
            assert found.background == Background(color=(1.0, 1.0, 1.0))
            assert (found.plates.at(2).image == 1).all()
            assert found.source == "alpha"


@pytest.mark.parametrize("size", [(7, 5), (31, 40), (64, 48), (80, 40)])
def test_averages_of_codes_are_those_of_the_linear_picture_to_the_last_bit(size: tuple[int, int]) -> None:
    random = np.random.default_rng(0)
    for dtype in (np.uint8, np.uint16):
        top = np.iinfo(dtype).max
        picture = StoredPicture(random.integers(0, top, (48, 64, 3), dtype, endpoint=True), code_values(top))
        for part in (np.s_[:], np.s_[3:41, 5:60]):
            some = picture.cut(lambda pixels, part=part: pixels[part])
            assert np.array_equal(some.averaged(*size), area_average(picture.linear()[part], *size))
    with pytest.raises(ValueError, match="at least one pixel"):
        picture.averaged(4, 0)


@pytest.mark.parametrize("size", [(7, 5), (31, 40), (64, 48), (80, 60)])
@pytest.mark.parametrize("first", [0, 1])
def test_averages_of_a_chequerboard_are_those_of_its_pixels_to_the_last_bit(size: tuple[int, int], first: int) -> None:
    random = np.random.default_rng(0)
    rows, columns = np.indices((48, 64))
    for dtype in (np.uint8, np.uint16):
        top = np.iinfo(dtype).max
        picture = StoredPicture(random.integers(0, top, (48, 64, 3), dtype, endpoint=True), code_values(top))
        linear = picture.linear()
        for color in (0, 1):
            share = ((rows + columns) % 2 == (first + color) % 2).astype(np.float32)
            weight = np.maximum(area_average(share, *size), np.float32(1e-6))
            expected = area_average(linear * share[..., None], *size) / weight[..., None]
            for image in (picture, StoredPicture(linear)):
                assert np.array_equal(image.chequered(*size, first)[color], expected)


@pytest.mark.parametrize("dtype", [np.uint8, np.uint16])
def test_codes_are_added_as_the_linear_picture_to_the_last_bit(dtype: type) -> None:
    random, top = np.random.default_rng(0), np.iinfo(dtype).max
    picture = StoredPicture(random.integers(0, top, (20, 36, 3), dtype, endpoint=True), code_values(top))
    edges = np.array([0, 3, 3, 20], np.int32), np.array([0, 1, 18, 30, 36], np.int32)
    weights, sums = random.random((3, 4, 3), np.float32), random.random((20, 36, 3), np.float32)
    lines, columns = (np.diff(each) for each in edges)
    expected = sums + picture.linear() * np.repeat(np.repeat(weights, lines, axis=0), columns, axis=1)
    others = sums.copy()
    picture.add_weighted(weights, edges, sums)
    StoredPicture(picture.linear()).add_weighted(weights, edges, others)
    assert np.array_equal(sums, expected)
    assert np.array_equal(others, expected)


def test_both_kinds_are_read_alike() -> None:
    coded = StoredPicture(np.random.default_rng(0).integers(0, 256, (6, 8, 3), np.uint8), code_values(255))
    linear = StoredPicture(coded.linear())
    assert coded.size == linear.size == (8, 6)
    for picture in (coded, linear):
        assert np.array_equal(picture.through(linear_to_srgb), linear_to_srgb(coded.linear()))
