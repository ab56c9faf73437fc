"""Videos on disk that appear whole or not at all."""

from __future__ import annotations

from collections.abc import Iterable
from fractions import Fraction
from pathlib import Path
from typing import Any

import av

from smokelift.output.atomic import atomic_path
from smokelift.output.images import eight_bit
from smokelift.render import Image

VIDEO_KINDS = {
    ".mp4": ("mp4", "libx264"),
    ".mov": ("mov", "libx264"),
    ".mkv": ("matroska", "libx264"),
    ".webm": ("webm", "libvpx-vp9"),
}
"""Container and codec of each suffix."""


def write_video(path: Path, frames: Iterable[Image], fps: float) -> None:
    """Write linear frames (rows, columns, 3) of one size; the suffix says which kind of `VIDEO_KINDS`."""
    container_format, codec = VIDEO_KINDS[path.suffix.lower()]
    with atomic_path(path) as aside, av.open(f"file:{aside.absolute()}", "w", format=container_format) as container:
        stream: Any = None
        for frame in frames:
            picture = eight_bit(frame)
            picture = picture[: picture.shape[0] // 2 * 2, : picture.shape[1] // 2 * 2]  # codecs want even sides
            if stream is None:
                stream = container.add_stream(codec, rate=Fraction(fps).limit_denominator(1001))
                stream.height, stream.width = picture.shape[:2]
                stream.pix_fmt = "yuv420p"
                stream.options = {"crf": "18"}
            container.mux(stream.encode(av.VideoFrame.from_ndarray(picture, format="rgb24")))
        if stream is not None:
            container.mux(stream.encode())
