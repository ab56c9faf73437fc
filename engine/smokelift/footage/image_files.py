"""Picture files as linear light in BT.709, arrays [row, column, rgb]; how files and videos encode light and alpha.

Integer pictures (PNG, JPEG, TIFF, DPX) are sRGB unless said otherwise, EXR and HDR are linear. A gray picture gets
three equal channels. Diffuse white is 1: BT.2408 puts it at 75 % of the signal in HLG and at 203 cd/m2 in PQ.
Highlights exceed 1. Alpha is shown over black: EXR colors are premultiplied in linear light, by the format's rule.

Integer pixels with an alpha channel hold their colors by one of three conventions, distinguished by the pixels.
Straight colors are the smoke's own. Premultiplied ones are over black: multiplied by alpha in linear light and then
encoded, or encoded and then multiplied, as most compositing programs do. Formats do not say which, or say it wrongly:
PNG is straight by its specification, and programs write all three. The right one makes the smoke's own color vary
least: how much light smoke sends depends on how much smoke there is, its color does not. That is a fit of one color to
each convention, so nothing has to be set.
"""

import io
import os
import re
import struct
import sys
import warnings
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager, redirect_stderr, redirect_stdout
from fractions import Fraction
from functools import lru_cache, partial
from pathlib import Path
from typing import Any, Literal, get_args

import av
import numpy as np
import numpy.typing as npt
import OpenEXR
from av.container import InputContainer
from PIL import Image, ImageOps, TiffImagePlugin

from smokelift.checks import Array
from smokelift.footage.images import Codes, Picture, look_up, srgb_to_linear
from smokelift.scene import LARGEST_PICTURE

Encoding = Literal["srgb", "linear", "hlg", "pq"]

Association = Literal["straight", "premultiplied in linear light", "premultiplied in code values"]

Decoder = Callable[[npt.ArrayLike], Array]
"""What makes encoded values linear."""

ENCODINGS: Mapping[int, Encoding] = {8: "linear", 16: "pq", 18: "hlg"}
"""Encodings by transfer characteristics (ITU-T H.273); all others are read as sRGB, as screens do."""

PRIMARIES = {
    5: ("BT.601 (625 lines)", ((0.640, 0.330), (0.290, 0.600), (0.150, 0.060))),
    6: ("BT.601 (525 lines)", ((0.630, 0.340), (0.310, 0.595), (0.155, 0.070))),
    7: ("SMPTE 240M", ((0.630, 0.340), (0.310, 0.595), (0.155, 0.070))),
    9: ("BT.2020", ((0.708, 0.292), (0.170, 0.797), (0.131, 0.046))),
    12: ("Display P3", ((0.680, 0.320), (0.265, 0.690), (0.150, 0.060))),
}
"""Primaries other than BT.709, all with a D65 white (ITU-T H.273): name, and chromaticities of red, green and blue."""

Layer = tuple[Picture, Picture | None]
"""A linear picture (rows, columns, 3) over black, and its alpha (rows, columns), None if it is opaque."""

Transfer = Literal["srgb", "linear"]

FOREIGN_ERRORS = (
    av.FFmpegError,
    RuntimeError,
    ValueError,
    LookupError,
    SyntaxError,
    struct.error,
    OSError,
    Image.DecompressionBombError,
)
"""What the libraries that read pictures raise for a damaged one."""

MAX_PIXELS = 2**28
"""Largest number of pixels of a picture."""

MAX_PICTURE_SIDE = 4096
"""Longest side of a clip's pictures, in pixels; larger ones are reduced when read."""

OPENING_BYTES = 2**25
"""Memory in bytes that FFmpeg needs to open a file: its decoders' contexts, and some frames to know them by."""

MIN_STRAIGHT_RATIO, MIN_VARIATION = 4.0, 0.01
"""Smallest ratio of the own color's variance if premultiplied to that if straight, from which an EXR may be straight:
ten elements have .1 to 1.2, one that was saved straight 19 (measured). And the least of the latter."""

MAX_STRAIGHT_VARIATION = 0.6
"""Largest variance of straight colors over all pixels, over the squared mean: shaded smoke has .03 to .5. A flame over
thin alpha, whose premultiplied color exceeds alpha, has .8 and more, since nothing shines beside it (measured)."""

READABLE = (".png", ".jpg", ".jpeg", ".tif", ".tiff", ".dpx", ".exr", ".hdr")

LOG_BYTE, LOG_TRANSFERS = 801, (1, 3)
"""Place in a DPX of its first element's transfer characteristic, and those that are printing density and logarithmic
(SMPTE ST 268-1). All others are read as sRGB: programs write linear (2) for what is only not logarithmic."""

