"""How strongly a video is compressed, as its blocks say."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from films import coded, film, puff, wall

from smokelift.footage.quantiser import median_quantiser


@pytest.mark.parametrize("quantiser", [10, 30, 48])
def test_the_quantiser_is_that_of_the_encoder(tmp_path: Path, quantiser: int) -> None:
    """First frames get three less of it, frames between two others two more."""
    path = coded(tmp_path / "clip.mp4", wall(0.2, 0.5), puff, 0.6, quantiser)
    assert median_quantiser(path) == pytest.approx(quantiser, abs=3)


def test_it_is_that_of_each_block(tmp_path: Path) -> None:
    """Adaptive quantisers differ from their frame's."""
    busy = wall(0.0, 1.0)
    busy[:, :28] = 0.3
    flat, adaptive = (
        median_quantiser(coded(tmp_path / f"{strength}.mp4", busy, puff, 0.6, crf=30, **{"aq-strength": strength}))
        for strength in (0, 3)
    )
    assert flat is not None and adaptive is not None and abs(flat - adaptive) > 1


@pytest.mark.parametrize(("name", "codec"), [("a.mp4", "mpeg4"), ("a.mkv", "ffv1"), ("a.webm", "libvpx-vp9")])
def test_other_codecs_tell_nothing(tmp_path: Path, name: str, codec: str) -> None:
    assert median_quantiser(coded(tmp_path / name, wall(0.2, 0.5), puff, 0.6, codec=codec)) is None


def test_pictures_and_files_that_are_no_video_tell_nothing(tmp_path: Path) -> None:
    clip = film(tmp_path, wall(0.2, 0.5), puff, 0.6)
    text = tmp_path / "a.mp4"
    text.write_text("no video")
    for path in (clip.path, *clip.files[:1], text, tmp_path, tmp_path / "absent.mp4"):
        assert median_quantiser(path) is None


def test_a_damaged_file_does_not_fail(tmp_path: Path) -> None:
    whole = coded(tmp_path / "clip.mp4", wall(0.2, 0.5), puff, 0.6, 45).read_bytes()
    for seed in range(8):
        random = np.random.default_rng(seed)
        damaged = np.frombuffer(whole, np.uint8).copy()
        damaged[random.integers(48, len(damaged), 40)] = random.integers(0, 256, 40)
        path = tmp_path / f"{seed}.mp4"
        path.write_bytes(damaged.tobytes())
        quantiser = median_quantiser(path)
        assert quantiser is None or np.isfinite(quantiser)
