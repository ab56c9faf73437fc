"""How messages say numbers and values."""

from __future__ import annotations

from collections.abc import Iterable


def counted(number: int, noun: str) -> str:
    """Return so many of something in words: "1 frame", "2 frames"."""
    return f"{number} {noun}{'' if number == 1 else 's'}"


def one_of(names: Iterable[str]) -> str:
    """Return the values that a key may have, as a message lists them."""
    return ", ".join(f'"{name}"' for name in names)


def printable(text: str) -> str:
    """Return the text with line breaks and the like as their codes, so that it stays one line."""
    return "".join(c if c.isprintable() else c.encode("unicode_escape").decode() for c in text)


def shown(value: object) -> str:
    """Return a value as a scene file would have it, cut to a readable length."""
    if isinstance(value, bool):
        return str(value).lower()
    text = f'"{printable(value)}"' if isinstance(value, str) else repr(value).replace("(", "[").replace(")", "]")
    return text if len(text) <= 60 else text[:57] + "..."
