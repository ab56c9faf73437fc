"""How strongly a video is compressed, as its blocks say."""

from pathlib import Path

import pytest
from films import coded, film, puff, wall

from smokelift.footage.quantiser import median_quantiser


@pytest.mark.parametrize("quantiser", [10, 30, 48])
def test_the_quantiser_is_that_of_the_encoder(tmp_path: Path, quantiser: int) -> None:
    path = coded(tmp_path / "clip.mp4", wall(0.2, 0.5), puff, 0.6, quantiser)
    assert median_quantiser(path) == pytest.approx(quantiser, abs=3)


@pytest.mark.parametrize(("name", "codec"), [("a.mp4", "mpeg4"), ("a.mkv", "ffv1"), ("a.webm", "libvpx-vp9")])
def test_other_codecs_tell_nothing(tmp_path: Path, name: str, codec: str) -> None:
    assert median_quantiser(coded(tmp_path / name, wall(0.2, 0.5), puff, 0.6, codec=codec)) is None


def test_pictures_and_files_that_are_no_video_tell_nothing(tmp_path: Path) -> None:
    clip = film(tmp_path, wall(0.2, 0.5), puff, 0.6)
    text = tmp_path / "a.mp4"
    text.write_text("no video")
    for path in (clip.path, *clip.files[:1], text, tmp_path, tmp_path / "absent.mp4"):
        assert median_quantiser(path) is None
