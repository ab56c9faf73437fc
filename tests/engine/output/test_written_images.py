"""Pictures as they are written."""

from __future__ import annotations

import errno
import os
from pathlib import Path
from typing import Any, NoReturn

import numpy as np
import OpenEXR
import pytest

from smokelift.output.images import eight_bit, write_image


def test_eight_bit_is_srgb() -> None:
    """Linear light is encoded, rounded and cut at both ends."""
    image = np.array([[[0, 0.2159, 1], [-1, 7, 0.0031308]]], np.float32)
    np.testing.assert_array_equal(eight_bit(image), [[[0, 128, 255], [0, 255, 10]]])
    assert eight_bit(image).dtype == np.uint8


@pytest.mark.parametrize("number", [errno.ENOSPC, errno.EIO])
def test_a_picture_that_does_not_fit_is_an_error_of_the_system(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, number: int
) -> None:
    """OpenEXR says it in words; the file that was there stays."""

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
