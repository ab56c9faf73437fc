"""Clips whose background and smoke are known."""

from collections.abc import Callable
from pathlib import Path

import av
import numpy as np

from smokelift.footage.backdrop import find_backdrop
from smokelift.footage.clip import Clip
from smokelift.footage.images import linear_to_srgb, srgb_to_linear
from smokelift.footage.plate import Plate
from smokelift.output.images import write_image

HEIGHT, WIDTH, COUNT = 72, 56, 24


def wall(low: float, high: float) -> np.ndarray:
    """Return a textured linear background, the same each time."""
    blocks = np.random.default_rng(0).uniform(low, high, (HEIGHT // 8, WIDTH // 8, 3))
    return srgb_to_linear(np.kron(blocks, np.ones((8, 8, 1))))


def puff(n: float) -> np.ndarray:
    """Return the opacity of a round puff that rises through the picture."""
    rows, columns = np.mgrid[:HEIGHT, :WIDTH]
    center = HEIGHT - 2.5 * n, WIDTH / 2 + 6 * np.sin(n / 3)
    distance = np.hypot(rows - center[0], columns - center[1])
    return 0.7 * np.clip(1.5 - distance / 9, 0.0, 1.0) * (1.0 + 0.2 * np.sin(0.9 * n + rows / 3))


def film(
    folder: Path,
    plate: np.ndarray,
    opacity: Callable[[int], np.ndarray],
    color: float | np.ndarray,
    noise: float = 1.0,
) -> Clip:
    """Write and open a clip of smoke of a color before a plate, with sensor noise in 8 bit codes."""
    random = np.random.default_rng(1)
    for n in range(COUNT):
        alpha = np.clip(opacity(n), 0.0, 1.0)[..., None]
        clean = plate * (1.0 - alpha) + color * alpha
        codes = linear_to_srgb(clean) + random.normal(0.0, noise / 255, clean.shape)
        write_image(folder / f"frame_{n:03d}.png", srgb_to_linear(np.clip(codes, 0.0, 1.0)))
    return Clip.open(folder / "frame_###.png", fps=24)


def coded(
    path: Path,
    plate: np.ndarray,
    opacity: Callable[[int], np.ndarray],
    color: float,
    qp: int | None = None,
    codec: str = "libx264",
    **options: str | int,
) -> Path:
    """Write a video of smoke of a color before a plate, coded with a quantizer or with a codec's options."""
    with av.open(path, "w") as out:
        stream = out.add_stream(codec, rate=24)
        stream.height, stream.width = plate.shape[:2]
        stream.pix_fmt = "yuv420p"
        given = options if qp is None else {"qp": qp, **options}
        stream.options = {name: str(value) for name, value in given.items()}
        for n in range(COUNT):
            alpha = np.clip(opacity(n), 0.0, 1.0)[..., None]
            codes = np.rint(255 * linear_to_srgb(plate * (1.0 - alpha) + color * alpha)).astype(np.uint8)
            out.mux(stream.encode(av.VideoFrame.from_ndarray(codes, "rgb24")))
        out.mux(stream.encode())
    return path


def overlap(mask: np.ndarray, truth: np.ndarray) -> float:
    return float((mask & truth).sum() / (mask | truth).sum())


def codes_apart(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    return np.abs(linear_to_srgb(a) - linear_to_srgb(b)).max(axis=2) * 255


def pan(folder: Path, wide: np.ndarray, smoke: float) -> Clip:
    """Write and open a clip in which a wide background passes by behind smoke."""
    random = np.random.default_rng(2)
    for n in range(COUNT):
        alpha = np.clip(smoke * puff(n), 0.0, 1.0)[..., None]
        codes = linear_to_srgb(wide[:, 2 * n : 2 * n + WIDTH] * (1.0 - alpha) + 0.6 * alpha)
        codes = codes + random.normal(0.0, 1.0 / 255, codes.shape)
        write_image(folder / f"frame_{n:03d}.png", srgb_to_linear(np.clip(codes, 0.0, 1.0)))
    return Clip.open(folder / "frame_###.png", fps=24)


def passing_wall() -> np.ndarray:
    """Return a textured linear background that is wide enough for a pan."""
    blocks = np.random.default_rng(0).uniform(0.2, 0.5, (HEIGHT // 8, (WIDTH + 2 * COUNT) // 8, 3))
    return srgb_to_linear(np.kron(blocks, np.ones((8, 8, 1))))


def plate_of(clip: Clip) -> Plate:
    """Return the background that is found for a clip whose camera stands still."""
    found = find_backdrop(clip, None, None).plates
    assert isinstance(found, Plate)
    return found
