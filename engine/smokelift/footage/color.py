"""How files encode light, by the code points of ITU-T H.273 that FFmpeg gives, and its conversion to linear BT.709.

Diffuse white is 1, as in an sRGB picture: BT.2408 puts it at 75 % of the signal in HLG and at 203 cd/m2 in PQ.
Highlights exceed 1.

Integer pixels with an alpha channel hold their colors by one of three conventions, distinguished by the pixels.
Straight colors are the smoke's own. Premultiplied ones are over black: multiplied by alpha in linear light and then
encoded, or encoded and then multiplied, as most compositing programs do. Formats do not say which, or say it wrongly:
PNG is straight by its specification, and programs write all three. The right one makes the smoke's own color vary
least: how much light smoke sends depends on how much smoke there is, its color does not. That is a fit of one color to
each convention, so nothing has to be set.
"""

from collections.abc import Callable, Iterable, Mapping
from typing import Any, Literal, get_args

import numpy as np
import numpy.typing as npt

from smokelift.checks import Array

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
    screen = (np.maximum(e - c1, 0.0) / (c2 - c3 * e)) ** (1 / m1)
    return np.asarray(screen / (203 / 10_000), np.float32)  # reference white of 203 cd/m2 (BT.2408)


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
    sums = np.zeros((3, len(get_args(Association))))
    for picture in pictures:
        shown = picture[picture[..., 3] > 0]
        encoded, alpha = shown[:, :3].max(-1), shown[:, 3]
        linear = decode(encoded)
        with np.errstate(all="ignore"):  # curves of HDR have no value far above white
            colors = np.stack([linear, linear / alpha, decode(encoded / alpha)], -1).astype(np.float64)
            # errors of premultiplied values are divided by alpha, too
            weights = np.square(alpha, dtype=np.float64)
            sums += [np.full(3, weights.sum()), weights @ colors, weights @ colors**2]
    total, first, second = sums
    with np.errstate(all="ignore"):
        variation = second * total / first**2
    kinds: tuple[Association, ...] = get_args(Association)
    # rounding alone makes opaque pictures differ
    return kinds[int(np.argmin(np.nan_to_num(variation, nan=np.inf).round(6)))]