BEAUTY = ("combined", "beauty", "rgba")
"""Names, in small letters, that renderers give to the part or the layer with the picture: Blender, Arnold, Redshift."""

DEPTHS = ("Z", "ZBack")
"""Names that OpenEXR gives to depths."""


def hlg_to_linear(signal: npt.ArrayLike) -> Array:
    """Decode hybrid log-gamma (BT.2100, inverse OETF: light at the camera, not on a screen)."""
    a, b, c = 0.17883277, 0.28466892, 0.55991073

    def scene(values: npt.NDArray[np.float64]) -> npt.NDArray[np.float64]:
        return np.where(values <= 0.5, values**2 / 3, (np.exp((np.maximum(values, 0.5) - c) / a) + b) / 12)

    e = np.maximum(np.asarray(signal, np.float64), 0.0)
    return np.asarray(scene(e) / scene(np.array(0.75)), np.float32)  # reference white (BT.2408)


def pq_to_linear(signal: npt.ArrayLike) -> Array:
    """Decode the perceptual quantizer (BT.2100 and SMPTE ST 2084, EOTF)."""
    m1, m2, c1, c2, c3 = 2610 / 16384, 2523 / 4096 * 128, 3424 / 4096, 2413 / 4096 * 32, 2392 / 4096 * 32
    e = np.maximum(np.asarray(signal, np.float64), 0.0) ** (1 / m2)
    shown = (np.maximum(e - c1, 0.0) / (c2 - c3 * e)) ** (1 / m1)
    return np.asarray(shown / (203 / 10_000), np.float32)  # reference white of 203 cd/m2 (BT.2408)


DECODERS: Mapping[Encoding, Decoder] = {
    "linear": partial(np.asarray, dtype=np.float32),
    "srgb": srgb_to_linear,
    "hlg": hlg_to_linear,
    "pq": pq_to_linear,
}


def to_bt709(linear: Array, primaries: int) -> Array:
    """Convert linear colors [row, column, rgb] to BT.709; colors outside it are clipped at 0."""
    if primaries not in PRIMARIES:
        return linear
    bt709 = _to_xyz(((0.640, 0.330), (0.300, 0.600), (0.150, 0.060)))
    matrix = np.linalg.solve(bt709, _to_xyz(PRIMARIES[primaries][1])).astype(np.float32)
    return np.asarray(np.maximum(linear @ matrix.T, np.float32(0.0)))


def _to_xyz(chromaticities: tuple[tuple[float, float], ...]) -> npt.NDArray[np.float64]:
    """The matrix from RGB with a D65 white to CIE XYZ (SMPTE RP 177)."""
    points = (*chromaticities, (0.3127, 0.3290))
    red, green, blue, white = (np.array([x / y, 1.0, (1 - x - y) / y]) for x, y in points)
    columns = np.stack([red, green, blue], axis=1)
    return np.asarray(columns * np.linalg.solve(columns, white))


def association(pictures: Iterable[npt.NDArray[Any]], decode: Decoder) -> Association:
    """Return how pictures (rows, columns, rgba) of encoded values, with 1 as white, hold their colors.

    ``decode`` makes values linear. Opaque pictures are straight.
    """
    kinds: tuple[Association, ...] = get_args(Association)
    # rounding alone makes opaque pictures differ
    return kinds[int(np.argmin(_variations(pictures, decode)[: len(kinds)].round(6)))]


def may_be_straight(pictures: Iterable[npt.NDArray[Any]]) -> bool:
    """Whether linear pictures (rows, columns, rgba), premultiplied by their format, are more likely straight."""
    straight, premultiplied, _, evenly = _variations(pictures, DECODERS["linear"]) - 1
    return bool(premultiplied > MIN_STRAIGHT_RATIO * max(straight, MIN_VARIATION) and evenly < MAX_STRAIGHT_VARIATION)


