"""Single pictures as linear float32 arrays [row, column, rgb], row 0 at the top.

Integer pictures (PNG, JPEG, TIFF, DPX) are sRGB unless said otherwise, EXR and HDR are linear. A gray picture gets
three equal channels. Alpha is shown over black: EXR colors are premultiplied in linear light, by the format's rule;
those of integer pictures are read by one of the three conventions of `color`.
"""

import io
import os
import re
import struct
import sys
import warnings
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager, redirect_stdout
from fractions import Fraction
from functools import lru_cache, partial
from pathlib import Path
from typing import Any, Literal, TypeVar

import av
import numpy as np
import numpy.typing as npt
import OpenEXR
import scipy.sparse
from av.container import InputContainer
from PIL import Image, ImageOps, TiffImagePlugin

import smokelift._core as _core
from smokelift.footage.color import Association, Decoder, Encoding, hlg_to_linear, pq_to_linear
from smokelift.scene import LARGEST_PICTURE

Picture = npt.NDArray[np.float32]
Layer = tuple[Picture, Picture | None]
"""A linear picture (rows, columns, 3) over black, and its alpha (rows, columns), None if it is opaque."""
Transfer = Literal["srgb", "linear"]
Value = TypeVar("Value", np.float32, np.uint16)
Number = TypeVar("Number", np.float32, np.float64)
Codes = npt.NDArray[np.uint8] | npt.NDArray[np.uint16]

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

READABLE = (".png", ".jpg", ".jpeg", ".tif", ".tiff", ".dpx", ".exr", ".hdr")

LOG_BYTE, LOG_TRANSFERS = 801, (1, 3)
"""Place in a DPX of its first element's transfer characteristic, and those that are printing density and logarithmic
(SMPTE ST 268-1). All others are read as sRGB: programs write linear (2) for what is only not logarithmic."""

BEAUTY = ("combined", "beauty", "rgba")
"""Names, in small letters, that renderers give to the part or the layer with the picture: Blender, Arnold, Redshift."""

DEPTHS = ("Z", "ZBack")
"""Names that OpenEXR gives to depths."""

LUMINANCE = np.array([0.2126, 0.7152, 0.0722])
"""Weights of linear red, green and blue (ITU-R BT.709)."""

LOOK_UPS = 2**16
"""Codes looked up at a time: their indices fit the cache."""


class ImageError(ValueError):
    """A picture that cannot be read or written."""


class PictureKindError(ImageError):
    """A sound picture of a kind that is not read, as all of its sequence are."""


def look_up(values: npt.NDArray[Value], codes: Codes) -> npt.NDArray[Value]:
    """Return ``values[codes]``, in the codes' shape.

    NumPy's indexing takes three times as long, and ends the process (NumPy 1.26) if it lacks memory for its buffers.
    """
    flat = codes.reshape(-1)
    found = np.empty(flat.shape, values.dtype)
    for start in range(0, flat.size, LOOK_UPS):
        part = slice(start, start + LOOK_UPS)
        values.take(flat[part], out=found[part], mode="clip")  # no code is outside, and "raise" copies the result
    return found.reshape(codes.shape)


def srgb_to_linear(encoded: npt.ArrayLike) -> Picture:
    """Decode sRGB values (1 is white) to linear ones by the exact piecewise curve, continued above 1."""
    e = np.asarray(encoded, np.float32)
    curve = ((np.maximum(e, np.float32(0.04)) + np.float32(0.055)) / np.float32(1.055)) ** np.float32(2.4)
    return np.asarray(np.where(e <= np.float32(0.04045), e / np.float32(12.92), curve))


def linear_to_srgb(linear: npt.ArrayLike) -> Picture:
    """Encode linear values as sRGB (1 is white) by the exact piecewise curve, continued above 1."""
    v = np.asarray(linear, np.float32)
    curve = np.float32(1.055) * np.maximum(v, np.float32(0.003)) ** np.float32(1 / 2.4) - np.float32(0.055)
    return np.asarray(np.where(v <= np.float32(0.0031308), v * np.float32(12.92), curve))


DECODERS: Mapping[Encoding, Decoder] = {
    "linear": partial(np.asarray, dtype=np.float32),
    "srgb": srgb_to_linear,
    "hlg": hlg_to_linear,
    "pq": pq_to_linear,
}


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
def _silent() -> Iterator[None]:
    """Silence what OpenEXR writes to standard output and error: the exception that follows says it."""
    sys.stderr.flush()
    kept = os.dup(2)
    with Path(os.devnull).open("wb") as nowhere:
        os.dup2(nowhere.fileno(), 2)
    try:
        with redirect_stdout(io.StringIO()):
            yield
    finally:
        os.dup2(kept, 2)
        os.close(kept)


