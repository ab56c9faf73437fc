"""A film of a few frames that shows which way is up and which frame is which, and ways to encode it."""

from collections.abc import Sequence
from fractions import Fraction
from pathlib import Path
from typing import Any

import av
import numpy as np
import numpy.typing as npt

from smokelift.footage.images import linear_to_srgb, srgb_to_linear

Pictures = npt.NDArray[np.float32]
"""sRGB values from 0 to 1, (frames, rows, columns, 3)."""

FRAMES = 8
FPS = 24

BT709, BT2020 = (0.2126, 0.0722), (0.2627, 0.0593)
"""Shares of red and blue in luma."""


def film(width: int = 96, height: int = 64, frames: int = FRAMES) -> Pictures:
    """Grey smoke that rises before a wall with a red patch at the top left and a blue one at the top right."""
    y, x = np.mgrid[:height, :width] + 0.5
    wall = 0.3 + 0.1 * np.sin(x / width * 19)[..., None] * np.sin(y / height * 13)[..., None] * np.ones(3)
    patch = (y < height / 4)[..., None]
    wall = np.where(patch & (x < width / 5)[..., None], [0.6, 0.2, 0.2], wall)
    wall = np.where(patch & (x > 0.8 * width)[..., None], [0.2, 0.2, 0.6], wall)
    shown = []
    for n in range(frames):
        share = (n + 0.5) / frames
        distance = np.hypot((x - width / 2) / (0.16 * width), (y - height * (0.9 - 0.6 * share)) / (0.2 * height))
        opacity = 0.8 * np.clip(1.3 - distance, 0, 1)[..., None]
        shown.append(linear_to_srgb(srgb_to_linear(wall) * (1 - opacity) + 0.55 * opacity))
    return np.asarray(np.stack(shown), np.float32)


def smoke(grey: float = 0.35, width: int = 96, height: int = 64, frames: int = FRAMES) -> npt.NDArray[np.float32]:
    """Straight sRGB values and opacity, (frames, rows, columns, 4), of smoke alone."""
    y, x = np.mgrid[:height, :width] + 0.5
    shown = []
    for n in range(frames):
        share = (n + 0.5) / frames
        distance = np.hypot((x - width / 2) / (0.16 * width), (y - height * (0.9 - 0.6 * share)) / (0.2 * height))
        opacity = 0.8 * np.clip(1.3 - distance, 0, 1)
        shown.append(np.dstack([np.full((height, width, 3), grey), opacity]))
    return np.asarray(np.stack(shown), np.float32)


def eight_bits(values: npt.NDArray[np.float32]) -> npt.NDArray[np.uint8]:
    """Values from 0 to 1 as a file of 8 bits holds them."""
    return np.clip(values * 255 + 0.5, 0, 255).astype(np.uint8)


def encode(
    path: Path,
    pictures: npt.NDArray[Any],
    codec: str = "libx264",
    pixels: str = "yuv444p",
    *,
    given: str = "rgb24",
    options: dict[str, str] | None = None,
    times: Sequence[int] | None = None,
    rate: Fraction | int = FPS,
    form: str | None = None,
    rotation: int = 0,
    muxer: dict[str, str] | None = None,
    **tags: Any,
) -> Path:
    """Write 8 bit pictures with FFmpeg; tags are attributes of the codec's context, times are in 1/240 s."""
    lossless = {"libx264": {"qp": "0"}, "libx265": {"x265-params": "lossless=1:log-level=none"}}
    space = tags.get("colorspace")
    with av.open(f"file:{path.absolute()}", "w", format=form, options=muxer or {}) as out:
        stream: Any = out.add_stream(codec, rate=rate)
        stream.height, stream.width = pictures[0].shape[:2]
        stream.pix_fmt = pixels
        stream.options = {**lossless.get(codec, {}), **(options or {})}
        if times is not None:
            stream.codec_context.time_base = Fraction(1, 240)
        for name, value in tags.items():
            setattr(stream.codec_context, name, value)
        if rotation:
            stream.set_display_rotation(rotation)
        for n, picture in enumerate(pictures):
            frame = av.VideoFrame.from_ndarray(np.ascontiguousarray(picture), format=given)
            if pixels != given:
                frame = frame.reformat(format=pixels, dst_colorspace=space)
            if "color_range" in tags:
                frame.color_range = tags["color_range"]
            frame.pts = n if times is None else times[n]
            frame.time_base = 1 / Fraction(rate) if times is None else Fraction(1, 240)
            out.mux(stream.encode(frame))
        out.mux(stream.encode())
    return path


def wide(path: Path, signal: npt.NDArray[np.float32], bits: int, matrix: tuple[float, float], **tags: int) -> Path:
    """Write signals of red, green and blue as lossless 4:4:4 luma and chroma of 10 or 12 bits and limited range."""
    pixels, step = f"yuv444p{bits}le", 2 ** (bits - 8)
    red, blue = matrix
    with av.open(str(path), "w") as out:
        stream: Any = out.add_stream("ffv1", rate=FPS)
        stream.height, stream.width, stream.pix_fmt = *signal.shape[1:3], pixels
        for name, value in tags.items():
            setattr(stream.codec_context, name, value)
        for n, picture in enumerate(signal.astype(np.float64)):
            luma = picture @ [red, 1 - red - blue, blue]
            chroma = [(picture[..., 2] - luma) / (2 - 2 * blue), (picture[..., 0] - luma) / (2 - 2 * red)]
            codes = [16 + 219 * luma, *(128 + 224 * c for c in chroma)]
            frame = av.VideoFrame(stream.width, stream.height, pixels)
            for plane, code in zip(frame.planes, codes, strict=True):
                rows = np.zeros((stream.height, plane.line_size // 2), np.uint16)
                rows[:, : stream.width] = np.clip(code * step + 0.5, 0, 256 * step - 1)
                plane.update(rows.tobytes())
            frame.pts = n
            out.mux(stream.encode(frame))
        out.mux(stream.encode())
    return path


def to_bt2020(linear: npt.NDArray[Any]) -> npt.NDArray[Any]:
    """Bring linear colours [..., rgb] from BT.709 to BT.2020 (BT.2087)."""
    matrix = np.array([[0.6274, 0.3293, 0.0433], [0.0691, 0.9195, 0.0114], [0.0164, 0.0880, 0.8956]])
    return np.asarray(linear @ matrix.T)


def hlg_signal(linear: npt.NDArray[Any]) -> npt.NDArray[Any]:
    """Encode linear light, diffuse white at 1, as hybrid log-gamma (BT.2100)."""
    scene = linear * 0.26496  # of the peak: white is at 75 % of the signal
    high = 0.17883277 * np.log(np.maximum(12 * scene - 0.28466892, 1e-9)) + 0.55991073
    return np.where(scene <= 1 / 12, np.sqrt(3 * np.maximum(scene, 0)), high)
