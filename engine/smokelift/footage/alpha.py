"""How integer pixels with an alpha channel hold their colors: three conventions, distinguished by the pixels.

Straight colors are the smoke's own. Premultiplied ones are over black: multiplied by alpha in linear light and then
encoded, or encoded and then multiplied, as most compositing programs do. Formats do not say which, or say it wrongly:
PNG is straight by its specification, and programs write all three.

The right one makes the smoke's own color vary least: how much light smoke sends depends on how much smoke there is,
its color does not. That is a fit of one color to each convention, so nothing has to be set.
"""

from collections.abc import Callable, Iterable
from typing import Any, Literal, get_args

import numpy as np
import numpy.typing as npt

from smokelift.checks import Finding

Picture = npt.NDArray[np.float32]
Association = Literal["straight", "premultiplied in linear light", "premultiplied in code values"]


def association(pictures: Iterable[npt.NDArray[Any]], decode: Callable[[npt.ArrayLike], Picture]) -> Association:
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


def association_notes(held: Association) -> tuple[Finding, ...]:
    """Return how colors are read, where they are not straight."""
    return () if held == "straight" else (Finding("premultiplied colors", {"held": held}),)
