"""What formats of clips share: an alpha channel says what is behind the smoke, and a file its focal length."""

from pathlib import Path

import av
import numpy as np
import pytest
from PIL import Image

from smokelift.footage.backdrop import find_backdrop
from smokelift.footage.clip import Clip
from smokelift.footage.frame_source import Layer, backdrop_of, shown_before
from smokelift.footage.images import srgb_to_linear
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


def layer(grey: float, alpha: float | None) -> Layer:
    """Smoke of a linear grey over the left half."""
    picture, opacity = np.zeros((4, 6, 3), np.float32), np.zeros((4, 6), np.float32)
    picture[:, :3], opacity[:, :3] = grey * (1.0 if alpha is None else alpha), alpha or 0.0
    return picture, None if alpha is None else opacity


@pytest.mark.parametrize(("grey", "backdrop"), [(0.05, 1.0), (0.9, 0.0)])
def test_dark_smoke_stands_before_white_and_bright_smoke_before_black(grey: float, backdrop: float) -> None:
    clip = [layer(grey, 0.0), layer(grey, 0.5)]
    assert backdrop_of(clip) == backdrop
    shown = shown_before(clip[1], backdrop)
    np.testing.assert_allclose(shown[0, [0, 5]], [[0.5 * grey + 0.5 * backdrop] * 3, [backdrop] * 3], rtol=1e-6)


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
