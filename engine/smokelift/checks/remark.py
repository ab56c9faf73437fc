"""What a user should know, as a kind and figures: `smokelift.report.sentences` has the words."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

Figure = float | str | tuple[float, ...]
"""What a sentence fills in."""

Figures = Mapping[str, Figure]


@dataclass(frozen=True)
class Remark:
    """Something that was assumed, measured or noticed.

    Attributes
    ----------
    kind
        Name of its sentence.
    figures
        What the sentence fills in, by name. ``view`` is the number of the further view that the remark is about.
    """

    kind: str
    figures: Figures = field(default_factory=dict)


class Doubt(Remark):
    """A remark that says why the result may be nothing, or wrong."""
