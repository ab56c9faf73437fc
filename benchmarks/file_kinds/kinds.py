"""The files, by what is unusual about them; each function makes one in a folder and says what is known of it."""

import shutil
from collections.abc import Callable, Mapping
from fractions import Fraction
from pathlib import Path
from typing import Any

import av
import numpy as np
import numpy.typing as npt
import OpenEXR
from PIL import Image

from benchmarks.file_kinds.film import (
    BT709,
    BT2020,
    FPS,
    FRAMES,
    eight_bits,
    encode,
    film,
    hlg_signal,
    smoke,
    to_bt2020,
    wide,
)
from benchmarks.file_kinds.judge import Kind
from benchmarks.stability.mutations import damaged_bytes
from smokelift.footage.images import linear_to_srgb, srgb_to_linear

Make = Callable[[Path], Kind]


def kinds(damaged: int = 4) -> Mapping[str, Mapping[str, Make]]:
    """Return all files by group and name; so many with random damage of each container."""
    return {
        "shape": _shapes(),
        "time": _times(),
        "colour": _colours(),
        "alpha": _alphas(),
        "container and codec": _containers(),
        "name": _names(),
        "pictures": _pictures(),
        "broken": _broken(),
        "random damage": _damage(damaged),
    }


def _video(name: str = "a.mp4", slack: float = 1.0, **how: Any) -> Make:
    """The film in a video file."""

    def make(folder: Path) -> Kind:
        path = encode(folder / name, eight_bits(film()), **how)
        return Kind(path, film(), slack, fps=float(how.get("rate", FPS)))

    return make


def _sized(width: int, height: int, slack: float = 1.0, name: str = "a.mp4", **how: Any) -> Make:
    def make(folder: Path) -> Kind:
        shown = film(width, height)
        return Kind(encode(folder / name, eight_bits(shown), **how), shown, slack)

    return make


