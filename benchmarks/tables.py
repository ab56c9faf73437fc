"""Tables: Markdown for a terminal and a page, and rows of figures in a file that grows."""

import csv
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path


def markdown(header: Sequence[str], rows: Iterable[Sequence[str]] = ()) -> str:
    """Return a Markdown table with one line for each row."""
    return "\n".join(line(cells) for cells in (header, ["---"] * len(header), *rows))


def line(cells: Sequence[str]) -> str:
    """Return a row of a Markdown table."""
    return f"| {' | '.join(cells)} |"


def number(value: float | None) -> str:
    """Return a figure with three digits, or a question mark for None."""
    if value is None:
        return "?"
    return f"{value:.0f}" if value >= 100 else f"{value:.3g}"


def cell(figures: Mapping[str, object], names: Sequence[str], form: str) -> str:
    """Return some figures in a format, with slashes between and a dash for each that is missing; empty if all are."""
    values = [figures.get(name) for name in names]
    if all(value is None for value in values):
        return ""
    return " / ".join("-" if value is None else f"{value:{form}}" for value in values)


def size_text(shape: Sequence[int]) -> str:
    """Return a grid's size as it is written on the command line, such as 64x64x96."""
    return "x".join(map(str, shape))


def sizes_of(text: str) -> list[tuple[int, int, int]]:
    """Read the sizes of grids from XxYxZ,XxYxZ, as the command line takes them."""
    sizes = []
    for part in text.split(","):
        x, y, z = map(int, part.split("x"))
        sizes.append((x, y, z))
    return sizes


class Rows:
    """Figures by their keys in a CSV file, which grows by a line a row: what is there is not measured again.

    Parameters
    ----------
    path
        The file; written by such rows, or none yet.
    keys, figures
        Names of the columns. Keys are compared as text.
    """

    def __init__(self, path: Path, keys: Sequence[str], figures: Sequence[str]) -> None:
        self.path, self._figures = path, figures
        self._rows: dict[tuple[str, ...], dict[str, str]] = {}
        if not path.exists():
            path.parent.mkdir(parents=True, exist_ok=True)
            self._append([*keys, *figures])
        with path.open(newline="", encoding="utf-8") as file:
            for row in csv.DictReader(file):
                self._rows[tuple(row[key] for key in keys)] = {name: row[name] for name in figures}

    @property
    def keys(self) -> list[tuple[str, ...]]:
        """The keys of all rows, in the file's order."""
        return list(self._rows)

    def find(self, key: tuple[str, ...]) -> dict[str, float | str | None] | None:
        """Return the figures of a key, numbers where they are; None if there is no such row."""
        row = self._rows.get(key)
        return None if row is None else {name: _value(text) for name, text in row.items()}

    def add(self, key: tuple[str, ...], figures: Mapping[str, float | str | None]) -> None:
        """Write the figures of a key; those without a column are left out."""
        values = [figures.get(name) for name in self._figures]
        cells = ["" if value is None else value if isinstance(value, str) else f"{value:.5g}" for value in values]
        self._rows[key] = dict(zip(self._figures, cells, strict=True))
        self._append([*key, *cells])

    def _append(self, cells: Sequence[str]) -> None:
        with self.path.open("a", newline="", encoding="utf-8") as file:
            csv.writer(file).writerow(cells)


def _value(text: str) -> float | str | None:
    try:
        return float(text) if text else None
    except ValueError:
        return text
