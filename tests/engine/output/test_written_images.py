"""Pictures and videos as they are written."""

import errno
import os
from typing import Any, NoReturn

import numpy as np
import OpenEXR
import pytest
from PIL import Image

from smokelift.footage.clip import Clip
from smokelift.output.images import eight_bit, write_image, write_sheet, write_video


def test_eight_bit_is_srgb() -> None:
    image = np.array([[[0, 0.2159, 1], [-1, 7, 0.0031308]]], np.float32)
    np.testing.assert_array_equal(eight_bit(image), [[[0, 128, 255], [0, 255, 10]]])
    assert eight_bit(image).dtype == np.uint8


@pytest.mark.parametrize("number", [errno.ENOSPC, errno.EIO])
def test_a_picture_that_does_not_fit_is_an_error_of_the_system(tmp_path, monkeypatch, number) -> None:
    def full(*_: Any) -> NoReturn:
        raise RuntimeError(f'Failed to write pixel data to image file "x". {os.strerror(number)}.')

    path = tmp_path / "picture.exr"
    path.write_bytes(b"before")
    monkeypatch.setattr(OpenEXR.File, "write", full)
    with pytest.raises(OSError, match=os.strerror(number)) as raised:
        write_image(path, np.zeros((2, 2, 3)))
    assert (raised.value.errno, raised.value.filename) == (number, str(path))
    assert path.read_bytes() == b"before"
    assert [each.name for each in tmp_path.iterdir()] == ["picture.exr"]


@pytest.mark.parametrize("name", ["video.mp4", "video.mkv", "video.mov", "video.webm"])
def test_a_video_reads_back(tmp_path, name) -> None:
    levels = [0.1, 0.3, 0.6]
    frames = (np.full((33, 47, 3), level, np.float32) for level in levels)
    write_video(tmp_path / name, frames, 12.0)
    with Clip.open(tmp_path / name) as clip:
        assert clip.fps == pytest.approx(12)
        assert clip.size == (46, 32)
        found = [float(frame.mean()) for frame in clip]
    assert found == pytest.approx(levels, abs=0.02)
    assert [file.name for file in tmp_path.iterdir()] == [name]


def test_a_video_that_breaks_off_leaves_nothing(tmp_path) -> None:
    def frames():
        yield np.zeros((16, 16, 3), np.float32)
        raise RuntimeError

    with pytest.raises(RuntimeError):
        write_video(tmp_path / "a.mp4", frames(), 24.0)
    assert list(tmp_path.iterdir()) == []


def test_a_sheet_has_its_tiles_side_by_side_below_one_another(tmp_path) -> None:
    colors = [[(50 + row, 90 + column, 200) for column in range(3)] for row in range(2)]
    tiles = [[np.full((6, 10, 3), color, np.uint8) for color in row] for row in colors]
    write_sheet(tmp_path / "sheet.png", tiles, ["a", "b", "c"], ["first", "second"])
    sheet = np.asarray(Image.open(tmp_path / "sheet.png"))
    places = [np.argwhere((sheet == color).all(-1)) for row in colors for color in row]
    assert all(len(place) == 60 for place in places)
    tops, lefts = (np.array([place.min(0)[axis] for place in places]).reshape(2, 3) for axis in (0, 1))
    assert (np.diff(tops, axis=0) > 0).all() and (np.diff(lefts, axis=1) > 0).all()
