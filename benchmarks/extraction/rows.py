"""The rows of the table, as they are printed and as they are kept in a file."""

from __future__ import annotations

import csv
from dataclasses import dataclass, field
from datetime import date
from pathlib import Path

from benchmarks.extraction.score import Figures
from smokelift import __version__

KEY = ("scene", "plate", "known", "quality", "resolution")

FIGURES = (
    "transmittance_error", "imprint", "mass", "thin_mass", "tail", "psnr", "psnr_20", "psnr_45", "psnr_90",
    "radiance_error",
)  # fmt: skip

HEADER = (
    "scene", "plate", "known", "T rms", "imprint", "mass", "mass, depth < 3", "tail kept", "PSNR inside",
    "20 / 45 / 90",
)  # fmt: skip


@dataclass(frozen=True)
class Row:
    """A reconstruction of one scene before one plate.

    Attributes
    ----------
    scene, plate
        Names; the plate's with what the camera adds.
    known
        What is known of the plate, one of `compose.KNOWN`.
    quality, resolution
        Of the reconstruction, as the command line takes them.
    figures
        Of `score.score_densities`; empty if nothing was measured.
    refused
        The sentence with which the engine refused; empty if it did not.
    """

    scene: str
    plate: str
    known: str
    quality: str
    resolution: str
    figures: Figures = field(default_factory=dict)
    refused: str = ""

    @property
    def key(self) -> tuple[str, ...]:
        """What no two rows of a file share."""
        return self.scene, self.plate, self.known, self.quality, self.resolution


class Rows:
    """The rows of a CSV file, which grows."""

    def __init__(self, path: Path, rows: list[Row]) -> None:
        self.path, self._rows = path, {row.key: row for row in rows}

    @staticmethod
    def read(path: Path) -> Rows:
        """Read the rows that are there."""
        if not path.exists():
            return Rows(path, [])
        with path.open(newline="", encoding="utf-8") as file:
            return Rows(path, [_row(line) for line in csv.DictReader(file)])

    def find(self, row: Row) -> Row | None:
        """Return the row with the same key that was measured; None if there is none."""
        found = self._rows.get(row.key)
        return found if found is not None and found.figures else None

    def add(self, row: Row) -> None:
        """Add a row to the file; a refusal is only printed, since the next state of the code may not refuse."""
        self._rows[row.key] = row
        if not row.figures:
            return
        self.path.parent.mkdir(parents=True, exist_ok=True)
        new = not self.path.exists()
        with self.path.open("a", newline="", encoding="utf-8") as file:
            writer = csv.writer(file)
            if new:
                writer.writerow([*KEY, *FIGURES, "version", "date"])
            figures = [row.figures.get(name) for name in FIGURES]
            writer.writerow([*row.key, *figures, __version__, date.today().isoformat()])


def cells(row: Row) -> list[str]:
    """Return the cells of a row of the table."""
    about = [row.scene, row.plate, row.known]
    if row.refused:
        return [*about, f"refused: {row.refused}", *[""] * (len(HEADER) - 4)]

    def cell(names: str, form: str) -> str:
        values = [row.figures.get(name) for name in names.split()]
        return " / ".join("-" if value is None else f"{value:{form}}" for value in values)

    single = (
        ("transmittance_error", ".3f"), ("imprint", ".2f"), ("mass", ".2f"), ("thin_mass", ".2f"), ("tail", ".2f"),
        ("psnr", ".1f"), ("psnr_20 psnr_45 psnr_90", ".1f"),
    )  # fmt: skip
    return [*about, *(cell(names, form) for names, form in single)]


def _row(line: dict[str, str]) -> Row:
    figures: Figures = {name: float(line[name]) if line[name] else None for name in FIGURES}
    scene, plate, known, quality, resolution = (line[name] for name in KEY)
    return Row(scene, plate, known, quality, resolution, figures)
