"""What a camera, a codec and an editor do to pictures, and clips in memory. Pictures are (frames, rows, columns, 3)."""

import io
from pathlib import Path

import av
import numpy as np
import numpy.typing as npt
from av.video.reformatter import Interpolation

from smokelift.checks import Doubles
from smokelift.footage.clip import Clip
from smokelift.footage.frame_source import FrameSource, StoredPicture
from smokelift.footage.images import Picture, linear_to_srgb, srgb_to_linear

FPS = 24.0

EXACT = int(Interpolation.BICUBIC) | int(Interpolation.ACCURATE_RND) | int(Interpolation.FULL_CHR_H_INT)
"""How FFmpeg converts colors without a shift: by default red, green and blue end up 1 to 2 codes of 8 bit too dark."""


class Frames(FrameSource):
    """Frames in memory."""

    def __init__(self, codes: npt.NDArray[np.uint8]) -> None:
        self.codes, self.count = codes, len(codes)

    def read(self, n: int) -> StoredPicture:
        """Return a frame, linear."""
        return StoredPicture(srgb_to_linear(self.codes[n].astype(np.float32) / np.float32(255)))


def filmed(encoded: Picture) -> Clip:
    """Return the clip of sRGB pictures at eight bits."""
    return Clip(Path("clip"), Frames(eight_bits(encoded)), FPS)


def eight_bits(encoded: Picture) -> npt.NDArray[np.uint8]:
    """Return sRGB values rounded to what a file holds."""
    return np.clip(encoded * 255 + 0.5, 0, 255).astype(np.uint8)


def compressed(encoded: Picture, crf: int) -> Picture:
    """Return what is left of sRGB pictures after H.264 at a constant rate factor."""
    file = io.BytesIO()
    with av.open(file, "w", format="mp4") as container:
        stream = container.add_stream("libx264", rate=24, options={"crf": str(crf)})
        stream.height, stream.width = encoded.shape[1:3]
        stream.pix_fmt = "yuv420p"
        for picture in eight_bits(encoded):
            container.mux(stream.encode(av.VideoFrame.from_ndarray(picture, "rgb24")))
        container.mux(stream.encode())
    file.seek(0)
    with av.open(file, "r") as coded:
        shown = [frame.reformat(format="rgb24", interpolation=EXACT) for frame in coded.decode(video=0)]
        pictures = [frame.to_ndarray() for frame in shown]
    return np.stack(pictures).astype(np.float32) / np.float32(255)


def noisy(encoded: Picture, deviation: float) -> Picture:
    """Return sRGB pictures with white noise, independent in every pixel and channel; white is 1."""
    noise = np.random.default_rng(0).standard_normal(encoded.shape, np.float32)
    return encoded + np.float32(deviation) * noise


def crushed(encoded: Picture, level: float) -> Picture:
    """Return pictures whose sRGB values below a level are black, and the rest stretched."""
    return np.clip((encoded - np.float32(level)) / np.float32(1 - level), 0, 1)


def exposed(linear: Picture, gains: npt.ArrayLike = 1.0) -> Picture:
    """Return linear pictures in sRGB, with one gain, one per frame, or one per frame and channel."""
    gain = np.asarray(gains, np.float32)
    return linear_to_srgb(linear * (gain.reshape(len(linear), 1, 1, -1) if gain.ndim else gain))


def flickering(count: int, fraction: float) -> Doubles:
    """Return gains of an exposure that goes up and down by a fraction from frame to frame."""
    return 1 + fraction * (-1.0) ** np.arange(count)


def steps(count: int) -> Doubles:
    """Return gains of an exposure that steps up by a quarter, down by a third, and back."""
    return np.repeat([1.0, 1.25, 0.67, 1.0], -(-count // 4))[:count]


def drift(count: int) -> Doubles:
    """Return gains (frames, 3) of an exposure that drifts by a quarter, and of a white balance that goes with it."""
    along = np.linspace(0, 1, count)
    return np.stack([1 + 0.25 * along, 1 + 0.1 * along, 1 - 0.1 * along], 1)


def flash(count: int) -> Doubles:
    """Return gains of a clip with one frame three times as bright."""
    gains = np.ones(count)
    gains[count // 2] = 3
    return gains
