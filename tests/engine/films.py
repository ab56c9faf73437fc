"""Clips whose background and smoke are known, and files as a camera or a renderer writes them."""

from collections.abc import Callable, Iterable, Iterator, Sequence
from fractions import Fraction
from pathlib import Path
from typing import Any

import av
import numpy as np
import OpenEXR

from smokelift.extraction.find_background import find_background
from smokelift.extraction.plate import Plate
from smokelift.footage.clip import Clip
from smokelift.footage.frame_source import FrameSource, StoredPicture
from smokelift.footage.image_files import code_values
from smokelift.footage.images import linear_to_srgb, srgb_to_linear
from smokelift.footage.noise import lasting_noise
from smokelift.output.images import write_image

HEIGHT, WIDTH, COUNT = 72, 56, 24


def wall(low: float, high: float, width: int = WIDTH) -> np.ndarray:
    """Return a textured linear background, the same each time."""
    blocks = np.random.default_rng(0).uniform(low, high, (HEIGHT // 8, width // 8, 3))
    return srgb_to_linear(np.kron(blocks, np.ones((8, 8, 1))))


def passing_wall() -> np.ndarray:
    """Return a textured linear background that is wide enough for a pan."""
    return wall(0.2, 0.5, WIDTH + 2 * COUNT)


def puff(n: float) -> np.ndarray:
    """Return the opacity of a round puff that rises through the picture."""
    rows, columns = np.mgrid[:HEIGHT, :WIDTH]
    center = HEIGHT - 2.5 * n, WIDTH / 2 + 6 * np.sin(n / 3)
    distance = np.hypot(rows - center[0], columns - center[1])
    return 0.7 * np.clip(1.5 - distance / 9, 0.0, 1.0) * (1.0 + 0.2 * np.sin(0.9 * n + rows / 3))


def before(plate: np.ndarray, opacity: np.ndarray, color: float | np.ndarray) -> np.ndarray:
    """Return smoke of an opacity (rows, columns) and a color before a plate."""
    alpha = np.clip(opacity, 0.0, 1.0)[..., None]
    return plate * (1.0 - alpha) + color * alpha


def grainy(pictures: Iterable[np.ndarray], noise: float, seed: int = 1) -> Iterator[np.ndarray]:
    """Yield linear pictures with a sensor's noise in 8 bit codes."""
    random = np.random.default_rng(seed)
    for picture in pictures:
        codes = linear_to_srgb(picture) + random.normal(0.0, noise / 255, picture.shape)
        yield srgb_to_linear(np.clip(codes, 0.0, 1.0))


def clip_of(folder: Path, pictures: Iterable[np.ndarray], suffix: str = ".png", **how: Any) -> Clip:
    """Write linear pictures, and open them as `Clip.open` does, by default with 24 frames per second."""
    folder.mkdir(parents=True, exist_ok=True)
    for n, picture in enumerate(pictures):
        write_image(folder / f"frame_{n:03d}{suffix}", picture)
    return Clip.open(folder / f"frame_###{suffix}", **{"fps": 24, **how})


def film(
    folder: Path, plate: np.ndarray, opacity: Callable[[int], np.ndarray], color: float | np.ndarray, noise: float = 1.0
) -> Clip:
    """Write and open a clip of smoke of a color before a plate, with sensor noise in 8 bit codes."""
    return clip_of(folder, grainy((before(plate, opacity(n), color) for n in range(COUNT)), noise))


def pan(folder: Path, wide: np.ndarray, smoke: float) -> Clip:
    """Write and open a clip in which a wide background passes by behind smoke."""
    shown = (before(wide[:, 2 * n : 2 * n + WIDTH], smoke * puff(n), 0.6) for n in range(COUNT))
    return clip_of(folder, grainy(shown, 1.0, seed=2))


def coded(path: Path, plate: np.ndarray, color: float, codec: str = "libx264", **options: str) -> Path:
    """Write a video of the puff in a color before a plate, coded with a codec's options."""
    shown = [linear_to_srgb(before(plate, puff(n), color)) for n in range(COUNT)]
    return encode(path, [np.rint(255 * picture).astype(np.uint8) for picture in shown], codec, options=options)


class Filmed(FrameSource):
    """Frames of 8 bit codes in memory, as a video's; ``read_frames`` are the numbers of those that were read."""

    def __init__(self, codes: np.ndarray) -> None:
        self.codes, self.count = codes, len(codes)
        self.read_frames: list[int] = []

    def read(self, n: int) -> StoredPicture:
        self.read_frames.append(n)
        return StoredPicture(self.codes[n], code_values(255))


PIXELS = {(1, 3): "rgb24", (1, 4): "rgba", (2, 3): "rgb48le", (2, 4): "rgba64le"}
"""FFmpeg's names of pixels by bytes of a code and channels."""


def encode(
    path: Path,
    pictures: Sequence[np.ndarray],
    codec: str = "libx264",
    pixels: str = "yuv420p",
    *,
    times: Sequence[int] | None = None,
    rotation: int = 0,
    options: dict[str, str] | None = None,
    muxer: dict[str, str] | None = None,
    metadata: dict[str, str] | None = None,
    **tags: Any,
) -> Path:
    """Write pictures (rows, columns, channels) of 8 or 16 bits with FFmpeg: a video, or one file of a picture.

    A video has 24 frames per second, or ``times`` in 1/240 s, and is lossless in H.264. ``tags`` are attributes of the
    codec's context.
    """
    picture = path.suffix.lower() in (".png", ".tif", ".tiff", ".dpx")
    form: dict[str, Any] = {"format": "image2", "options": {"update": "1"}} if picture else {"options": muxer or {}}
    with av.open(f"file:{path.absolute()}", "w", **form) as out:
        out.metadata.update(metadata or {})
        stream: Any = out.add_stream(codec, rate=24)
        stream.height, stream.width = pictures[0].shape[:2]
        stream.pix_fmt = pixels
        stream.options = {**({"qp": "0"} if codec == "libx264" else {}), **(options or {})}
        if times is not None:
            stream.codec_context.time_base = Fraction(1, 240)
        for name, value in tags.items():
            setattr(stream.codec_context, name, value)
        if rotation:
            stream.set_display_rotation(rotation)
        for n, codes in enumerate(pictures):
            given = PIXELS[codes.itemsize, codes.shape[-1]]
            frame = av.VideoFrame.from_ndarray(np.ascontiguousarray(codes), given)
            frame = frame.reformat(format=pixels, dst_colorspace=tags.get("colorspace"))
            frame.color_range = tags.get("color_range", frame.color_range)
            frame.pts = n if times is None else times[n]
            frame.time_base = Fraction(1, 24 if times is None else 240)
            out.mux(stream.encode(frame))
        out.mux(stream.encode())
    return path


def blanked(path: Path, frames: Sequence[int]) -> Path:
    """Put zeros where the coded frames of some numbers are."""
    with av.open(str(path)) as container:
        places = [(packet.pos or 0, packet.size) for packet in container.demux(video=0) if packet.size]
    content = bytearray(path.read_bytes())
    for place, size in (places[n] for n in frames):
        content[place : place + size] = bytes(size)
    path.write_bytes(content)
    return path


def encode_sound(path: Path) -> Path:
    """Write a file without pictures."""
    with av.open(str(path), "w") as out:
        stream = out.add_stream("aac", rate=44100)
        frame = av.AudioFrame.from_ndarray(np.zeros((1, 1024), np.float32), format="fltp", layout="mono")
        frame.sample_rate = 44100
        out.mux(stream.encode(frame))
        out.mux(stream.encode())
    return path


def write_exr(path: Path, channels: dict[str, np.ndarray], **header: object) -> Path:
    """Write channels as they are to an EXR."""
    base = {"compression": OpenEXR.ZIP_COMPRESSION, "type": OpenEXR.scanlineimage}
    OpenEXR.File({**base, **header}, channels).write(str(path))
    return path


def overlap(mask: np.ndarray, truth: np.ndarray) -> float:
    return float((mask & truth).sum() / (mask | truth).sum())


def codes_apart(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    return np.abs(linear_to_srgb(a) - linear_to_srgb(b)).max(axis=2) * 255


def plate_of(clip: Clip) -> Plate:
    """Return the background that is found for a clip whose camera stands still."""
    return find_background(clip, None, None).plate


def clear_plate(image: np.ndarray, codes: float = 1.0) -> Plate:
    """Return a background that is known everywhere, before which noise has a deviation in 8 bit codes."""
    return Plate(np.asarray(image, np.float32), np.ones(image.shape[:2], np.float32), lasting_noise(codes / 255))