def _variations(pictures: Iterable[npt.NDArray[Any]], decode: Decoder) -> Array:
    """Mean square of the smoke's own color over the squared mean, by each convention; see `association`.

    Last is that of what is stored, with the same weight for each pixel, however thin its smoke.
    """
    sums = np.zeros((3, 1 + len(get_args(Association))))
    for picture in pictures:
        shown = picture[picture[..., 3] > 0]
        encoded, alpha = shown[:, :3].max(-1), shown[:, 3]
        linear = decode(encoded)
        with np.errstate(all="ignore"):  # curves of HDR have no value far above white
            colors = np.stack([linear, linear / alpha, decode(encoded / alpha)], -1).astype(np.float64)
            # errors of premultiplied values are divided by alpha, too
            weights = np.square(alpha, dtype=np.float64)
            sums[:, :-1] += [np.full(3, weights.sum()), weights @ colors, weights @ colors**2]
            sums[:, -1] += [len(colors), colors[:, 0].sum(), np.square(colors[:, 0]).sum()]
    total, first, second = sums
    with np.errstate(all="ignore"):
        variations: Array = np.nan_to_num(second * total / first**2, nan=np.inf)
    return variations


class ImageError(ValueError):
    """A picture that cannot be read or written."""


class PictureKindError(ImageError):
    """A sound picture of a kind that is not read, as all of its sequence are."""


def decode(codes: Codes, encoding: Encoding, white: float = 1.0, held: Association = "straight") -> Layer:
    """Return integer pixels [row, column, rgb or rgba] of 8 or 16 bits as linear RGB over black, and their alpha.

    ``white`` is the fraction of the largest code that means white, and opaque.
    ``held`` says how colors are held beside alpha.
    """
    linear = code_values(np.iinfo(codes.dtype).max, encoding, white)
    if codes.shape[-1] < 4:
        return look_up(linear, codes), None
    encoded = encoded_values(codes, white)
    alpha = np.minimum(encoded[..., 3], np.float32(1.0))
    opacity = alpha[..., None]
    if held == "premultiplied in code values":
        over_black = encoded[..., :3]
        own = np.minimum(np.divide(over_black, opacity, out=np.zeros_like(over_black), where=opacity > 0), 1)
        return DECODERS[encoding](own) * opacity, alpha
    picture = look_up(linear, codes[..., :3])
    return picture * opacity if held == "straight" else picture, alpha


@lru_cache
def code_values(top: int, encoding: Encoding = "srgb", white: float = 1.0) -> Picture:
    """Return the linear values of the codes 0 to ``top``, read-only; see `decode`."""
    values = DECODERS[encoding](np.arange(top + 1, dtype=np.float32) / np.float32(top * white))
    values.flags.writeable = False
    return values


def read_image(path: str | Path, transfer: Transfer | None = None) -> Picture:
    """Read a file of one of the `READABLE` kinds, by its suffix, as a linear picture (height, width, 3).

    Without a ``transfer``, integer pixels are sRGB, those of EXR and HDR linear. Of an EXR, the display window is read.
    ImageError, with the path, is raised if there is no such file, or it is damaged; PictureKindError if it is of
    another kind.
    """
    return read_layer(path, transfer)[0]


def read_layer(path: str | Path, transfer: Transfer | None = None) -> Layer:
    """Read a file as `read_image` does, and its alpha (height, width), from 0 to 1, if it has one."""
    return linear_layer(read_stored(Path(path)), transfer)


def linear_layer(stored: Codes | Layer, transfer: Transfer | None, held: Association = "straight") -> Layer:
    """Return what `read_stored` has read as `read_layer` does; ``held`` is how integers hold colors beside alpha."""
    if not isinstance(stored, tuple):
        return decode(stored, transfer or "srgb", held=held)
    values, alpha = stored
    return srgb_to_linear(values) if transfer == "srgb" else values, alpha


def encoded_values(codes: Codes, white: float = 1.0) -> Picture:
    """Return integer pixels as the values that they encode, with 1 as white; ``white`` as of `decode`."""
    return np.asarray(codes / np.float32(np.iinfo(codes.dtype).max * white))


def read_stored(path: Path) -> Codes | Layer:
    """Read the integer pixels of a file; the linear ones, and alpha, of an EXR or HDR. Errors are `read_image`'s."""
    suffix = path.suffix.lower()
    if suffix not in READABLE:
        raise PictureKindError(f"{path}: is none of {', '.join(READABLE)}; save it as one of these")
    if not path.is_file():
        raise ImageError(f"{path}: no such file")
    try:
        if suffix == ".exr":
            return _read_exr(path)
        if suffix == ".hdr":
            return _read_radiance(path), None
        with warnings.catch_warnings(action="ignore"):  # what Pillow warns of, it reads or raises an error for
            return _read_integers(path)
    except ImageError:
        raise
    # libraries raise exceptions of their own that mean the same to the caller
    except FOREIGN_ERRORS as error:
        raise ImageError(f"{path}: cannot be read: {' '.join(str(error).split())}") from error


