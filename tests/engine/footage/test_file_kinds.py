"""Clips of unusual kinds, as a camera, a phone, a renderer or an accident makes them: read as they were encoded."""

import shutil
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from fractions import Fraction
from pathlib import Path
from typing import Any

import av
import numpy as np
import numpy.typing as npt
import OpenEXR
import pytest
from PIL import Image

from smokelift.footage.clip import Clip
from smokelift.footage.frame_source import ClipError
from smokelift.footage.images import linear_to_srgb, srgb_to_linear

Pictures = npt.NDArray[np.float32]
"""sRGB values from 0 to 1, (frames, rows, columns, 3)."""

FRAMES = 8
FPS = 24

BT709, BT2020 = (0.2126, 0.0722), (0.2627, 0.0593)
"""Weights of red and blue in luma."""


def film(width: int = 96, height: int = 64, frames: int = FRAMES) -> Pictures:
    """Gray smoke that rises before a wall with a red patch at the top left and a blue one at the top right."""
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


def smoke(gray: float = 0.35, width: int = 96, height: int = 64, frames: int = FRAMES) -> npt.NDArray[np.float32]:
    """Straight sRGB values and opacity, (frames, rows, columns, 4), of smoke alone."""
    y, x = np.mgrid[:height, :width] + 0.5
    shown = []
    for n in range(frames):
        share = (n + 0.5) / frames
        distance = np.hypot((x - width / 2) / (0.16 * width), (y - height * (0.9 - 0.6 * share)) / (0.2 * height))
        opacity = 0.8 * np.clip(1.3 - distance, 0, 1)
        shown.append(np.dstack([np.full((height, width, 3), gray), opacity]))
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
    rotation: int = 0,
    muxer: dict[str, str] | None = None,
    **tags: Any,
) -> Path:
    """Write 8 bit pictures with FFmpeg; tags are attributes of the codec's context, times are in 1/240 s."""
    lossless = {"libx264": {"qp": "0"}, "libx265": {"x265-params": "lossless=1:log-level=none"}}
    space = tags.get("colorspace")
    with av.open(f"file:{path.absolute()}", "w", options=muxer or {}) as out:
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
    """Bring linear colors [..., rgb] from BT.709 to BT.2020 (BT.2087)."""
    matrix = np.array([[0.6274, 0.3293, 0.0433], [0.0691, 0.9195, 0.0114], [0.0164, 0.0880, 0.8956]])
    return np.asarray(linear @ matrix.T)


def hlg_signal(linear: npt.NDArray[Any]) -> npt.NDArray[Any]:
    """Encode linear light, diffuse white at 1, as hybrid log-gamma (BT.2100)."""
    scene = linear * 0.26496  # of the peak: white is at 75 % of the signal
    high = 0.17883277 * np.log(np.maximum(12 * scene - 0.28466892, 1e-9)) + 0.55991073
    return np.where(scene <= 1 / 12, np.sqrt(3 * np.maximum(scene, 0)), high)


@dataclass(frozen=True, eq=False)
class Kind:
    """A file, and what is known of it.

    Attributes
    ----------
    path
        The clip's.
    shown : (frames, rows, columns, 3)
        sRGB values as they have to be read.
    slack
        Mean difference that the encoding may leave, in steps of 8 bits.
    fps
        Frames a second.
    """

    path: Path
    shown: Pictures
    slack: float = 1.0
    fps: float = FPS


def encoded(folder: Path, **how: Any) -> Path:
    """The film in a video file."""
    return encode(folder / how.pop("name", "a.mp4"), eight_bits(film()), **how)


