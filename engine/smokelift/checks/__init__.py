"""What every package says of a value that it is given, and the kind and figures of what it finds of a shot or a result.

`arguments` has the words for a value, and refuses it; those for findings are in `smokelift.report`. Types of arrays say
what these hold; shapes and units stand where they are used.
"""

from collections.abc import Mapping
from dataclasses import KW_ONLY, dataclass, field
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from smokelift.checks.arguments import (
    counted,
    described,
    listed,
    numbers,
    one_of,
    printable,
    radiance,
    require_kind,
    shown,
)

__all__ = [
    "UNDETERMINED",
    "Array",
    "Doubles",
    "Figure",
    "Figures",
    "Finding",
    "Indices",
    "Mask",
    "Source",
    "counted",
    "described",
    "listed",
    "numbers",
    "one_of",
    "printable",
    "radiance",
    "require_kind",
    "shown",
]

Array = NDArray[np.float32]
"""Single precision: densities, velocities, radiance."""

Doubles = NDArray[np.float64]
"""Double precision: places, directions, sums."""

Mask = NDArray[np.bool_]
"""Whether something holds of a pixel or a voxel."""

Indices = NDArray[np.intp]
"""Places in other arrays."""

Figure = float | str | tuple[float, ...]
"""What a sentence fills in."""

Figures = Mapping[str, Figure]

Source = Literal["given", "measured", "estimated", "assumed", "made up"]

UNDETERMINED = "undetermined"
"""Value of a choice that nothing in the clip or the scene decides."""


@dataclass(frozen=True)
class Finding:
    """Something that was given, measured, assumed or noticed."""

    kind: str
    """Name of its words."""
    figures: Figures = field(default_factory=dict)
    """What the words fill in, by name. ``view`` is the number of the further view that it is about, ``tolerance`` what
    the deciding figure of a choice was compared with."""
    _: KW_ONLY
    about: str = ""
    """What it decides or explains, such as ``"background"`` or ``"scattering"``; empty of what is only noticed."""
    value: Figure | None = None
    """What a choice takes, or `UNDETERMINED`; None where nothing was chosen."""
    source: Source | None = None
    """The user gives it, the pictures show it (``"measured"``), or it follows from what they show (``"estimated"``).
    The pictures leave the others undetermined: ``"assumed"`` is one answer for all clips, ``"made up"`` one of many for
    this one. None of what is only noticed."""
    spread: float | None = None
    """Standard deviation of the value: meters of a depth; None if it is unknown."""
    doubt: bool = False
    """Whether it says why the result may be nothing, or wrong."""