def _shapes() -> dict[str, Make]:
    def turned(degrees: int) -> Make:
        def make(folder: Path) -> Kind:
            stored = np.rot90(film(), -degrees // 90, (1, 2))
            return Kind(encode(folder / "a.mp4", eight_bits(stored), rotation=degrees), film())

        return make

    def anamorphic(shape: Fraction, degrees: int = 0) -> Make:
        def make(folder: Path) -> Kind:
            shown = film(round(96 * shape), 64)
            stored = film(96, 64)
            if degrees:
                shown, stored = film(64, round(96 * shape)), np.rot90(film(64, 96), -degrees // 90, (1, 2))
            path = encode(folder / "a.mp4", eight_bits(stored), rotation=degrees, sample_aspect_ratio=shape)
            return Kind(path, shown, 2.0)

        return make

    def huge(folder: Path) -> Kind:
        large = np.stack([np.kron(picture, np.ones((60, 60, 1), np.uint8)) for picture in eight_bits(film(96, 54, 3))])
        path = encode(folder / "a.avi", large, "mjpeg", "yuvj420p", options={"qmin": "1", "qmax": "2"})
        shown = np.kron(film(96, 54, 3), np.ones((1, 30, 30, 1), np.float32))
        return Kind(path, shown, 2.5)

    interlaced = {"qp": "0", "x264-params": "tff=1"}
    fields = {"flags": "+ildct+ilme", "qmin": "1", "qmax": "2"}

    def woven(folder: Path) -> Kind:
        """Fifty fields a second: the odd lines of a frame are of half a frame later."""
        fields = film(96, 64, 2 * FRAMES)
        frames = fields[::2].copy()
        frames[:, 1::2] = fields[1::2, 1::2]
        return Kind(encode(folder / "a.mp4", eight_bits(frames), options=interlaced), fields[::2], 2.0)

    return {
        "portrait": _sized(64, 96),
        "odd sides": _sized(95, 63),
        "odd sides, 4:2:0": _sized(95, 63, 2.0, "a.mkv", codec="ffv1", pixels="yuv420p"),
        "very wide": _sized(640, 32),
        "16 x 16 pixels": _sized(16, 16),
        "5760 x 3240": huge,
        **{f"turned by {degrees}": turned(degrees) for degrees in (90, 180, -90)},
        "pixels 2:1": anamorphic(Fraction(2)),
        "pixels 16:15 (DV)": anamorphic(Fraction(16, 15)),
        "pixels 3:4": anamorphic(Fraction(3, 4)),
        "pixels 4:3, turned": anamorphic(Fraction(4, 3), 90),
        "interlaced H.264": woven,
        "interlaced, still": _video(slack=2.0, options=interlaced),
        "interlaced MPEG-2": _video(
            "a.mpg",
            3.0,
            codec="mpeg2video",
            pixels="yuv420p",
            options=fields,
        ),
    }


def _times() -> dict[str, Make]:
    def timed(times: list[int], shown: list[int], fps: float, name: str = "a.mp4", **options: str) -> Make:
        def make(folder: Path) -> Kind:
            how = {"qp": "0", "bf": "0", **options}
            path = encode(folder / name, eight_bits(film()), times=times, options=how)
            return Kind(path, film()[shown], fps=fps)

        return make

    def rate(value: Fraction | int) -> Make:
        def make(folder: Path) -> Kind:
            return Kind(encode(folder / "a.mp4", eight_bits(film()), rate=value), film(), fps=float(value))

        return make

    def few(count: int) -> Make:
        def make(folder: Path) -> Kind:
            shown = film()[-count:]
            return Kind(encode(folder / "a.mp4", eight_bits(shown)), shown, works=None)

        return make

    even = [10 * n for n in range(FRAMES)]
    order = list(range(FRAMES))
    # the second half lasts four times as long a frame as the first
    varying = [0, 10, 20, 30, 40, 80, 120, 160]
    mean = 160 / 7
    on_show = [max(k for k, t in enumerate(varying) if t <= n * mean + 0.5) for n in order]
    return {
        "varying rate": timed(varying, on_show, 240 / mean),
        "varying rate, Matroska": timed(varying, on_show, 240 / mean, "a.mkv"),
        "first frame at 5 s": timed([1200 + t for t in even], order, 24.0),
        "B-frames, open groups": timed(even, order, 24.0, bf="3", g="4", x264opts="open-gop=1"),
        "23.976 frames a second": rate(Fraction(24000, 1001)),
        "240 frames a second": rate(240),
        "no times (raw H.264)": _video("a.h264", options={"qp": "0"}, rate=25),
        "one frame": few(1),
        "two frames": few(2),
    }


def _colours() -> dict[str, Make]:
    def depth(pixels: str, codec: str = "ffv1", given: str = "rgb24", slack: float = 1.5) -> Make:
        return _video("a.mkv", slack, codec=codec, pixels=pixels, given=given)

    def light(transfer: int, primaries: int, bits: int = 10) -> Make:
        """Pictures that are below white, in another encoding, by the formulas of BT.2100 and BT.2087."""

        def make(folder: Path) -> Kind:
            linear = np.maximum(srgb_to_linear(film()).astype(np.float64), 0)
            if primaries == 9:
                linear = to_bt2020(linear)
            if transfer == 18:
                signal = hlg_signal(linear)
            elif transfer == 16:
                power = (linear * 203 / 10000) ** 0.1593017578125
                signal = ((0.8359375 + 18.8515625 * power) / (1 + 18.6875 * power)) ** 78.84375
            else:
                signal = linear if transfer == 8 else np.asarray(linear_to_srgb(linear), np.float64)
            space, matrix = (9, BT2020) if primaries == 9 else (1, BT709)
            tags = {"color_trc": transfer, "color_primaries": primaries, "colorspace": space, "color_range": 1}
            return Kind(wide(folder / "a.mkv", signal.astype(np.float32), bits, matrix, **tags), film(), 1.0)

        return make

    def grey(pixels: str) -> Make:
        def make(folder: Path) -> Kind:
            one = film()[..., 1]
            path = encode(folder / "a.mkv", eight_bits(one), "ffv1", pixels, given="gray")
            return Kind(path, np.repeat(one[..., None], 3, -1), 1.5)

        return make

    return {
        "BT.601": _video(colorspace=5),
        "BT.709": _video(colorspace=1),
        "BT.2020, 8 bit": _video(colorspace=9, slack=1.5),
        "full range": _video(color_range=2, slack=3.0, pixels="yuvj444p"),
        "BT.709, 10 bit": light(1, 1),
        "BT.709, 12 bit": light(1, 1, 12),
        "BT.2020, 10 bit": light(14, 9),
        "HLG BT.2020, 10 bit": light(18, 9),
        "HLG BT.2020, 12 bit": light(18, 9, 12),
        "PQ BT.2020, 10 bit": light(16, 9),
        "PQ BT.2020, 12 bit": light(16, 9, 12),
        "linear, 12 bit": light(8, 1, 12),
        "10 bit HEVC": _video("a.mp4", codec="libx265", pixels="yuv420p10le", slack=2.0),
        "10 bit ProRes 422": _video("a.mov", codec="prores_ks", pixels="yuv422p10le", slack=2.0),
        "8 bit RGB": depth("bgr0"),
        "12 bit RGB": depth("gbrp12le"),
        "grey, 8 bit": grey("gray"),
        "grey, 10 bit": grey("gray10le"),
        "grey, 16 bit": grey("gray16le"),
        "palette (GIF)": _video("a.gif", 16.0, codec="gif", pixels="rgb8", rate=25),
    }


def _shown(straight: npt.NDArray[np.float32], behind: float) -> npt.NDArray[np.float32]:
    alpha = straight[..., 3:]
    return np.asarray(linear_to_srgb(srgb_to_linear(straight[..., :3]) * alpha + (1 - alpha) * behind), np.float32)


def _alphas() -> dict[str, Make]:
    def made(name: str, codec: str, pixels: str, slack: float = 1.0, grey: float = 0.35, **how: Any) -> Make:
        def make(folder: Path) -> Kind:
            path = encode(folder / name, eight_bits(smoke(grey)), codec, pixels, given="rgba", **how)
            return Kind(path, _shown(smoke(grey), float(grey < 0.5)), slack)

        return make

    def premultiplied(grey: float) -> Make:
        """Multiplied in linear light."""

        def make(folder: Path) -> Kind:
            stored = np.concatenate([_shown(smoke(grey), 0), smoke(grey)[..., 3:]], -1)
            path = encode(folder / "a.mov", eight_bits(stored), "png", "rgba", given="rgba")
            return Kind(path, _shown(smoke(grey), float(grey < 0.5)), 1.5)

        return make

    def pictures(folder: Path) -> Kind:
        for n, picture in enumerate(eight_bits(smoke())):
            Image.fromarray(picture).save(folder / f"smoke_{n:03d}.png")
        return Kind(folder / "smoke_###.png", _shown(smoke(), 1))

    def exr(folder: Path) -> Kind:
        header = {"compression": OpenEXR.ZIP_COMPRESSION, "type": OpenEXR.scanlineimage}
        for n, picture in enumerate(smoke()):
            rgb = srgb_to_linear(picture[..., :3]) * picture[..., 3:]
            OpenEXR.File(header, {"RGBA": np.dstack([rgb, picture[..., 3]])}).write(str(folder / f"a{n}.exr"))
        return Kind(folder / "a#.exr", _shown(smoke(), 1))

    def opaque(folder: Path) -> Kind:
        stored = np.concatenate([film(), np.ones_like(film()[..., :1])], -1)
        return Kind(encode(folder / "a.mov", eight_bits(stored), "png", "rgba", given="rgba"), film())

    return {
        "straight, Animation": made("a.mov", "qtrle", "argb"),
        "straight, bright smoke": made("a.mov", "qtrle", "argb", grey=0.8),
        "straight, ProRes 4444": made("a.mov", "prores_ks", "yuva444p10le", 2.0),
        "straight, FFV1 4:2:0": made("a.mkv", "ffv1", "yuva420p", 1.5),
        "straight, PNG pictures": pictures,
        "premultiplied, dark smoke": premultiplied(0.35),
        "premultiplied, bright smoke": premultiplied(0.8),
        "premultiplied, EXR pictures": exr,
        "VP9 in WebM": made("a.webm", "libvpx-vp9", "yuva420p", 2.0, options={"lossless": "1"}),
        "VP8 in WebM": made("a.webm", "libvpx", "yuva420p", 4.0, options={"crf": "4", "b": "8M", "auto-alt-ref": "0"}),
        "opaque": opaque,
    }


def _containers() -> dict[str, Make]:
    best = {"qmin": "1", "qmax": "2"}
    small = {"codec": "mpeg4", "pixels": "yuv420p", "options": best}
    return {
        "Matroska": _video("a.mkv"),
        "QuickTime": _video("a.mov"),
        "AVI": _video("a.avi", 3.0, **small),
        "WebM, VP8": _video("a.webm", 4.0, codec="libvpx", pixels="yuv420p", options={"crf": "4", "b": "8M"}),
        "WebM, VP9": _video("a.webm", 2.0, codec="libvpx-vp9", pixels="yuv420p", options={"lossless": "1"}),
        "MP4, AV1": _video("a.mp4", 4.0, codec="libsvtav1", pixels="yuv420p", options={"crf": "5"}),
        "transport stream": _video("a.ts"),
        "MPEG-2": _video("a.mpg", 3.0, codec="mpeg2video", pixels="yuv420p", options=best),
        "MXF": _video("a.mxf", 3.0, codec="mpeg2video", pixels="yuv420p", options=best, rate=25),
        "Flash": _video("a.flv", 3.0, codec="flv", pixels="yuv420p", options=best),
        "WMV": _video("a.wmv", 3.0, codec="wmv2", pixels="yuv420p", options=best),
        "Motion JPEG": _video("a.avi", 3.0, codec="mjpeg", pixels="yuvj444p", options=best),
        "fragmented MP4": _video("a.mp4", muxer={"movflags": "frag_keyframe+empty_moov"}),
        "raw video in NUT": _video("a.nut", codec="rawvideo", pixels="rgb24"),
    }


def _names() -> dict[str, Make]:
    def named(name: str) -> Make:
        def make(folder: Path) -> Kind:
            made = encode(folder / "made.mp4", eight_bits(film()))
            path = folder / name
            path.parent.mkdir(parents=True, exist_ok=True)
            return Kind(made.rename(path), film())

        return make

    def sequence(stem: str) -> Make:
        def make(folder: Path) -> Kind:
            (folder / stem).parent.mkdir(parents=True, exist_ok=True)
            for n, picture in enumerate(eight_bits(film())):
                Image.fromarray(picture).save(folder / f"{stem}{n:02d}.png")
            return Kind(folder / f"{stem}##.png", film())

        return make

    clips = ("50% #1 smoke.mp4", "a b  c.mp4", "%03d.mp4", "Дым.mp4", "烟雾 #2.mp4", "دخان.mp4", "💨.mp4", "-i.mp4",
             "it's \"it\".mp4", "http:/host/clip.mp4", "UPPER.MP4", "no suffix", "an mp4.avi", "a\nb.mp4",
             "l" * 200 + ".mp4")  # fmt: skip
    return {
        **{f"`{ascii(name)[1:-1][:40]}`": named(name) for name in clips},
        "pictures `50% Дым_##.png`": sequence("50% Дым_"),
        "pictures in a folder `#1 %d`": sequence("#1 %d/a_"),
    }


def _pictures() -> dict[str, Make]:
    def saved(suffix: str, mode: str = "RGB", slack: float = 1.0, fps: float = 24, **how: Any) -> Make:
        def make(folder: Path) -> Kind:
            for n, picture in enumerate(eight_bits(film())):
                Image.fromarray(picture).convert(mode).save(folder / f"f{n:04d}{suffix}", **how)
            shown = film()
            if mode in ("L", "I;16"):
                shown = np.repeat((film() @ np.array([0.299, 0.587, 0.114], np.float32))[..., None], 3, -1)
            return Kind(folder / f"f0000{suffix}", shown, slack)

        return make

    def exif(folder: Path) -> Kind:
        tags = Image.Exif()
        tags[0x0112] = 6  # turn by 90 degrees clockwise to show
        for n, picture in enumerate(eight_bits(np.rot90(film(), 1, (1, 2)))):
            Image.fromarray(picture).save(folder / f"f{n}.jpg", quality=98, subsampling=0, exif=tags)
        return Kind(folder / "f#.jpg", film(), 2.0)

    def exr(folder: Path) -> Kind:
        for n, picture in enumerate(srgb_to_linear(film())):
            header = {"compression": OpenEXR.PIZ_COMPRESSION, "type": OpenEXR.scanlineimage}
            OpenEXR.File(header, {"RGB": picture.astype(np.float16)}).write(str(folder / f"f{n}.exr"))
        return Kind(folder / "f#.exr", film())

    def sixteen(folder: Path) -> Kind:
        wide_codes = np.clip(film() * 65535 + 0.5, 0, 65535).astype(np.uint16)
        for n, picture in enumerate(wide_codes):
            frame = av.VideoFrame.from_ndarray(picture, format="rgb48le").reformat(format="rgb48be")
            context: Any = av.CodecContext.create("png", "w")
            context.width, context.height, context.pix_fmt, context.time_base = 96, 64, "rgb48be", Fraction(1, 24)
            data = b"".join(bytes(packet) for packet in [*context.encode(frame), *context.encode(None)])
            (folder / f"f{n}.png").write_bytes(data)
        return Kind(folder / "f#.png", film())

    def holes(folder: Path) -> Kind:
        kind = saved(".png")(folder)
        (folder / "f0003.png").unlink()
        (folder / "f0005.png").write_bytes(b"")
        return Kind(kind.path, film()[[0, 1, 2, 2, 4, 4, 6, 7]])

    def digits(folder: Path) -> Kind:
        for n, picture in enumerate(eight_bits(film())):
            Image.fromarray(picture).save(folder / f"f{n + 5}.png")
        return Kind(folder / "f#.png", film())

    def sizes(folder: Path) -> Kind:
        kind = saved(".png")(folder)
        Image.new("RGB", (32, 32)).save(folder / "f0004.png")
        return Kind(kind.path, works=False)

    def stray(folder: Path) -> Kind:
        kind = saved(".png")(folder)
        shutil.copy(folder / "f0004.png", folder / "f9999.png")
        return Kind(kind.path, works=False)

    return {
        "PNG, 8 bit": saved(".png"),
        "PNG, 16 bit": sixteen,
        "PNG, grey": saved(".png", "L", 1.5),
        "PNG, palette": saved(".png", "P", 18.0),
        "JPEG": saved(".jpg", slack=2.0, quality=98, subsampling=0),
        "JPEG, CMYK": saved(".jpg", "CMYK", 2.5, quality=98),
        "JPEG, turned by EXIF": exif,
        "EXR, half": exr,
        "a hole and an empty file": holes,
        "numbers grow from 5 to 12": digits,
        "one picture of another size": sizes,
        "a stray picture far behind": stray,
    }


def _broken() -> dict[str, Make]:
    def bytes_of(content: bytes, name: str = "a.mp4") -> Make:
        def make(folder: Path) -> Kind:
            (folder / name).write_bytes(content)
            return Kind(folder / name, works=False)

        return make

    def cut(name: str, share: float, works: bool, front: bool = False) -> Make:
        def make(folder: Path) -> Kind:
            muxer = {"movflags": "faststart"} if front else {}
            many = np.concatenate([film(), film()[::-1]])
            path = encode(folder / name, eight_bits(many), options={"crf": "10", "g": "4"}, muxer=muxer)
            content = path.read_bytes()
            path.write_bytes(content[: int(share * len(content))])
            return Kind(path, works=works)

        return make

    def sound(folder: Path) -> Kind:
        with av.open(str(folder / "a.mp4"), "w") as out:
            stream = out.add_stream("aac", rate=44100)
            frame = av.AudioFrame.from_ndarray(np.zeros((1, 1024), np.float32), format="fltp", layout="mono")
            frame.sample_rate = 44100
            out.mux(stream.encode(frame))
            out.mux(stream.encode())
        return Kind(folder / "a.mp4", works=False)

    def dropped(numbers: tuple[int, ...]) -> Make:
        """Some coded pictures are zeros; each picture stands by itself."""

        def make(folder: Path) -> Kind:
            path = encode(folder / "a.mov", eight_bits(film()), "png", "rgb24")
            with av.open(str(path)) as container:
                places = [(packet.pos or 0, packet.size) for packet in container.demux(video=0) if packet.size]
            content = bytearray(path.read_bytes())
            for n in numbers:
                place, size = places[n]
                content[place : place + size] = bytes(size)
            path.write_bytes(content)
            shown = [max((m for m in range(n + 1) if m not in numbers), default=1) for n in range(FRAMES)]
            mostly = 2 * len(numbers) > FRAMES
            return Kind(path, None if mostly else film()[shown], works=not mostly)

        return make

    def grows(folder: Path) -> Kind:
        parts = [
            encode(folder / f"{width}.ts", eight_bits(film(width)), "mpeg2video", "yuv420p") for width in (96, 128)
        ]
        (folder / "a.ts").write_bytes(b"".join(part.read_bytes() for part in parts))
        return Kind(folder / "a.ts", works=None)

    def folder_itself(folder: Path) -> Kind:
        return Kind(folder, works=False)

    def lies(folder: Path) -> Kind:
        path = encode(folder / "a.avi", eight_bits(film()), "rawvideo", "bgr24")
        content = bytearray(path.read_bytes())
        at = content.index(b"strf") + 12  # width and height of the picture
        content[at : at + 8] = (30_000).to_bytes(4, "little") * 2
        path.write_bytes(content)
        return Kind(path, works=False)

    return {
        "no file": lambda folder: Kind(folder / "a.mp4", works=False),
        "empty": bytes_of(b""),
        "text": bytes_of(b"This is not a film.\n" * 99),
        "zeros": bytes_of(bytes(9999)),
        "a list of addresses": bytes_of(b"#EXTM3U\n#EXTINF:9,\nhttp://127.0.0.1/a.ts\n", "a.m3u8"),
        "a folder": folder_itself,
        "sound only": sound,
        "MP4 without its index": cut("a.mp4", 0.6, works=False),
        "MP4, cut at 60 %": cut("a.mp4", 0.6, works=True, front=True),
        "Matroska, cut at 60 %": cut("a.mkv", 0.6, works=True),
        "transport stream, cut at 60 %": cut("a.ts", 0.6, works=True),
        "MP4, cut at 300 bytes": cut("a.mp4", 0.01, works=False, front=True),
        "one frame zeroed": dropped((4,)),
        "first frame zeroed": dropped((0,)),
        "three frames zeroed": dropped((2, 3, 6)),
        "six frames of eight zeroed": dropped((1, 2, 3, 4, 5, 6)),
        "size changes": grows,
        "says it is 30000 x 30000": lies,
    }


def _damage(count: int) -> dict[str, Make]:
    def made(name: str, number: int, **how: Any) -> Make:
        def make(folder: Path) -> Kind:
            random = np.random.default_rng([number, *name.encode()])
            path = encode(folder / name, eight_bits(film()), **how)
            path.write_bytes(damaged_bytes(path.read_bytes(), random))
            return Kind(path, works=None)

        return make

    best = {"qmin": "1", "qmax": "4"}
    files: dict[str, dict[str, Any]] = {
        "a.mp4": {"options": {"crf": "20", "g": "4"}},
        "a.mkv": {"options": {"crf": "20", "g": "4"}},
        "a.ts": {"options": {"crf": "20", "g": "4"}},
        "a.h264": {"options": {"crf": "20", "g": "4"}},
        "a.webm": {"codec": "libvpx-vp9", "pixels": "yuv420p"},
        "a.mov": {"codec": "prores_ks", "pixels": "yuv422p10le"},
        "a.avi": {"codec": "mjpeg", "pixels": "yuvj420p", "options": best},
        "a.mpg": {"codec": "mpeg2video", "pixels": "yuv420p", "options": best},
        "a.gif": {"codec": "gif", "pixels": "rgb8"},
    }
    return {f"{name}, {number}": made(name, number, **how) for name, how in files.items() for number in range(count)}
