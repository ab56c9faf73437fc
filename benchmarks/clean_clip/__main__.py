"""Tell what disturbances of a clip cost in new views and mass beside the clean clip, by one or more states of the code.

    python -m benchmarks.clean_clip OUT SCENES/plume-3 SCENES/jet-3 [--code before=CHECKOUT now=.] [--only wall]

A scene is a folder that `benchmarks.truth.picture` filled; camera, box, medium and light are given, nothing else unless
the row says so. What OUT/figures.json holds already stays as it is.
"""

import argparse
import json
import shutil
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from benchmarks.clean_clip.measure import Figures, reconstruct, score, write
from benchmarks.clean_clip.rows import Clips, Row
from benchmarks.clean_clip.smoke import Baked
from benchmarks.tables import markdown

Results = dict[str, Figures]
"""Figures by "code / scene / row"."""


def main(arguments: Sequence[str] | None = None) -> None:
    """Measure what is missing, and print the table."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.clean_clip", description=__doc__)
    parser.add_argument("out", type=Path)
    parser.add_argument("scenes", nargs="+", type=Path)
    parser.add_argument("--code", nargs="+", default=["now=."], metavar="NAME=CHECKOUT")
    parser.add_argument("--only", nargs="+", help="rows whose names begin so")
    options = parser.parse_args(arguments)
    options.out.mkdir(parents=True, exist_ok=True)
    checkouts = {name: Path(path).resolve() for name, _, path in (text.partition("=") for text in options.code)}
    kept = options.out / "figures.json"
    results: Results = json.loads(kept.read_text()) if kept.exists() else {}
    rows: dict[str, Row] = {}
    for folder in options.scenes:
        rows = Clips(Baked.load(folder)).rows()
        asked = {row.clean for name, row in rows.items() if _asked(name, options.only)}
        asked |= {name for name in rows if _asked(name, options.only)}
        rows = {name: row for name, row in rows.items() if name in asked}
        for name, row in rows.items():
            missing = {code: checkouts[code] for code in checkouts if _key(code, folder.name, name) not in results}
            if missing:
                work = options.out / "work"
                for code, figures in _measured(row, missing, work).items():
                    results[_key(code, folder.name, name)] = figures
                shutil.rmtree(work)
                kept.write_text(json.dumps(results, indent=1) + "\n")
    print(table(results, rows, list(checkouts), [folder.name for folder in options.scenes]))


def table(results: Results, rows: dict[str, Row], codes: Sequence[str], scenes: Sequence[str]) -> str:
    """Return new views and mass of each clip beside its clean one, mean and worst of the scenes."""
    header = ["clip"] + [f"{code}: {what}" for code in codes for what in ("new views (dB)", "mass")]
    lines = []
    for name, row in rows.items():
        cells = [f"**{name}**" if row.clean == name else name]
        for code in codes:
            pairs = [(results[_key(code, s, name)], results[_key(code, s, row.clean)]) for s in scenes]
            cells += _cells(pairs, row.clean == name)
        lines.append(cells)
    return markdown(header, lines)


def _cells(pairs: Sequence[tuple[Figures, Figures]], clean: bool) -> list[str]:
    """New views and mass of a clip in all scenes, each with that of its clean one."""
    if any("refused" in figures for pair in pairs for figures in pair):
        return ["refused", "refused"]
    found = {what: np.array([[float(each[what]) for each in pair] for pair in pairs]) for what in ("views", "mass")}
    if clean:
        return [f"{found['views'][:, 0].mean():.1f}", f"{found['mass'][:, 0].mean():.2f}"]
    views = found["views"][:, 0] - found["views"][:, 1]
    mass = found["mass"][:, 0] / found["mass"][:, 1] - 1
    worst = mass[np.abs(mass).argmax()]
    return [f"{views.mean():+.1f} ({views.min():+.1f})", f"{mass.mean():+.0%} ({worst:+.0%})"]


def _measured(row: Row, checkouts: dict[str, Path], work: Path) -> dict[str, Figures]:
    film = row.film()
    path = write(film, work)
    found: dict[str, Figures] = {}
    for code, checkout in checkouts.items():
        out = work / code
        refused = reconstruct(path, len(film.pictures), out, checkout)
        found[code] = score(film, out) if refused is None else {"refused": refused}
    return found


def _asked(name: str, only: Sequence[str] | None) -> bool:
    return only is None or any(name.startswith(start) for start in only)


def _key(code: str, scene: str, row: str) -> str:
    return f"{code} / {scene} / {row}"


if __name__ == "__main__":
    main()
