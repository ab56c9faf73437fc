"""What every package says of a value that it is given: in which words, and when it refuses it."""

from smokelift.checks.words import counted, one_of, shown

__all__ = ["counted", "one_of", "shown"]
