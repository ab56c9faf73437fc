"""Clips of all kinds, as a camera, a phone, a renderer or an accident makes them: read as they were encoded."""

import shutil
from collections.abc import Callable
from dataclasses import dataclass
from fractions import Fraction
from functools import partial
from pathlib import Path
from typing import Any

import av
import numpy as np
import numpy.typing as npt
import pytest
from PIL import Image

from smokelift.footage.clip import Clip
from smokelift.footage.frame_source import ClipError
from smokelift.footage.images import linear_to_srgb, srgb_to_linear
from tests.engine.films import blanked, encode, encode_sound, write_exr

Pictures = npt.NDArray[np.float32]
"""sRGB values from 0 to 1, (frames, rows, columns, 3)."""

FRAMES = 8
FPS = 24

BT709, BT2020 = (0.2126, 0.0722), (0.2627, 0.0593)
"""Weights of red and blue in luma."""


def opacity(width: int, height: int, frames: int) -> npt.NDArray[Any]:
    """The opacity (frames, rows, columns, 1) of a puff that rises."""
    y, x = np.mgrid[:height, :width] + 0.5
    rise = ((np.arange(frames) + 0.5) / frames)[:, None, None]
    distance = np.hypot((x - width / 2) / (0.16 * width), (y - height * (0.9 - 0.6 * rise)) / (0.2 * height))
    return 0.8 * np.clip(1.3 - distance, 0, 1)[..., None]


def film(width: int = 96, height: int = 64, frames: int = FRAMES) -> Pictures:
    """Gray smoke that rises before a wall with a red patch at the top left and a blue one at the top right."""
    y, x = np.mgrid[:height, :width] + 0.5
    wall = 0.3 + 0.1 * np.sin(x / width * 19)[..., None] * np.sin(y / height * 13)[..., None] * np.ones(3)
    patch = (y < height / 4)[..., None]
    wall = np.where(patch & (x < width / 5)[..., None], [0.6, 0.2, 0.2], wall)
    wall = np.where(patch & (x > 0.8 * width)[..., None], [0.2, 0.2, 0.6], wall)
    alpha = opacity(width, height, frames)
    return np.asarray(linear_to_srgb(srgb_to_linear(wall) * (1 - alpha) + 0.55 * alpha), np.float32)


def eight_bits(values: npt.NDArray[Any]) -> npt.NDArray[np.uint8]:
    """Values from 0 to 1 as a file of 8 bits holds them."""
    return np.clip(values * 255 + 0.5, 0, 255).astype(np.uint8)


@dataclass(frozen=True, eq=False)
class Kind:
    """A file; the sRGB values (frames, rows, columns, 3) that it has to be read as, up to a mean difference in steps of
    8 bits that the encoding may leave; the kinds of its findings, and its frames per second.
    """

    path: Path
    shown: Pictures
    slack: float = 1.0
    said: tuple[str, ...] = ()
    fps: float = FPS


STILLS = ("pictures without a frame rate",)
SCALED = ("scaled pictures",)


def encoded(folder: Path, name: str = "a.mp4", codec: str = "libx264", pixels: str = "yuv444p", **how: Any) -> Path:
    """The film in a video file."""
    return encode(folder / name, eight_bits(film()), codec, pixels, **how)


def kind(
    name: str, codec: str, pixels: str, slack: float = 1.0, fps: float = FPS, **how: Any
) -> Callable[[Path], Kind]:
    """The film in a container, by a codec."""
    return lambda folder: Kind(encoded(folder, name, codec, pixels, **how), film(), slack, fps=fps)


def odd_sides(folder: Path) -> Kind:
    return Kind(encode(folder / "a.mkv", eight_bits(film(95, 63)), "ffv1", "yuv420p"), film(95, 63), 2.0)


