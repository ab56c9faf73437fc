"""Pictures of smoke alone, with an alpha channel: that is the matte, whatever stands behind the smoke.

Such pictures are shown before one colour that is known for certain: white behind dark smoke, black behind bright
smoke. What is behind a pixel then is 1 - alpha of it.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from smokelift.footage.images import Picture, linear_to_srgb

MIDDLE = 0.5
"""sRGB value of smoke that is as far from black as from white."""

OPAQUE = 0.999
"""Alpha from which on nothing is behind a pixel."""


@dataclass(frozen=True, eq=False)
class Layer:
    """A picture with its alpha.

    Attributes
    ----------
    picture : (rows, columns, 3)
        Linear, as it is before black.
    alpha : (rows, columns), optional
        None of a picture without that channel, which hides all that is behind it.
    """

    picture: Picture
    alpha: Picture | None

    def before(self, backdrop: float | None) -> Picture:
        """Return the picture before a linear grey; before black if there is none."""
        if self.alpha is None or not backdrop:
            return self.picture
        return self.picture + (np.float32(1.0) - self.alpha[..., None]) * np.float32(backdrop)


def backdrop_of(layers: Iterable[Layer]) -> float | None:
    """Return the linear grey that pictures of a clip are shown before; None if they are opaque."""
    light, opacity, opaque = 0.0, 0.0, True
    for layer in layers:
        if layer.alpha is not None:
            light += float(layer.picture.mean(-1).sum(dtype=np.float64))
            opacity += float(layer.alpha.sum(dtype=np.float64))
            opaque = opaque and bool((layer.alpha >= OPAQUE).all())
    if opaque:
        return None
    return 1.0 if opacity > 0 and linear_to_srgb(light / opacity) < MIDDLE else 0.0


def sample_numbers(count: int) -> list[int]:
    """Return the frames of so many that show whether a clip has a matte: with smoke, and without."""
    return sorted({0, count // 4, count // 2, count - 1})
