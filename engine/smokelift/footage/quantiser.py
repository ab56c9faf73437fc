"""How strongly a video is compressed, as its own blocks say.

An encoder leaves a block as it was where it differs by less than the quantiser's step, so that faint smoke stays where
it was. FFmpeg exports the quantisers of H.264, 0 to 51, the step doubling every six; those of other codecs it leaves
out, or they have other scales.
"""

from __future__ import annotations

from itertools import islice
from pathlib import Path
from typing import Any

import av
import numpy as np
from av.sidedata.sidedata import Type as SideData

from smokelift.footage.container import open_container

FRAMES = 21
"""Frames at the start of a file whose quantisers are read."""

COARSE = 42.0
"""Quantiser from which on faint smoke is taken for background, in front of one of more than one colour. Before a brick
wall crf 32 has 37 at most, crf 36 has 41, and crf 45, which costs mass there, 44 to 50
(docs/experiments/disturbed-clips.md)."""

CODEC = "h264"
"""FFmpeg's name of the codec whose quantisers are understood."""

H264 = 1
"""What FFmpeg calls the scale of its quantisers: AV_VIDEO_ENC_PARAMS_H264."""

HEADER = np.dtype(
    [("blocks", "u4"), ("", "u4"), ("offset", "u8"), ("size", "u8"), ("scale", "i4"), ("quantiser", "i4")]
)
"""The start of AVVideoEncParams (libavutil/video_enc_params.h): where its blocks are; the quantiser of the frame."""

DIFFERENCE = 16
"""Bytes before the difference to it in a block: those of its place and size."""


def median_quantiser(path: Path) -> float | None:
    """Return the median of the mean quantisers of a video's first frames; None where the file does not tell them."""
    try:
        with open_container(path) as container:
            stream = next(iter(container.streams.video), None)
            if stream is None or stream.codec_context is None or stream.codec_context.name != CODEC:
                return None
            stream.codec_context.options = {"export_side_data": "venc_params"}
            found = [_mean_quantiser(frame) for frame in islice(container.decode(stream), FRAMES)]
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
    header = np.frombuffer(data, HEADER, 1)[0]
    if header["scale"] != H264:
        return None
    count, start, size = (int(header[name]) for name in ("blocks", "offset", "size"))
    blocks = np.frombuffer(data, np.uint8, count * size, start).reshape(count, size)
    differences = np.ascontiguousarray(blocks[:, DIFFERENCE : DIFFERENCE + 4]).view(np.int32)
    return float(header["quantiser"]) + float(differences.mean() if count else 0)
