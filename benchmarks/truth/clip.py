"""What a pictured clip needs besides Mitsuba: a painted wall, cameras around the smoke, and its files."""

import math
from pathlib import Path
from typing import Any

import av
import numpy as np
import numpy.typing as npt
from av.video.reformatter import Interpolation
from scipy import ndimage

Array = npt.NDArray[Any]

YAWS = {"front": 0, "nov20": 20, "nov45": 45, "side": 90}  # degrees about the vertical, towards +x
CHECK_BLOCK = 16  # pixels; volpath's noise is averaged over such blocks
# FFmpeg's conversion of colors is a code value too dark unless it is asked to round.
EXACT = int(
    Interpolation.BICUBIC | Interpolation.ACCURATE_RND | Interpolation.FULL_CHR_H_INT | Interpolation.FULL_CHR_H_INP
)


def srgb_encode(linear: Array) -> Array:
    """Return 8-bit sRGB values of linear ones."""
    linear = np.clip(linear, 0.0, 1.0)
    encoded = np.where(linear <= 0.0031308, 12.92 * linear, 1.055 * linear ** (1 / 2.4) - 0.055)
    return np.asarray(np.round(255.0 * encoded), np.uint8)


def srgb_decode(picture: Array) -> Array:
    """Return linear values of 8-bit sRGB ones."""
    encoded = picture / 255.0
    return np.where(encoded <= 0.04045, encoded / 12.92, ((encoded + 0.055) / 1.055) ** 2.4)


def wall(width: int, height: int, seed: int) -> Array:
    """Paint what stands behind the smoke: plaster, a rail, boards, the floor, and a bowl that it rises from.

    Parameters
    ----------
    width, height : int
        Size of the picture (pixels).
    seed : int
        Of the noise.

    Returns
    -------
    numpy.ndarray
        Linear picture [row, column, rgb].
    """
    rng = np.random.default_rng(seed)
    fine = 3  # painted that much larger, so that edges are smooth
    scale = fine * height / 384  # the sizes below are for 384 rows
    y, x = (np.mgrid[: fine * height, : fine * width] + 0.5) / scale

    def noise(*sigma: float) -> Array:
        field = ndimage.gaussian_filter(rng.normal(size=x.shape), np.multiply(sigma, scale), mode="wrap")
        return np.asarray(field / field.std())

    def paint(rgb: tuple[float, float, float], shade: Array) -> Array:
        return np.asarray(np.array(rgb) * shade[..., None])

    blotches = 0.10 * noise(40, 40) + 0.07 * noise(12, 12) + 0.05 * noise(4, 4) + 0.04 * noise(0.8, 0.8)
    plaster = np.exp(blotches + 0.05 * noise(1, 9))
    warp_x, warp_y = 7 * noise(9, 9), 7 * noise(9, 9)
    for offset, slope in ((51, 0.55), (238, -0.35)):
        crack = np.exp(-(((x + warp_x - offset - slope * (y + warp_y)) / 0.9) ** 2))
        plaster *= 1 - 0.45 * crack * (y < 172)
    picture = paint((0.170, 0.146, 0.118), plaster)

    board, across = np.divmod(x + 12, 34.0)
    tone = rng.normal(0.0, 0.16, 64)[board.astype(int)]
    rings = np.sin(0.9 * x + rng.uniform(0, 6, 64)[board.astype(int)] + 2.2 * noise(30, 5))
    boards = np.exp(tone + 0.10 * rings + 0.07 * noise(14, 0.7) + 0.06 * noise(5, 0.6))
    boards *= np.interp(across, [1.6, 1.7, 2.8, 2.9], [0.30, 1.35, 1.35, 1.0])
    boards *= np.interp(y, [238, 242, 249], [0.35, 0.55, 1.0])
    picture = np.where((y > 238)[..., None], paint((0.155, 0.088, 0.048), boards), picture)

    timber = np.exp(0.10 * noise(0.7, 16))
    profile = np.interp(y, [229, 230, 235, 238], [1.7, 1.1, 1.0, 0.9])
    picture = np.where((abs(y - 233) < 5)[..., None], paint((0.150, 0.095, 0.060), timber * profile), picture)
    profile = np.interp(y, [328, 329.5, 331, 346], [1.8, 1.6, 1.0, 0.8])
    picture = np.where((y > 328)[..., None], paint((0.110, 0.066, 0.042), timber * profile), picture)
    floor = np.exp(0.12 * noise(1.5, 22) + 0.06 * noise(0.7, 3))
    floor *= np.interp(y, [346, 349, 384], [0.4, 0.8, 1.3])
    picture = np.where((y > 346)[..., None], paint((0.095, 0.082, 0.072), floor), picture)
    picture *= (1.25 - 0.45 * np.hypot(x / 256 - 0.2, y / 384 - 0.15))[..., None]

    u, v = (x - 114) / 31, y - 336  # the bowl; v = 0 is its rim
    picture *= (1 - 0.75 * np.exp(-(((x - 122) / 36) ** 2) - ((y - 369) / 5) ** 2))[..., None]
    legs = (abs(abs(u) - 0.45 - 0.006 * v) < 0.045) & (v > 15) & (v < 34)
    body = (v > 0) & (u**2 + (v / 27) ** 2 < 1)
    gleam = 0.35 + 2.2 * np.exp(-(((u + 0.45) / 0.28) ** 2)) + 0.5 * np.exp(-(((u - 0.75) / 0.15) ** 2))
    iron = np.where(body, gleam, 0.5) * np.exp(0.06 * noise(0.8, 0.8))
    picture = np.where((body | legs)[..., None], paint((0.034, 0.031, 0.030), iron), picture)
    rim, mouth = u**2 + (v / 5.5) ** 2, (u / 0.92) ** 2 + (v / 4.0) ** 2
    picture = np.where((rim < 1)[..., None], paint((0.085, 0.078, 0.074), 1 - 0.6 * u), picture)
    picture = np.where((mouth < 1)[..., None], paint((0.012, 0.011, 0.010), np.ones_like(u)), picture)
    return np.asarray(picture.reshape(height, fine, width, fine, 3).mean(axis=(1, 3)))


