"""Opening files with FFmpeg: names that it would take for something else, and nothing over a network;
how strongly a video is compressed, as its blocks say.
"""

import os
import socket
import struct
import zlib
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

from smokelift.footage.clip import Clip
from smokelift.footage.frame_source import ClipError
from smokelift.footage.image_files import ImageError, read_image
from smokelift.footage.video import median_quantizer
from tests.engine.films import coded, encode, film, puff, wall

FRAMES = np.zeros((3, 16, 32, 3), np.uint8)


@pytest.fixture
def server() -> Iterator[socket.socket]:
    """Waits for connections that must not come."""
    with socket.create_server(("127.0.0.1", 0)) as listening:
        listening.setblocking(False)
        yield listening
        with pytest.raises(BlockingIOError):
            listening.accept()


@pytest.mark.parametrize(
    "name", ["http:/127.0.0.1:{}/a.mp4", "pipe:0.mp4", "concat:a|b.mp4", "a%03d.mp4", "-i.mp4", "crypto:x.mp4"]
)
def test_any_name_is_that_of_a_file(tmp_path, server, monkeypatch, name) -> None:
    monkeypatch.chdir(tmp_path)
    path = Path(name.format(server.getsockname()[1]))
    path.parent.mkdir(parents=True, exist_ok=True)
    encode(path, FRAMES)
    with Clip.open(path) as clip:
        assert len(clip) == 3


@pytest.mark.parametrize(
    "text", ["#EXTM3U\n#EXT-X-TARGETDURATION:9\n#EXTINF:9,\n{}\n#EXT-X-ENDLIST\n", "ffconcat version 1.0\nfile {}\n"]
)
def test_nothing_is_fetched_from_what_a_file_refers_to(tmp_path, server, text) -> None:
    path = tmp_path / ("list.m3u8" if text.startswith("#") else "list.ffconcat")
    path.write_text(text.format(f"http://127.0.0.1:{server.getsockname()[1]}/clip.ts"))
    with pytest.raises(ClipError):
        Clip.open(path)


def png(width: int, height: int, depth: int) -> bytes:
    """A PNG whose header lies, with a few pixels."""

    def chunk(kind: bytes, content: bytes) -> bytes:
        return struct.pack(">I", len(content)) + kind + content + struct.pack(">I", zlib.crc32(kind + content))

    header = struct.pack(">IIBBBBB", width, height, depth, 2, 0, 0, 0)
    return (
        b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", header) + chunk(b"IDAT", zlib.compress(bytes(99))) + chunk(b"IEND", b"")
    )


def test_a_16_bit_png_with_a_pattern_for_a_name(tmp_path) -> None:
    (tmp_path / "a%03d.png").write_bytes(png(2, 3, 16))
    assert read_image(tmp_path / "a%03d.png").shape == (3, 2, 3)


@pytest.mark.parametrize("depth", [8, 16])
@pytest.mark.parametrize("size", [(100_000, 100_000), (30_000, 30_000), (2**31 - 1, 1)])
def test_a_picture_that_says_it_is_huge_is_not_believed(tmp_path, depth, size) -> None:
    (tmp_path / "plate.png").write_bytes(png(*size, depth))
    with pytest.raises(ImageError):
        read_image(tmp_path / "plate.png")


@pytest.mark.parametrize("name", ["clip.mp4", "frame_0001.png", "plate.hdr"])
def test_a_pipe_is_not_waited_for(tmp_path, name) -> None:
    os.mkfifo(tmp_path / name)
    with pytest.raises(ValueError, match=name):
        Clip.open(tmp_path / name)


@pytest.mark.parametrize("quantizer", [10, 30, 48])
def test_the_quantizer_is_that_of_the_encoder(tmp_path, quantizer) -> None:
    path = coded(tmp_path / "clip.mp4", wall(0.2, 0.5), 0.6, qp=str(quantizer))
    assert median_quantizer(path) == pytest.approx(quantizer, abs=3)


def test_other_codecs_pictures_and_files_that_are_no_video_tell_nothing(tmp_path) -> None:
    kinds = (("b.mp4", "mpeg4"), ("b.mkv", "ffv1"), ("b.webm", "libvpx-vp9"))
    videos = [coded(tmp_path / name, wall(0.2, 0.5), 0.6, codec) for name, codec in kinds]
    clip, text = film(tmp_path, wall(0.2, 0.5), puff, 0.6), tmp_path / "a.mp4"
    text.write_text("no video")
    for path in (*videos, clip.path, *clip.files[:1], text, tmp_path, tmp_path / "absent.mp4"):
        assert median_quantizer(path) is None
