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
from films import coded, film, puff, wall

from smokelift.footage.clip import Clip
from smokelift.footage.frame_source import ClipError
from smokelift.footage.images import ImageError, read_image
from smokelift.footage.video import lacks_index, median_quantizer
from smokelift.output.images import write_video

FRAMES = [np.full((16, 32, 3), value, np.float32) for value in (0.1, 0.3, 0.5)]


@pytest.fixture
def server() -> Iterator[socket.socket]:
    """Waits for connections that must not come."""
    with socket.create_server(("127.0.0.1", 0)) as listening:
        listening.setblocking(False)
        yield listening
        with pytest.raises(BlockingIOError):
            listening.accept()


def test_a_folder_named_like_a_server_is_a_folder(tmp_path: Path, server: socket.socket, monkeypatch) -> None:
    monkeypatch.chdir(tmp_path)
    name = Path(f"http:/127.0.0.1:{server.getsockname()[1]}/clip.mp4")
    name.parent.mkdir(parents=True)
    write_video(name, FRAMES, 24)
    with Clip.open(name) as clip:
        assert len(clip) == 3


@pytest.mark.parametrize("kind", ["m3u8", "ffconcat"])
def test_nothing_is_fetched_from_what_a_file_refers_to(tmp_path: Path, server: socket.socket, kind: str) -> None:
    address = f"http://127.0.0.1:{server.getsockname()[1]}/clip.ts"
    text = {
        "m3u8": f"#EXTM3U\n#EXT-X-TARGETDURATION:9\n#EXTINF:9,\n{address}\n#EXT-X-ENDLIST\n",
        "ffconcat": f"ffconcat version 1.0\nfile {address}\n",
    }[kind]
    (tmp_path / f"list.{kind}").write_text(text)
    with pytest.raises(ClipError):
        Clip.open(tmp_path / f"list.{kind}")


@pytest.mark.parametrize("name", ["pipe:0.mp4", "concat:a|b.mp4", "a%03d.mp4", "-i.mp4", "crypto:x.mp4"])
def test_any_name_is_that_of_a_file(tmp_path: Path, monkeypatch, name: str) -> None:
    monkeypatch.chdir(tmp_path)
    write_video(Path(name), FRAMES, 24)
    with Clip.open(name) as clip:
        assert len(clip) == 3


def png(width: int, height: int, depth: int) -> bytes:
    """A PNG whose header lies, with a few pixels."""

    def chunk(kind: bytes, content: bytes) -> bytes:
        return struct.pack(">I", len(content)) + kind + content + struct.pack(">I", zlib.crc32(kind + content))

    header = struct.pack(">IIBBBBB", width, height, depth, 2, 0, 0, 0)
    return (
        b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", header) + chunk(b"IDAT", zlib.compress(bytes(99))) + chunk(b"IEND", b"")
    )


def test_a_16_bit_png_with_a_pattern_for_a_name(tmp_path: Path) -> None:
    (tmp_path / "a%03d.png").write_bytes(png(2, 3, 16))
    assert read_image(tmp_path / "a%03d.png").shape == (3, 2, 3)


@pytest.mark.parametrize("depth", [8, 16])
@pytest.mark.parametrize("size", [(100_000, 100_000), (30_000, 30_000), (2**31 - 1, 1)])
def test_a_picture_that_says_it_is_huge_is_not_believed(tmp_path: Path, depth: int, size: tuple[int, int]) -> None:
    (tmp_path / "plate.png").write_bytes(png(*size, depth))
    with pytest.raises(ImageError, match=r"plate\.png: cannot be read: "):
        read_image(tmp_path / "plate.png")


@pytest.mark.parametrize("name", ["clip.mp4", "frame_0001.png", "plate.hdr"])
def test_a_pipe_is_not_waited_for(tmp_path: Path, name: str) -> None:
    os.mkfifo(tmp_path / name)
    with pytest.raises(ValueError, match=r"is a pipe or a device|no such file"):
        Clip.open(tmp_path / name)


@pytest.mark.parametrize("left", [0.2, 0.6])
def test_a_recording_that_was_cut_short_is_told_from_what_is_no_video(tmp_path: Path, left: float) -> None:
    clip = tmp_path / "clip.mp4"
    write_video(clip, FRAMES, 24)
    assert not lacks_index(clip)
    content = clip.read_bytes()
    clip.write_bytes(content[: int(left * len(content))])
    with pytest.raises(ClipError, match=r"clip\.mp4: breaks off before its index is complete"):
        Clip.open(clip)


@pytest.mark.parametrize("content", [b"x", bytes(16) * 9, b"\0\0\0\x08free" * 3])
def test_what_has_no_boxes_lacks_no_index(tmp_path: Path, content: bytes) -> None:
    (tmp_path / "clip.mp4").write_bytes(content)
    assert not lacks_index(tmp_path / "clip.mp4")


@pytest.mark.parametrize("quantizer", [10, 30, 48])
def test_the_quantizer_is_that_of_the_encoder(tmp_path: Path, quantizer: int) -> None:
    path = coded(tmp_path / "clip.mp4", wall(0.2, 0.5), puff, 0.6, quantizer)
    assert median_quantizer(path) == pytest.approx(quantizer, abs=3)


@pytest.mark.parametrize(("name", "codec"), [("a.mp4", "mpeg4"), ("a.mkv", "ffv1"), ("a.webm", "libvpx-vp9")])
def test_other_codecs_tell_nothing(tmp_path: Path, name: str, codec: str) -> None:
    assert median_quantizer(coded(tmp_path / name, wall(0.2, 0.5), puff, 0.6, codec=codec)) is None


def test_pictures_and_files_that_are_no_video_tell_nothing(tmp_path: Path) -> None:
    clip = film(tmp_path, wall(0.2, 0.5), puff, 0.6)
    text = tmp_path / "a.mp4"
    text.write_text("no video")
    for path in (clip.path, *clip.files[:1], text, tmp_path, tmp_path / "absent.mp4"):
        assert median_quantizer(path) is None
