"""What every package says of a value that it is given: in which words, and when it refuses it; what a finding is."""

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
from smokelift.checks.finding import UNDETERMINED, Figure, Figures, Finding, Source

__all__ = [
    "UNDETERMINED",
    "Figure",
    "Figures",
    "Finding",
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