def anamorphic(folder: Path, shape: Fraction, degrees: int = 0) -> Kind:
    """A film whose pixels are no squares, and which may be turned."""
    shown, stored = film(round(96 * shape), 64), film(96, 64)
    if degrees:
        shown, stored = film(64, round(96 * shape)), np.rot90(film(64, 96), -degrees // 90, (1, 2))
    path = encode(folder / "a.mp4", eight_bits(stored), rotation=degrees, sample_aspect_ratio=shape)
    return Kind(path, shown, 2.0)


def interlaced(folder: Path) -> Kind:
    """Fifty fields a second: the odd lines of a frame are of half a frame later."""
    fields = film(96, 64, 2 * FRAMES)
    frames = fields[::2].copy()
    frames[:, 1::2] = fields[1::2, 1::2]
    how = {"qp": "0", "x264-params": "tff=1"}
    return Kind(encode(folder / "a.mp4", eight_bits(frames), options=how), fields[::2], 2.0)


EVEN, ORDER = [10 * n for n in range(FRAMES)], list(range(FRAMES))
VARYING = [0, 10, 20, 30, 40, 80, 120, 160]
"""Times in 1/240 s: the second half lasts four times as long a frame as the first."""


def timed(folder: Path, times: list[int], shown: list[int], fps: float, name: str = "a.mp4", **options: str) -> Kind:
    """A film whose frames come at given times."""
    return Kind(
        encoded(folder, name=name, times=times, options={"qp": "0", "bf": "0", **options}), film()[shown], 1, fps
    )


def varying(folder: Path) -> Kind:
    """A rate that changes; it is read at the mean rate, each frame being the last that has come."""
    mean = VARYING[-1] / (FRAMES - 1)
    on_show = [max(k for k, t in enumerate(VARYING) if t <= n * mean + 0.5) for n in ORDER]
    return timed(folder, VARYING, on_show, 240 / mean, "a.mkv")


def light(folder: Path, transfer: int, primaries: int, bits: int) -> Kind:
    """Pictures that are below white, in another encoding, by the formulas of BT.2100 and BT.2087."""
    linear = np.maximum(srgb_to_linear(film()).astype(np.float64), 0)
    if primaries == 9:
        linear = to_bt2020(linear)
    if transfer == 18:
        signal = hlg_signal(linear)
    elif transfer == 16:
        power = (linear * 203 / 10000) ** 0.1593017578125
        signal = ((0.8359375 + 18.8515625 * power) / (1 + 18.6875 * power)) ** 78.84375
    else:
        signal = np.asarray(linear_to_srgb(linear), np.float64)
    space, matrix = (9, BT2020) if primaries == 9 else (1, BT709)
    tags = {"color_trc": transfer, "color_primaries": primaries, "colorspace": space, "color_range": 1}
    return Kind(wide(folder / "a.mkv", signal.astype(np.float32), bits, matrix, **tags), film())


def gray(folder: Path) -> Kind:
    """One channel of ten bits."""
    one = film()[..., 1]
    path = encode(folder / "a.mkv", eight_bits(one), "ffv1", "gray10le", given="gray")
    return Kind(path, np.repeat(one[..., None], 3, -1), 1.5)


def over_white() -> Pictures:
    """Dark smoke that is seen over white, sRGB."""
    alpha = smoke()[..., 3:]
    return np.asarray(linear_to_srgb(srgb_to_linear(smoke()[..., :3]) * alpha + 1 - alpha), np.float32)


def premultiplied(folder: Path) -> Kind:
    """EXR pictures whose colors are multiplied with their alpha."""
    header = {"compression": OpenEXR.ZIP_COMPRESSION, "type": OpenEXR.scanlineimage}
    for n, picture in enumerate(smoke()):
        rgb = srgb_to_linear(picture[..., :3]) * picture[..., 3:]
        OpenEXR.File(header, {"RGBA": np.dstack([rgb, picture[..., 3]])}).write(str(folder / f"a{n}.exr"))
    return Kind(folder / "a#.exr", over_white())


def sixteen(folder: Path) -> Kind:
    """PNG pictures of sixteen bits."""
    for n, picture in enumerate(np.clip(film() * 65535 + 0.5, 0, 65535).astype(np.uint16)):
        frame = av.VideoFrame.from_ndarray(picture, format="rgb48le").reformat(format="rgb48be")
        context: Any = av.CodecContext.create("png", "w")
        context.width, context.height, context.pix_fmt, context.time_base = 96, 64, "rgb48be", Fraction(1, 24)
        data = b"".join(bytes(packet) for packet in [*context.encode(frame), *context.encode(None)])
        (folder / f"f{n}.png").write_bytes(data)
    return Kind(folder / "f#.png", film())


def exif(folder: Path) -> Kind:
    """JPEG pictures that lie on their side and say so."""
    tags = Image.Exif()
    tags[0x0112] = 6  # turn by 90 degrees clockwise to show
    for n, picture in enumerate(eight_bits(np.rot90(film(), 1, (1, 2)))):
        Image.fromarray(picture).save(folder / f"f{n}.jpg", quality=98, subsampling=0, exif=tags)
    return Kind(folder / "f#.jpg", film(), 2.0)


def pictures(folder: Path) -> Path:
    """The film as PNG pictures."""
    for n, picture in enumerate(eight_bits(film())):
        Image.fromarray(picture).save(folder / f"f{n:04d}.png")
    return folder / "f0000.png"


def holes(folder: Path) -> Kind:
    """Pictures of which one is missing and one is empty."""
    path = pictures(folder)
    (folder / "f0003.png").unlink()
    (folder / "f0005.png").write_bytes(b"")
    return Kind(path, film()[[0, 1, 2, 2, 4, 4, 6, 7]])


def dropped(folder: Path, numbers: Sequence[int]) -> Path:
    """A film of which some coded pictures are zeros; each stands by itself."""
    path = encoded(folder, name="a.mov", codec="png", pixels="rgb24")
    with av.open(str(path)) as container:
        places = [(packet.pos or 0, packet.size) for packet in container.demux(video=0) if packet.size]
    content = bytearray(path.read_bytes())
    for n in numbers:
        place, size = places[n]
        content[place : place + size] = bytes(size)
    path.write_bytes(content)
    return path


MPEG2 = {"codec": "mpeg2video", "pixels": "yuv420p", "options": {"qmin": "1", "qmax": "2"}}

READ: dict[str, Callable[[Path], Kind]] = {
    "odd sides, 4:2:0": lambda folder: Kind(
        encode(folder / "a.mkv", eight_bits(film(95, 63)), "ffv1", "yuv420p"), film(95, 63), 2.0
    ),
    "turned by 90": lambda folder: Kind(
        encode(folder / "a.mp4", eight_bits(np.rot90(film(), -1, (1, 2))), rotation=90), film()
    ),
    "pixels 16:15 (DV)": lambda folder: anamorphic(folder, Fraction(16, 15)),
    "pixels 4:3, turned": lambda folder: anamorphic(folder, Fraction(4, 3), 90),
    "interlaced H.264": interlaced,
    "varying rate, Matroska": varying,
    "first frame at 5 s": lambda folder: timed(folder, [1200 + t for t in EVEN], ORDER, 24.0),
    "B-frames, open groups": lambda folder: timed(folder, EVEN, ORDER, 24.0, bf="3", g="4", x264opts="open-gop=1"),
    "BT.2020, 8 bit": lambda folder: Kind(encoded(folder, colorspace=9), film(), 1.5),
    "full range": lambda folder: Kind(encoded(folder, color_range=2, pixels="yuvj444p"), film(), 3.0),
    "BT.709, 12 bit": lambda folder: light(folder, 1, 1, 12),
    "HLG BT.2020, 10 bit": lambda folder: light(folder, 18, 9, 10),
    "PQ BT.2020, 12 bit": lambda folder: light(folder, 16, 9, 12),
    "gray, 10 bit": gray,
    "straight alpha, ProRes 4444": lambda folder: Kind(
        encode(folder / "a.mov", eight_bits(smoke()), "prores_ks", "yuva444p10le", given="rgba"), over_white(), 2.0
    ),
    "premultiplied alpha, EXR pictures": premultiplied,
    "MPEG-2": lambda folder: Kind(encoded(folder, name="a.mpg", **MPEG2), film(), 3.0),
    "a name with signs": lambda folder: Kind(encoded(folder, name="50% #1 smoke.mp4"), film()),
    "PNG, 16 bit": sixteen,
    "JPEG, turned by EXIF": exif,
    "a hole and an empty file": holes,
    "three frames zeroed": lambda folder: Kind(dropped(folder, (2, 3, 6)), film()[[0, 1, 1, 1, 4, 5, 5, 7]]),
}
"""Files that are read, by what is unusual about them."""


def another_size(folder: Path) -> Path:
    """Pictures of which one has another size."""
    path = pictures(folder)
    Image.new("RGB", (32, 32)).save(folder / "f0004.png")
    return path


def stray(folder: Path) -> Path:
    """Pictures with one far behind the others."""
    path = pictures(folder)
    shutil.copy(folder / "f0004.png", folder / "f9999.png")
    return path


def sound(folder: Path) -> Path:
    """A file without pictures."""
    with av.open(str(folder / "a.mp4"), "w") as out:
        stream = out.add_stream("aac", rate=44100)
        frame = av.AudioFrame.from_ndarray(np.zeros((1, 1024), np.float32), format="fltp", layout="mono")
        frame.sample_rate = 44100
        out.mux(stream.encode(frame))
        out.mux(stream.encode())
    return folder / "a.mp4"


def cut(folder: Path) -> Path:
    """A video of which the first hundredth is left."""
    path = encoded(folder, options={"crf": "10", "g": "4"}, muxer={"movflags": "faststart"})
    path.write_bytes(path.read_bytes()[:300])
    return path


def lies(folder: Path) -> Path:
    """A small video that says it is 30000 x 30000."""
    path = encoded(folder, name="a.avi", codec="rawvideo", pixels="bgr24")
    content = bytearray(path.read_bytes())
    at = content.index(b"strf") + 12  # width and height of the picture
    content[at : at + 8] = (30_000).to_bytes(4, "little") * 2
    path.write_bytes(content)
    return path


REFUSED: dict[str, Callable[[Path], Path]] = {
    "a stray picture far behind": stray,
    "one picture of another size": another_size,
    "sound only": sound,
    "cut at 300 bytes": cut,
    "six frames of eight zeroed": lambda folder: dropped(folder, range(1, 7)),
    "says it is 30000 x 30000": lies,
}
"""Files that are refused."""


@pytest.mark.parametrize("name", READ)
def test_a_clip_is_read_as_it_was_encoded(tmp_path: Path, name: str) -> None:
    kind = READ[name](tmp_path)
    with Clip.open(kind.path, fps=None) as clip:
        assert clip.fps == pytest.approx(kind.fps, rel=0.01)
        found = linear_to_srgb(np.stack(list(clip)))
    assert found.shape == kind.shown.shape
    assert 255 * np.abs(found - kind.shown).mean((1, 2, 3)).max() <= kind.slack


@pytest.mark.parametrize("name", REFUSED)
def test_a_clip_that_cannot_be_used_is_refused_in_a_sentence(tmp_path: Path, name: str) -> None:
    path = REFUSED[name](tmp_path)
    with pytest.raises(ClipError, match=r"^\S*: ") as refused, Clip.open(path) as clip:
        for _ in clip:
            pass
    assert "\n" not in str(refused.value)
