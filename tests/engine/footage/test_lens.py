"""The focal length that a file gives."""

from pathlib import Path

import av
import numpy as np
import pytest
from PIL import Image

from smokelift.footage.clip import Clip

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
