"""Write the types and docstrings of the compiled core, `smokelift._core`, into its stub file; a checker reads no other.

    .venv/bin/python tools/stubs.py [--check]

With --check nothing is written: exit status 1 says that the file is not what the core says.
"""

import argparse
import inspect
import re
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from textwrap import indent
from types import ModuleType

import smokelift._core as _core

ROOT = Path(__file__).resolve().parents[1]
STUB = ROOT / "engine" / "smokelift" / "_core.pyi"

HEADER = '''
# Written by tools/stubs.py from the docstrings in cpp/register_*.cpp.

from collections.abc import Sequence
from typing import Any, TypedDict

import numpy as np
import numpy.typing as npt

from smokelift.checks import Array, Mask
from smokelift.render.plan import ParallelSweep, PointSweep

Reals = npt.NDArray[np.floating[Any]]
Integers = npt.NDArray[np.int32]
Bytes = npt.NDArray[np.uint8]
Faces = tuple[Reals, Reals, Reals] | list[Array]

class Figures(TypedDict):
    """How a minimum was found: steps of the solver, products with the matrix, projections, its last residual."""

    iterations: int
    products: int
    projections: int
    residual: float
'''

TYPES = [
    (r"typing\.SupportsFloat \| typing\.SupportsIndex", "float"),
    (r"typing\.SupportsInt \| typing\.SupportsIndex", "int"),
    (r"typing\.Annotated\[numpy\.typing\.ArrayLike, numpy\.float32\]", "Reals"),
    (r"typing\.Annotated\[numpy\.typing\.ArrayLike, numpy\.uint8\]", "Bytes"),
    (r"numpy\.typing\.NDArray\[numpy\.float32\]", "Array"),
    (r"numpy\.typing\.NDArray\[numpy\.uint8\]", "Bytes"),
    (r'typing\.Annotated\[|, "FixedSize\(\d+\)"\]', ""),
    (r"collections\.abc\.Sequence", "Sequence"),
    (r"(?:Sequence\[)+(?:float|int|bool)\]+", "npt.ArrayLike"),
    (r"smokelift\._core\.", ""),
]
"""Expressions for what pybind11 calls types, and what the stub calls them; one after the other."""


def main() -> int:
    """Write the stub file, or check it; returns the exit status."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("--check", action="store_true", help="compare the file instead of writing it")
    text = formatted("\n".join(lines_of(_core)))
    if not parser.parse_args().check:
        STUB.write_text(text, encoding="utf-8")
    elif STUB.read_text(encoding="utf-8") != text:
        print(f"{STUB} is not what the core says; run tools/stubs.py.", file=sys.stderr)
        return 1
    return 0


def lines_of(module: ModuleType) -> Iterator[str]:
    """Pieces of a stub file: the module's docstring, then what it defines in its order."""
    yield quoted(module.__doc__)
    yield HEADER
    for name, value in vars(module).items():
        if name.startswith("_"):
            continue
        if not isinstance(value, type):
            yield function(value.__doc__)
            continue
        yield f"class {name}:"
        if value.__doc__:
            yield indent(quoted(value.__doc__), "    ")
        for member, defined in vars(value).items():
            if isinstance(defined, property):
                yield "    @property"
                signature = (defined.fget.__doc__ or "").strip()
                yield indent(function(f"{member}{signature}\n{defined.__doc__}"), "    ")
            elif callable(defined) and (member == "__init__" or not member.startswith("_")):
                yield indent(function(defined.__doc__), "    ")


def function(docstring: str | None) -> str:
    """A function from its docstring, whose first line is its signature."""
    signature, _, text = (docstring or "").partition("\n")
    for expression, name in TYPES:
        signature = re.sub(expression, name, signature)
    signature = re.sub(r"\((?:self|arg0): \w+", "(self", signature)
    body = indent(quoted(text), "    ") if text.strip() else "    ..."
    return f"def {signature}:\n{body}\n"


def quoted(text: str | None) -> str:
    """A docstring as it is written in source code, on several lines if it has any."""
    clean = inspect.cleandoc((text or "").strip())
    return f'"""{clean}\n"""' if "\n" in clean else f'"""{clean}"""'


def formatted(source: str) -> str:
    """The source as ruff writes it."""
    command = [sys.executable, "-m", "ruff", "format", "--stdin-filename", str(STUB), "-"]
    return subprocess.run(command, input=source, capture_output=True, text=True, check=True, cwd=ROOT).stdout


if __name__ == "__main__":
    sys.exit(main())
