"""What formats of clips share: what alpha says is behind the smoke, the focal length, frames as they are stored."""

import numpy as np
import pytest
from PIL import Image

from smokelift import Background, Clip
from smokelift.extraction.find_background import find_background
from smokelift.footage.frame_source import FrameSource, Layer, StoredPicture, alpha_background_of
from smokelift.footage.image_files import code_values
from smokelift.footage.images import area_average, linear_to_srgb, srgb_to_linear
from tests.engine.films import encode

QUICKTIME = "com.apple.quicktime.camera.focal_length.35mm_equivalent"


@pytest.mark.parametrize(("said", "lens"), [("26", 26.0), ("13.5", 13.5), ("0", None), ("nan", None), ("wide", None)])
def test_quicktime_tags(tmp_path, said, lens) -> None:
    how = {"muxer": {"movflags": "use_metadata_tags"}, "metadata": {QUICKTIME: said}}
    path = encode(tmp_path / "a.mov", np.zeros((1, 16, 32, 3), np.uint8), **how)
    assert Clip.open(path).lens == lens


@pytest.mark.parametrize("said", [28, 0, None])
def test_exif(tmp_path, said) -> None:
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


@pytest.mark.parametrize(("gray", "background"), [(0.05, 1.0), (0.9, 0.0)])
def test_dark_smoke_stands_before_white_and_bright_smoke_before_black(gray, background) -> None:
    clip = [layer(gray, 0.0), layer(gray, 0.5)]
    source = FrameSource()
    source.alpha_background = alpha_background_of(clip)
    assert source.alpha_background == background
    shown = source.shown(clip[1]).values
    np.testing.assert_allclose(shown[0, [0, 5]], [[0.5 * gray + 0.5 * background] * 3, [background] * 3], rtol=1e-6)


def test_the_background_of_alpha_is_taken_and_nothing_is_estimated(tmp_path) -> None:
    for n in range(4):
        codes = np.full((24, 32, 4), 40, np.uint8)
        codes[..., 3] = 0
        codes[20 - 4 * n :, 10:20, 3] = 128
        Image.fromarray(codes).save(tmp_path / f"a{n}.png")
    with Clip.open(tmp_path / "a#.png", fps=24) as clip:
        half = 128 / 255
        np.testing.assert_allclose(clip.frame(3)[20, 15], srgb_to_linear(40 / 255) * half + 1 - half, rtol=1e-5)
        for given in (None, Background(color=(0.0, 0.0, 0.0)), Background(strokes=tmp_path / "no.png")):
            found = find_background(clip, None, given)
            assert found.background == Background(color=(1.0, 1.0, 1.0))
            assert (found.plate.at(2).image == 1).all()
            assert (found.kind, found.strokes) == ("alpha", None)


# pictures in codes, to the last bit those of the linear picture


@pytest.fixture(params=[np.uint8, np.uint16])
def picture(request) -> StoredPicture:
    top = np.iinfo(request.param).max
    codes = np.random.default_rng(0).integers(0, top, (48, 64, 3), request.param, endpoint=True)
    return StoredPicture(codes, code_values(top))


@pytest.mark.parametrize("size", [(7, 5), (31, 40), (64, 48), (80, 40), (80, 60)])
def test_averages(picture, size) -> None:
    for part in (np.s_[:], np.s_[3:41, 5:60]):
        some = picture.cut(lambda pixels, part=part: pixels[part])
        assert np.array_equal(some.averaged(*size), area_average(picture.linear()[part], *size))
    with pytest.raises(ValueError, match="pixel"):
        picture.averaged(4, 0)


def test_weighted_sums(picture) -> None:
    edges = np.array([0, 3, 3, 48], np.int32), np.array([0, 1, 18, 30, 64], np.int32)
    random = np.random.default_rng(0)
    weights, sums = random.random((3, 4, 3), np.float32), random.random((48, 64, 3), np.float32)
    lines, columns = (np.diff(each) for each in edges)
    expected = sums + picture.linear() * np.repeat(np.repeat(weights, lines, axis=0), columns, axis=1)
    for image in (picture, StoredPicture(picture.linear())):
        found = sums.copy()
        image.add_weighted(weights, edges, found)
        assert np.array_equal(found, expected)


def test_functions_of_values(picture) -> None:
    for image in (picture, StoredPicture(picture.linear())):
        assert image.size == (64, 48)
        assert np.array_equal(image.through(linear_to_srgb), linear_to_srgb(picture.linear()))