def _read_exr(path: Path) -> Layer:
    with _silent():
        headers = OpenEXR.File(str(path), header_only=True).parts
    for part in headers:
        for name in ("displayWindow", "dataWindow"):
            require_size(path, _window(part, name)[1])
    with _silent():
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
    alpha = np.clip(image[..., 3], 0.0, 1.0) if opacity else None
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


def reduced_size(width: int, height: int, side: float) -> tuple[int, int]:
    """Return the width and height of a picture whose longer side is reduced to ``side`` pixels at most."""
    scale = max(1.0, max(width, height) / side)
    return max(1, round(width / scale)), max(1, round(height / scale))


def area_average(image: npt.ArrayLike, width: int, height: int) -> Picture:
    """Resize a picture (rows, columns) or (rows, columns, channels): a new pixel is the mean of the area it covers.

    An axis that grows is interpolated linearly. ValueError is raised if a size is below 1.
    """
    if min(width, height) < 1:
        raise ValueError(f"a picture needs at least one pixel, not {width} x {height}")
    values = np.asarray(image, np.float32)
    rows, columns = values.shape[:2]
    if rows != height:
        values = (area_weights(rows, height) @ values.reshape(rows, -1)).reshape(height, *values.shape[1:])
    if columns != width:
        weights, shape = area_weights(columns, width), (height, width, *values.shape[2:])
        channels = values.reshape(height, columns, -1)
        values = _core.sum_columns(channels, weights.indptr, weights.indices, weights.data).reshape(shape)
    return np.ascontiguousarray(values)


def brightest_channel(values: npt.NDArray[Number]) -> npt.NDArray[Number]:
    """Return the largest of three values along the last axis; NumPy's ``max`` takes five times as long."""
    red, green, blue = np.moveaxis(values, -1, 0)
    return np.asarray(np.maximum(np.maximum(red, green), blue))


def channel_mean(values: Picture) -> Picture:
    """Return the mean of three values along the last axis; NumPy's ``mean`` takes much longer."""
    red, green, blue = np.moveaxis(values, -1, 0)
    return np.asarray((red + green + blue) / np.float32(3))


def blurred(picture: Picture, deviation: float) -> Picture:
    """Smooth a picture (rows, columns) or (rows, columns, channels) with a Gaussian; its deviation is in pixels.

    This is SciPy's ``gaussian_filter`` of float32, in a quarter of the time.
    """
    # the weights of a pixel and of its neighbors to one side, up to four standard deviations
    weights = np.exp(-0.5 / deviation**2 * np.arange(int(4.0 * deviation + 0.5) + 1) ** 2)
    whole = np.concatenate([weights[:0:-1], weights])
    channels = picture.reshape(*picture.shape[:2], -1)
    return _core.blur_picture(channels, weights / whole.sum()).reshape(picture.shape)


@lru_cache
def area_weights(old: int, new: int) -> scipy.sparse.csr_array:
    """Return the sparse (new, old) matrix whose rows weight the old pixels of each new one."""
    if new > old:
        position = np.clip((np.arange(new) + 0.5) * (old / new) - 0.5, 0.0, old - 1.0)
        low = np.minimum(position.astype(np.int64), max(old - 2, 0))
        weight = position - low
        rows = np.repeat(np.arange(new), 2)
        columns = np.stack([low, np.minimum(low + 1, old - 1)], axis=1).ravel()
        values = np.stack([1.0 - weight, weight], axis=1).ravel()
    else:
        # in units of 1 / (old new) of the picture all edges are whole numbers, so overlaps are exact
        reach = -(-old // new) + 1
        first = np.arange(new) * old // new
        columns = np.minimum(first[:, None] + np.arange(reach), old - 1)
        inside = first[:, None] + np.arange(reach) < old
        start, stop = np.arange(new)[:, None] * old, (np.arange(new)[:, None] + 1) * old
        overlap = np.minimum(stop, (columns + 1) * new) - np.maximum(start, columns * new)
        rows = np.repeat(np.arange(new), reach)
        values = (np.maximum(overlap, 0) * inside / old).ravel()
        columns = columns.ravel()
    return scipy.sparse.csr_array((values.astype(np.float32), (rows, columns)), shape=(new, old))
