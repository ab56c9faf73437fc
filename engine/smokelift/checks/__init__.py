"""What every package says of a value that it is given: in which words, and when it refuses it; and what a remark is."""

from smokelift.checks.arguments import described, listed, numbers, radiance, require_kind
from smokelift.checks.remark import Doubt, Figures, Remark
from smokelift.checks.words import counted, one_of, printable, shown

__all__ = [
    "Doubt",
    "Figures",
    "Remark",
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