def turned(folder: Path, degrees: int) -> Kind:
    """A film that is stored turned, and says by how much."""
    stored = np.rot90(eight_bits(film()), -degrees // 90, (1, 2))
    return Kind(encode(folder / "a.mp4", stored, pixels="yuv444p", rotation=degrees), film())


def anamorphic(folder: Path, shape: Fraction, degrees: int = 0) -> Kind:
    """A film whose pixels are no squares, and which may be turned."""
    shown, stored = film(round(96 * shape), 64), film(96, 64)
    if degrees:
        shown, stored = film(64, round(96 * shape)), np.rot90(film(64, 96), -degrees // 90, (1, 2))
    path = encode(folder / "a.mp4", eight_bits(stored), pixels="yuv444p", rotation=degrees, sample_aspect_ratio=shape)
    return Kind(path, shown, 2.0, SCALED)


def interlaced(folder: Path) -> Kind:
    """Fifty fields a second: the odd lines of a frame are of half a frame later."""
    fields = film(96, 64, 2 * FRAMES)
    frames = fields[::2].copy()
    frames[:, 1::2] = fields[1::2, 1::2]
    path = encode(folder / "a.mp4", eight_bits(frames), pixels="yuv444p", options={"x264-params": "tff=1"})
    return Kind(path, fields[::2], 2.0, ("interlaced clip",))


EVEN, ORDER = [10 * n for n in range(FRAMES)], list(range(FRAMES))
VARYING = [0, 10, 20, 30, 40, 80, 120, 160]
"""Times in 1/240 s: the second half lasts four times as long a frame as the first."""


def varying(folder: Path) -> Kind:
    """A rate that changes; it is read at the mean rate, each frame being the last that has come."""
    mean = VARYING[-1] / (FRAMES - 1)
    on_show = [max(k for k, t in enumerate(VARYING) if t <= n * mean + 0.5) for n in ORDER]
    path = encoded(folder, "a.mkv", times=VARYING, options={"bf": "0"})
    return Kind(path, film()[on_show], 1, ("varying frame rate",), 240 / mean)


def signal(path: Path, values: npt.NDArray[Any], bits: int, matrix: tuple[float, float] = BT709, **tags: int) -> Path:
    """Write signals (frames, rows, columns, rgb) as lossless 4:4:4 luma and chroma, by their exact formulas."""
    limited, step = tags.get("color_range", 1) == 1, 2 ** (bits - 8)
    (black, span), chroma_span = ((16, 219), 224) if limited else ((0, 255), 255)
    red, blue = matrix
    with av.open(str(path), "w") as out:
        stream: Any = out.add_stream("ffv1", rate=FPS)
        stream.height, stream.width = values.shape[1:3]
        stream.pix_fmt = f"yuv444p{bits}le" if bits > 8 else "yuv444p"
        for name, value in tags.items():
            setattr(stream.codec_context, name, value)
        for n, picture in enumerate(values.astype(np.float64)):
            luma = picture @ [red, 1 - red - blue, blue]
            chroma = [(picture[..., 2] - luma) / (2 - 2 * blue), (picture[..., 0] - luma) / (2 - 2 * red)]
            frame = av.VideoFrame(stream.width, stream.height, stream.pix_fmt)
            for plane, code in zip(
                frame.planes, [black + span * luma, *(128 + chroma_span * c for c in chroma)], strict=True
            ):
                kind = np.uint16 if bits > 8 else np.uint8
                rows = np.zeros((stream.height, plane.line_size // np.dtype(kind).itemsize), kind)
                rows[:, : stream.width] = np.clip(code * step + 0.5, 0, 256 * step - 1)
                plane.update(rows.tobytes())
            frame.pts = n
            out.mux(stream.encode(frame))
        out.mux(stream.encode())
    return path


def light(folder: Path, transfer: int, primaries: int, bits: int) -> Kind:
    """Pictures that are below white, in another encoding, by the formulas of BT.2100 and BT.2087."""
    linear = np.maximum(srgb_to_linear(film()).astype(np.float64), 0)
    if primaries == 9:
        linear = linear @ np.transpose([[0.6274, 0.3293, 0.0433], [0.0691, 0.9195, 0.0114], [0.0164, 0.0880, 0.8956]])
    scene = linear * 0.26496  # of the peak: white is at 75 % of the signal
    power = (linear * 203 / 10000) ** 0.1593017578125
    high = 0.17883277 * np.log(np.maximum(12 * scene - 0.28466892, 1e-9)) + 0.55991073
    values = {
        1: linear_to_srgb(linear),
        8: linear,
        16: ((0.8359375 + 18.8515625 * power) / (1 + 18.6875 * power)) ** 78.84375,
        18: np.where(scene <= 1 / 12, np.sqrt(3 * np.maximum(scene, 0)), high),
    }[transfer]
    space, matrix = (9, BT2020) if primaries == 9 else (1, BT709)
    tags = {"color_trc": transfer, "color_primaries": primaries, "colorspace": space, "color_range": 1}
    said = ("other primaries",) * (primaries == 9) + ("high dynamic range",) * (transfer in (16, 18))
    return Kind(signal(folder / "a.mkv", values, bits, matrix, **tags), film(), 1.0, said)


def gray(folder: Path) -> Kind:
    """One channel of ten bits."""
    one = film()[..., 1:2].repeat(3, -1)
    return Kind(encode(folder / "a.mkv", eight_bits(one), "ffv1", "gray10le"), one, 1.5)


def straight(folder: Path) -> Kind:
    """Dark smoke with its alpha, which is seen over white."""
    alpha = opacity(96, 64, FRAMES)
    pictures = eight_bits(np.concatenate([np.full((*alpha.shape[:3], 3), 0.35), alpha], -1))
    shown = linear_to_srgb(srgb_to_linear(0.35) * alpha + 1 - alpha).repeat(3, -1)
    return Kind(encode(folder / "a.mov", pictures, "prores_ks", "yuva444p10le"), shown, 2.0)


def jpeg(folder: Path) -> Kind:
    """Pictures that lie on their side and say so."""
    tags = Image.Exif()
    tags[0x0112] = 6  # turn by 90 degrees clockwise to show
    for n, picture in enumerate(eight_bits(np.rot90(film(), 1, (1, 2)))):
        Image.fromarray(picture).save(folder / f"f{n}.jpg", quality=98, subsampling=0, exif=tags)
    return Kind(folder / "f#.jpg", film(), 2.0, STILLS)


def pictures(folder: Path) -> Path:
    """The film as PNG pictures."""
    for n, picture in enumerate(eight_bits(film())):
        Image.fromarray(picture).save(folder / f"f{n:04d}.png")
    return folder / "f0000.png"


READ: dict[str, Callable[[Path], Kind]] = {
    "H.264, Matroska": kind("a.mkv", "libx264", "yuv420p", 2),
    "H.264, MPEG-TS": kind("a.ts", "libx264", "yuv420p", 2),
    "H.264 without a container": kind("a.h264", "libx264", "yuv420p", 2, fps=25),
    "ProRes": kind("a.mov", "prores_ks", "yuv422p10le", 2),
    "MPEG-4, AVI": kind("a.avi", "mpeg4", "yuv420p", 5),
    "MPEG-2": kind("a.mpg", "mpeg2video", "yuv420p", 3, options={"qmin": "1", "qmax": "2"}),
    "VP9": kind("a.webm", "libvpx-vp9", "yuv420p", 4),
    "GIF": kind("a.gif", "gif", "rgb8", 20),
    "odd sides, 4:2:0": odd_sides,
    **{f"turned by {degrees}": partial(turned, degrees=degrees) for degrees in (90, 180, -90)},
    "pixels 16:15 (DV)": partial(anamorphic, shape=Fraction(16, 15)),
    "pixels 3:4": partial(anamorphic, shape=Fraction(3, 4)),
    "pixels 4:3, turned": partial(anamorphic, shape=Fraction(4, 3), degrees=90),
    "interlaced H.264": interlaced,
    "varying rate, Matroska": varying,
    **{
        f"first frame at 5 s, {name}": kind(name, "libx264", "yuv444p", times=[1200 + t for t in EVEN])
        for name in ("a.mp4", "a.mkv")
    },
    "B-frames, open groups": kind(
        "a.mp4", "libx264", "yuv444p", times=EVEN, options={"bf": "3", "g": "4", "x264opts": "open-gop=1"}
    ),
    **{f"color matrix {code}": kind("a.mp4", "libx264", "yuv444p", 1.5, colorspace=code) for code in (1, 5, 9)},
    "full range": kind("a.mp4", "libx264", "yuvj444p", 3, color_range=2),
    "BT.709, 12 bit": partial(light, transfer=1, primaries=1, bits=12),
    "HLG BT.2020, 10 bit": partial(light, transfer=18, primaries=9, bits=10),
    "PQ BT.2020, 12 bit": partial(light, transfer=16, primaries=9, bits=12),
    "linear, 12 bit": partial(light, transfer=8, primaries=1, bits=12),
    "gray, 10 bit": gray,
    "straight alpha, ProRes 4444": straight,
    "a name with signs": kind("50% #1 smoke.mp4", "libx264", "yuv444p"),
    "JPEG, turned by EXIF": jpeg,
}
"""Files that are read, by what is unusual about them."""


@pytest.mark.parametrize("name", READ)
def test_a_clip_is_read_as_it_was_encoded(tmp_path, name) -> None:
    """In the order of its frames and in any other."""
    kind = READ[name](tmp_path)
    with Clip.open(kind.path) as clip:
        assert clip.fps == pytest.approx(kind.fps, rel=0.01)
        read = np.stack(list(clip))
        assert {finding.kind for finding in clip.findings()} == set(kind.said)
    found = linear_to_srgb(read)
    assert found.shape == kind.shown.shape
    assert 255 * np.abs(found - kind.shown).mean((1, 2, 3)).max() <= kind.slack
    with Clip.open(kind.path) as clip:
        for n in [*np.random.default_rng(0).permutation(FRAMES).tolist(), FRAMES - 1, 0, 5, 6, 5]:
            np.testing.assert_array_equal(clip.frame(n), read[n])


@pytest.mark.parametrize("limited", [True, False])
def test_rounding_is_unbiased(tmp_path, limited) -> None:
    """Of all codes of luma, in both ranges."""
    codes = np.arange(16, 236, dtype=np.float64)
    values = (codes - 16) / 219 if limited else codes / 255
    path = signal(
        tmp_path / "a.mkv", values[None, None, :, None].repeat(4, 1).repeat(3, -1), 8, color_range=2 - limited
    )
    found = linear_to_srgb(Clip.open(path).frame(0)[2, :, 1])
    assert 255 * np.abs(found - values).max() < 0.51
    assert 255 * abs(np.mean(found - values)) < 0.05


# files that are refused


def written(name: str, content: bytes = b"") -> Callable[[Path], Path]:
    def write(folder: Path) -> Path:
        (folder / name).write_bytes(content)
        return folder / name

    return write


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


def cut(folder: Path, left: float, front: bool = False) -> Path:
    """A video of which a part is left, whose index is at its front or else at its end."""
    path = encoded(folder, options={"crf": "10", "g": "4"}, muxer={"movflags": "faststart"} if front else None)
    content = path.read_bytes()
    path.write_bytes(content[: int(left * len(content))])
    return path


def lies(folder: Path) -> Path:
    """A small video that says it is 30000 x 30000."""
    path = encoded(folder, "a.avi", "rawvideo", "bgr24")
    content = bytearray(path.read_bytes())
    at = content.index(b"strf") + 12  # width and height of the picture
    content[at : at + 8] = (30_000).to_bytes(4, "little") * 2
    path.write_bytes(content)
    return path


def depth(folder: Path) -> Path:
    """Pictures of a kind that is not read, which is no damage."""
    for n in range(4):
        write_exr(folder / f"z{n}.exr", {"Z": np.ones((16, 32), np.float32)})
    return folder / "z#.exr"


REFUSED: dict[str, tuple[Callable[[Path], Path], str]] = {
    "none": (lambda folder: folder / "a.mp4", "no such file"),
    "a folder": (lambda folder: folder, "is a folder"),
    "an empty file": (written("a.mp4"), "is empty"),
    "no video": (written("a.mp4", bytes(range(256)) * 40), "is not a video"),
    "one byte": (written("a.mp4", b"x"), "is not a video"),
    "boxes that are no video's": (written("a.mp4", b"\0\0\0\x08free" * 3), "is not a video"),
    "sound only": (lambda folder: encode_sound(folder / "a.mp4"), "no video stream"),
    "a stray picture far behind": (stray, "f0008.*missing"),
    "no numbered pictures": (lambda folder: folder / "f####.png", "no such files"),
    "pictures of two numbers": (lambda folder: pictures(folder).with_name("#_##.png"), "no such files"),
    "a number that is not there": (lambda folder: pictures(folder).with_name("f0009.png"), "no such file"),
    "a star for numbers": (
        lambda folder: pictures(folder).with_name("f*.png"),
        r"give numbered pictures as frame_####\.png",
    ),
    "a format for numbers": (lambda folder: folder / "f%04d.png", r"give numbered pictures as frame_####\.png"),
    "one picture of another size": (another_size, "32 x 32 pixels.* 96 x 64"),
    "pictures of depth": (depth, "z0.*holds neither RGB nor Y channels, but Z"),
    "pictures of Windows": (lambda folder: written("b0.bmp")(folder).with_name("b#.bmp"), "is none of"),
    "a recording that was cut short": (partial(cut, left=0.2), "breaks off"),
    "a recording that was cut later": (partial(cut, left=0.6), "breaks off"),
    "an index of which a half is left": (partial(cut, left=0.05, front=True), "breaks off"),
    "six frames of eight zeroed": (
        lambda folder: blanked(encoded(folder, "a.mov", "png", "rgb24"), range(1, 7)),  # each stands by itself
        "6 of its 8 frames",
    ),
    "says it is 30000 x 30000": (lies, "its header says"),
}
"""Files that are refused, and why."""


@pytest.mark.parametrize("name", REFUSED)
def test_a_clip_that_cannot_be_used_is_refused_in_a_sentence(tmp_path, name) -> None:
    make, why = REFUSED[name]
    path = make(tmp_path)
    with pytest.raises(ClipError, match=rf"^\S*: .*{why}|^\S*{why}") as refused, Clip.open(path) as clip:
        for _ in clip:
            pass
    assert "\n" not in str(refused.value) and str(refused.value).startswith(str(tmp_path))
