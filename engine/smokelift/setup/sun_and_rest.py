"""How strong a sun, and light from everywhere beside it, explain best what smoke adds to pictures."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Explained:
    """The least squares of two lights, neither of which takes light away, for each direction of the sun.

    Attributes
    ----------
    left : (directions,)
        Squared radiance that the two leave.
    sun, rest : (directions,)
        What the pictures of the sun, and those of light from everywhere, are multiplied by.
    """

    left: Array
    sun: Array
    rest: Array


def explained(lit: NDArray[Any], everywhere: NDArray[Any], added: Array) -> Explained:
    """Return how strong a sun from each direction and light from everywhere are.

    Parameters
    ----------
    lit : (directions, n)
        What the smoke adds to n pixels in the light of a sun from each.
    everywhere : (n,)
        The same in light from everywhere.
    added : (n,)
        What it adds.
    """
    of_sun, of_rest, both = lit @ added, float(everywhere @ added), lit @ everywhere
    suns, rests = np.sum(np.square(lit, dtype=np.float64), 1), float(everywhere @ everywhere)
    determinant = np.maximum(suns * rests - both**2, 1e-12 * suns * rests)
    sun, rest = (of_sun * rests - of_rest * both) / determinant, (of_rest * suns - of_sun * both) / determinant
    mixed = (sun >= 0) & (rest >= 0)
    # one of the two alone, where the other would take light away
    sun_alone, rest_alone = np.maximum(of_sun, 0) / suns, max(of_rest, 0.0) / rests
    by_sun, by_rest = sun_alone * np.maximum(of_sun, 0), rest_alone * max(of_rest, 0.0)
    sunny = by_sun > by_rest
    explains = np.where(mixed, sun * of_sun + rest * of_rest, np.maximum(by_sun, by_rest))
    return Explained(
        np.asarray(added @ added - explains),
        np.where(mixed, sun, np.where(sunny, sun_alone, 0.0)),
        np.where(mixed, rest, np.where(sunny, 0.0, rest_alone)),
    )
