"""What every package says of a value that it is given: in which words, and when it refuses it."""

from smokelift.checks.arguments import described, listed, numbers, radiance, require_kind
from smokelift.checks.words import counted, one_of, printable, shown

__all__ = ["counted", "described", "listed", "numbers", "one_of", "printable", "radiance", "require_kind", "shown"]