def readable_size(width: int | Fraction, height: int) -> tuple[int, int]:
    """Return the width and height to read a clip's pictures at: divided by a whole number to fit `MAX_PICTURE_SIDE`."""
    divisor = -(-max(round(width), height) // MAX_PICTURE_SIDE)
    return max(1, round(width / divisor)), max(1, round(height / divisor))


def require_size(path: Path, size: tuple[int, int], error: type[ValueError] = ImageError) -> None:
    """Refuse a picture of its header's width and height before memory is taken for it."""
    width, height = size
    if not (0 < width <= LARGEST_PICTURE and 0 < height <= LARGEST_PICTURE and width * height <= MAX_PIXELS):
        raise error(
            f"{path}: cannot be read: its header says {width} x {height} pixels; a picture has 1 to {LARGEST_PICTURE} "
            f"along a side and {MAX_PIXELS} in all at most"
        )


def open_container(path: Path, form: str | None = None, **options: str) -> InputContainer:
    """Open a file with FFmpeg, and what it refers to on this machine, but nothing on another.

    FFmpeg would take a path that looks like a URL for one, and fetch it. ``form`` is FFmpeg's name of the format, by
    default what the content shows; ``options`` are that format's. av.FFmpegError or ValueError is raised if the file is
    damaged or of no format that FFmpeg knows, MemoryError if memory is nearly full, where PyAV would end the process.
    """
    bytes(OPENING_BYTES)  # freed at once, untouched: Python raises an error if memory lacks, PyAV does not
    container: InputContainer = av.open(
        f"file:{path.absolute()}", format=form, options={"protocol_whitelist": "file", **options}
    )
    return container


def _read_with_ffmpeg(path: Path, pixels: str | None = None) -> npt.NDArray[Any]:
    """Decode a picture to pixels of FFmpeg's name, by default RGB and alpha of 8 or 16 bits, as far as it has them."""
    # as a pattern, "frame_%d.png" would mean other files
    with open_container(path, "image2", pattern_type="none") as container:
        stream = container.streams.video[0]
        require_size(path, (stream.width, stream.height))
        frame = next(container.decode(stream))
        parts = frame.format.components
        alpha = "a" * any(part.is_alpha for part in parts)
        wide = max(part.bits for part in parts) > 8
        return frame.to_ndarray(
            format=pixels or (f"rgb{alpha}{64 if alpha else 48}le" if wide else f"rgb{alpha or 24}")
        )


def _read_radiance(path: Path) -> npt.NDArray[Any]:
    """Read a Radiance .hdr of the usual kind; FFmpeg reads the others upside down or in wrong colors."""
    with path.open("rb") as file:
        head = file.read(4096)
    if b"FORMAT=32-bit_rle_xyze" in head or re.search(rb"\n(\+Y|[+-]X) \d+ [+-][XY] \d+\n|\n-Y \d+ -X \d+\n", head):
        raise ImageError(f"{path}: is turned, mirrored or in XYZ colors; save it as an ordinary .hdr, or as .exr")
    return _read_with_ffmpeg(path, "gbrpf32le")


def _read_integers(path: Path) -> Codes:
    with path.open("rb") as file:
        head = file.read(LOG_BYTE + 1)
    if head.startswith((b"SDPX", b"XPDS")) and head[LOG_BYTE] in LOG_TRANSFERS:
        raise PictureKindError(
            f"{path}: holds the densities of film or a camera's log values, of which there are many kinds; save it "
            "as .exr, or as .png"
        )
    if head[:4] in (b"II*\0", b"MM\0*"):
        by_ffmpeg = _is_plain_tiff(path, head)
    else:
        by_ffmpeg = head.startswith((b"SDPX", b"XPDS")) or (head.startswith(b"\x89PNG") and head[24] == 16)
    if by_ffmpeg:
        return _read_with_ffmpeg(path)  # Pillow would cut 16 bit color to 8
    with Image.open(path) as picture:
        require_size(path, picture.size)
        upright = ImageOps.exif_transpose(picture)
        return np.asarray(upright.convert("RGBA" if upright.has_transparency_data else "RGB"))


def _is_plain_tiff(path: Path, head: bytes) -> bool:
    """Whether FFmpeg reads a TIFF, which it does with the alpha that is stored, and Pillow without."""
    tags = TiffImagePlugin.ImageFileDirectory_v2(head[:8])
    with path.open("rb") as file:
        file.seek(tags.next)
        tags.load(file)
    photometric, tiled = tags.get(TiffImagePlugin.PHOTOMETRIC_INTERPRETATION), TiffImagePlugin.TILEWIDTH in tags
    gray_or_rgb = photometric in (1, 2) and not tiled
    wide = max(tags.get(TiffImagePlugin.BITSPERSAMPLE, (1,))) > 8
    floating = 3 in tags.get(TiffImagePlugin.SAMPLEFORMAT, ())  # TIFF 6.0, section 19
    if floating or (wide and not gray_or_rgb):
        raise PictureKindError(
            f"{path}: is neither gray nor RGB in whole numbers, or is stored in tiles; save it as .exr, or as an "
            "ordinary TIFF of 8 or 16 bits"
        )
    return gray_or_rgb


@contextmanager
def silenced() -> Iterator[None]:
    """Silence what a library writes to standard output and error, which may carry JSON; its errors are exceptions."""
    for stream in (sys.stdout, sys.stderr):
        stream.flush()
    kept = [os.dup(number) for number in (1, 2)]
    try:
        with Path(os.devnull).open("wb") as nowhere:
            for number in (1, 2):
                os.dup2(nowhere.fileno(), number)
        # Python's streams need not be those two: a notebook or a test has put others in their place
        with redirect_stdout(io.StringIO()), redirect_stderr(io.StringIO()):
            yield
    finally:
        for number, copy in zip((1, 2), kept, strict=True):
            os.dup2(copy, number)
            os.close(copy)


def _read_exr(path: Path) -> Layer:
    with silenced():
        headers = OpenEXR.File(str(path), header_only=True).parts
    for part in headers:
        for name in ("displayWindow", "dataWindow"):
            require_size(path, _window(part, name)[1])
    with silenced():
        parts = OpenEXR.File(str(path), separate_channels=True).parts
    if not parts:  # so the library reports damaged pixels
        raise ImageError(f"{path}: cannot be read: it is truncated or damaged")
    part, colors = _exr_colors(path, parts)
    ((left, top), (width, height)), ((x0, y0), _) = (_window(part, name) for name in ("displayWindow", "dataWindow"))
    image = np.zeros((height, width, 4), np.float32)
    opacity = [f"{_layer_of(colors[0])}A"] if f"{_layer_of(colors[0])}A" in part.channels else []
    for channel, name in enumerate((*colors, *opacity)):
        pixels = part.channels[name].pixels[max(0, top - y0) :, max(0, left - x0) :]
        target = image[max(0, y0 - top) :, max(0, x0 - left) :, channel]
        rows, columns = np.minimum(target.shape, pixels.shape)
        target[:rows, :columns] = pixels[:rows, :columns]
    alpha = np.clip(np.nan_to_num(image[..., 3]), 0.0, 1.0) if opacity else None
    return np.ascontiguousarray(image[..., :3]), alpha


def _window(part: Any, name: str) -> tuple[tuple[int, int], tuple[int, int]]:
    """The left and top, and the width and height, of an EXR's window."""
    (left, top), (right, bottom) = (map(int, corner) for corner in part.header[name])
    return (left, top), (right - left + 1, bottom - top + 1)


def _exr_colors(path: Path, parts: Sequence[Any]) -> tuple[Any, tuple[str, str, str]]:
    """Choose the part, and in it red, green and blue: plain ones, else those of a `BEAUTY` pass, else the first.

    Where no part has them, it is gray: luminance, or all that there is if that is no depth.
    """
    named = [(part, name) for part in parts for name in part.channels]

    def rank(found: tuple[Any, str]) -> tuple[bool, bool, bool]:
        part, layer = found
        whole = f"{part.name() or ''}.{layer}".strip(".").lower()
        return whole != "", whole.rpartition(".")[2] not in BEAUTY, layer != ""

    for part, layer in sorted(((part, _layer_of(name)) for part, name in named), key=rank):
        red, green, blue = (f"{layer}{channel}" for channel in "RGB")
        if {red, green, blue} <= set(part.channels):
            return part, (red, green, blue)
    for part, name in named:
        # a normal or a motion has X and Y
        luminance = name == f"{_layer_of(name)}Y" and f"{_layer_of(name)}X" not in part.channels
        if luminance or (len(named) == 1 and name.rpartition(".")[2] not in DEPTHS):
            return part, (name, name, name)
    listed = ", ".join(dict.fromkeys(name for _, name in named))
    raise PictureKindError(
        f"{path}: holds neither RGB nor Y channels, but {listed}; choose the file with the beauty pass, or render it"
    )


def _layer_of(channel: str) -> str:
    """The layer of an EXR's channel with its dot, empty if it has none."""
    return "".join(channel.rpartition(".")[:2])
