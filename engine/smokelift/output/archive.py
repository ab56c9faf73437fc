"""NumPy archives that appear whole or not at all."""

from __future__ import annotations

import io
import zipfile
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from smokelift.output.atomic import atomic_path


def write_arrays(path: Path, arrays: Mapping[str, npt.NDArray[Any]], *, compressed: bool = True) -> None:
    """Write arrays by name as a ``.npz``.

    Raises
    ------
    OSError
        If the file cannot be written.
    """
    # An interrupt while a zip file is open on disk raises a second error when the file is collected.
    buffer = io.BytesIO()
    (np.savez_compressed if compressed else np.savez)(buffer, **dict(arrays))
    with atomic_path(path) as aside:
        aside.write_bytes(buffer.getbuffer())


def read_arrays(path: Path, *names: str) -> dict[str, npt.NDArray[Any]]:
    """Read the arrays of these names from a ``.npz``, or all without names.

    Raises
    ------
    OSError
        If the file is missing or damaged, or lacks an array.
    """
    try:
        with path.open("rb") as file, np.load(file) as data:
            return {name: data[name] for name in names or data.files}
    except (OSError, ValueError, LookupError, EOFError, zipfile.BadZipFile) as error:
        raise OSError(f"{path}: cannot be read: {error}") from error
