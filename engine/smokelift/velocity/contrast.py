"""Thin smoke beside thick: densities compressed before their motion is looked for.

A function of a density is carried along just like the density, so which one is followed is free to choose. Followed as
it"""

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