def look_at(position: Array, target: Array, up: Array) -> Array:
    """Return the 4x4 camera-to-world matrix; the camera looks along its -Z."""
    back = (position - target) / np.linalg.norm(position - target)
    right = np.cross(up, back)
    right /= np.linalg.norm(right)
    matrix = np.eye(4)
    matrix[:3] = np.stack([right, np.cross(back, right), back, position], axis=1)
    return matrix


def turned(camera: dict[str, Any], degrees: float) -> tuple[Array, str]:
    """Turn a scene's camera about the world's vertical axis.

    Returns
    -------
    matrix : numpy.ndarray
        Camera to world, 4x4.
    text : str
        The camera's own scene file.
    """
    position, target, up = (np.array(camera[key], float) for key in ("position", "target", "up"))
    c, s = math.cos(math.radians(degrees)), math.sin(math.radians(degrees))
    turn = np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])
    matrix = look_at(turn @ position, turn @ target, turn @ up)
    rows = ",\n          ".join(str([round(float(v), 9) + 0.0 for v in row]) for row in matrix)
    text = f"""[camera]
type = "perspective"
matrix = [{rows}]
fov_y_degrees = {camera["fov_y_degrees"]}
size = {camera["size"]}
"""
    return matrix, text


def crop(density: Array, low: Array, voxel: float) -> tuple[Array, Array, Array]:
    """Cut the smoke out, with a voxel of clear air around it; return it with the corners of its box."""
    filled = np.nonzero(density)
    first = np.array([max(i.min() - 1, 0) for i in filled])
    last = np.array([min(i.max() + 2, n) for i, n in zip(filled, density.shape, strict=True)])
    part = density[tuple(slice(a, b) for a, b in zip(first, last, strict=True))]
    return part, low + first * voxel, low + last * voxel


def blocks(image: Array) -> Array:
    """Average over blocks of pixels."""
    height, width = image.shape[:2]
    b = CHECK_BLOCK
    return np.asarray(image.reshape(height // b, b, width // b, b, -1).mean(axis=(1, 3)))


def write_png(path: Path, picture: Array) -> None:
    """Write an 8-bit picture."""
    with av.open(str(path), "w", format="image2", options={"update": "1"}) as container:
        stream = container.add_stream("png", options={"pred": "mixed", "compression_level": "9"})
        stream.height, stream.width = picture.shape[:2]
        stream.pix_fmt = "rgb24"
        for packet in (*stream.encode(av.VideoFrame.from_ndarray(picture, "rgb24")), *stream.encode()):
            container.mux(packet)


def write_video(path: Path, pictures: list[Array], fps: float, crf: int) -> None:
    """Write 8-bit pictures as H.264, BT.709."""
    with av.open(str(path), "w", options={"movflags": "faststart"}) as container:
        stream = container.add_stream("libx264", rate=round(fps), options={"crf": str(crf), "preset": "veryslow"})
        stream.height, stream.width = pictures[0].shape[:2]
        stream.pix_fmt = "yuv420p"
        context = stream.codec_context
        context.colorspace = context.color_primaries = context.color_trc = 1
        context.color_range = 1
        for picture in pictures:
            frame = av.VideoFrame.from_ndarray(picture, "rgb24")
            frame = frame.reformat(
                format="yuv420p", dst_colorspace="ITU709", dst_color_range="MPEG", interpolation=EXACT
            )
            container.mux(stream.encode(frame))
        container.mux(stream.encode())
