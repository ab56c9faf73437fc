"""Files opened with FFmpeg, which takes a path that looks like a URL for one and fetches it, and what they say."""

from __future__ import annotations

from itertools import islice
from pathlib import Path
from typing import Any

import av
import numpy as np
from av.container import InputContainer
from av.sidedata.sidedata import Type as SideData

OPENING_BYTES = 2**25
"""Bytes that a file is opened with: the contexts of its decoders, and some frames to know them by."""

MAX_BOXES = 1000
"""Boxes of an MP4 file that are read; a whole one has a handful, one in fragments its index among the first."""

QUANTISED_FRAMES = 21
"""Frames at the start of a file whose quantisers are read."""

QUANTISED_CODEC = "h264"
"""FFmpeg's name of the codec whose quantisers are understood."""

H264_SCALE = 1
"""What FFmpeg calls the scale of its quantisers: AV_VIDEO_ENC_PARAMS_H264."""

QUANTISER_HEADER = np.dtype(
    [("blocks", "u4"), ("", "u4"), ("offset", "u8"), ("size", "u8"), ("scale", "i4"), ("quantiser", "i4")]
)
"""The start of AVVideoEncParams (libavutil/video_enc_params.h): where its blocks are; the quantiser of the frame."""

DIFFERENCE_OFFSET = 16
"""Bytes before the difference to it in a block: those of its place and size."""


def open_container(path: Path, form: str | None = None, **options: str) -> InputContainer:
    """Open a file, and whatever it refers to on this machine, but nothing on another.

    Parameters
    ----------
    path
        The file, whatever characters are in its name.
    form
        FFmpeg's name of the format; None takes what the content shows.
    options
        Of that format.

    Raises
    ------
    av.FFmpegError, ValueError
        If it is of no format that FFmpeg knows, or damaged.
    MemoryError
        If there is hardly any memory left, where PyAV would end the process.
    """
    bytes(OPENING_BYTES)  # given back at once, untouched: Python says that memory lacks, where PyAV would not
    container: InputContainer = av.open(
        f"file:{path.absolute()}", format=form, options={"protocol_whitelist": "file", **options}
    )
    return container


def lacks_index(path: Path) -> bool:
    """Return whether a file is an MP4 or QuickTime one without its whole index, as a recording that was cut short is.

    Such a file is a row of boxes: eight bytes with size and name, and what it holds (ISO/IEC 14496-12, 4.2).
    """
    with path.open("rb") as file:
        end, start = path.stat().st_size, 0
        for number in range(MAX_BOXES):
            file.seek(start)
            head = file.read(16)
            if number == 0 and head[4:8] != b"ftyp":
                return False
            size = int.from_bytes(head[:4], "big")
            if head[4:8] == b"moov" and start + size <= end:
                return False
            if size == 1:  # the true size follows the name
                size = int.from_bytes(head[8:], "big")
            start += size
            if size < 8 or start + 8 > end:  # 0: up to the end of the file
                return True
    return False


def median_quantiser(path: Path) -> float | None:
    """Return the median of the mean quantisers of a video's first frames, 0 to 51; None where the file tells none.

    They say how strongly a video is compressed: an encoder leaves a block as it was where it differs by less than the
    quantiser's step, which doubles every six. FFmpeg exports those of H.264; other codecs have other scales.
    """
    try:
        with open_container(path) as container:
            stream = next(iter(container.streams.video), None)
            if stream is None or stream.codec_context is None or stream.codec_context.name != QUANTISED_CODEC:
                return None
            stream.codec_context.options = {"export_side_data": "venc_params"}
            found = [_mean_quantiser(frame) for frame in islice(container.decode(stream), QUANTISED_FRAMES)]
    except (av.FFmpegError, ValueError):
        return None
    means = [mean for mean in found if mean is not None]
    return float(np.median(means)) if means else None


def _mean_quantiser(frame: av.VideoFrame) -> float | None:
    """The mean quantiser of the blocks of a frame, if its decoder says them."""
    sides: Any = frame.side_data  # PyAV's stub of it knows motion vectors only
    side = sides.get(SideData.VIDEO_ENC_PARAMS)
    if side is None:
        return None
    data = bytes(side)
    header = np.frombuffer(data, QUANTISER_HEADER, 1)[0]
    if header["scale"] != H264_SCALE:
        return None
    count, start, size = (int(header[name]) for name in ("blocks", "offset", "size"))
    blocks = np.frombuffer(data, np.uint8, count * size, start).reshape(count, size)
    differences = np.ascontiguousarray(blocks[:, DIFFERENCE_OFFSET : DIFFERENCE_OFFSET + 4]).view(np.int32)
    return float(header["quantiser"]) + float(differences.mean() if count else 0)
