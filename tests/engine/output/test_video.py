"""Videos that play, with the right colours, sizes and rates."""

from __future__ import annotations

import numpy as np
import pytest

from smokelift.footage.clip import Clip
from smokelift.output.video_file import write_video


@pytest.mark.parametrize("name", ["video.mp4", "video.mkv", "video.mov", "video.webm"])
def test_a_video_reads_back(tmp_path, name) -> None:
    """Frames, rate and grey levels survive in every kind of file that is offered; odd sides lose a pixel."""
    levels = [0.1, 0.3, 0.6]
    frames = (np.full((33, 47, 3), level, np.float32) for level in levels)
    write_video(tmp_path / name, frames, 12.0)
    with Clip.open(tmp_path / name) as clip:
        assert clip.fps == pytest.approx(12)
        assert clip.size == (46, 32)
        found = [float(frame.mean()) for frame in clip]
    assert found == pytest.approx(levels, abs=0.02)
    assert [file.name for file in tmp_path.iterdir()] == [name]


def test_a_video_of_fractional_rate(tmp_path) -> None:
    """24000 / 1001 stays what it is."""
    write_video(tmp_path / "a.mp4", [np.zeros((16, 16, 3), np.float32)] * 4, 24000 / 1001)
    with Clip.open(tmp_path / "a.mp4") as clip:
        assert clip.fps == pytest.approx(24000 / 1001, rel=1e-6)


def test_a_video_that_breaks_off_leaves_nothing(tmp_path) -> None:
    """Files appear whole or not at all."""

    def frames():
        yield np.zeros((16, 16, 3), np.float32)
        raise RuntimeError

    with pytest.raises(RuntimeError):
        write_video(tmp_path / "a.mp4", frames(), 24.0)
    assert list(tmp_path.iterdir()) == []
