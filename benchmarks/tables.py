"""Tables as text: for a terminal and as Markdown."""

from __future__ import annotations

import io
from collections.abc import Iterable, Sequence

from rich.console import Console, RenderableType


def printed(width: int, parts: Iterable[RenderableType]) -> str:
    """Return what a terminal of a width (characters) shows of paragraphs and tables."""
    output = io.StringIO()
    console = Console(file=output, width=width)
    for part in parts:
        console.print(part)
    return output.getvalue().rstrip()


def markdown(header: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    """Return a Markdown table with one line for each row."""
    lines = [header, ["---"] * len(header), *rows]
    return "\n".join(f"| {' | '.join(line)} |" for line in lines)


def number(value: float | None) -> str:
    """Return a figure with three digits, or a question mark for None."""
    if value is None:
        return "?"
    return f"{value:.0f}" if value >= 100 else f"{value:.3g}"


def size_text(shape: Sequence[int]) -> str:
    """Return a grid's size as it is written on the command line, such as 64x64x96."""
    return "x".join(map(str, shape))
