"""Thin smoke beside thick: densities compressed before their motion is looked for.

A function of a density is carried along just like the density, so which one is followed is free to choose. Followed as
it is, the thick smoke at the base of a plume decides everything; with its power of 3/4 thin smoke has its say. Pairs of
sharp densities have 0.01 to 0.03 less error by it on seven known scenes. A square root is too much, and noise must not
have its say as well: noisy densities are followed as they are, and so are smooth ones (see `noise`).
"""

from __future__ import annotations

import numpy as np

from smokelift.transport import Array


def compressed(density: Array) -> Array:
    """density^(3/4)."""
    root = np.sqrt(density)
    result: Array = root * np.sqrt(root)
    return result


def expanded(values: Array) -> Array:
    """The density that is compressed to `values`."""
    result: Array = values * np.cbrt(values)
    return result
