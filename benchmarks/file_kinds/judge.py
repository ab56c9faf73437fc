"""Whether a file is read as what was encoded."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from benchmarks.file_kinds.film import FPS, Pictures
from smokelift.footage.clip import Clip
from smokelift.footage.images import linear_to_srgb


@dataclass(frozen=True, eq=False)
class Kind:
    """A file, and what is known of it.

    Attributes
    ----------
    path
        What the command gets.
    shown : (frames, rows, columns, 3)
        sRGB values as they have to be read; None where the file cannot or need not be read.
    slack
        Mean difference that the encoding may leave, in steps of 8 bits.
    works
        Whether it has to be reconstructed (True) or refused (False); None for damage at random, where either will do.
    fps
        Frames a second.
    """

    path: Path
    shown: Pictures | None = None
    slack: float = 1.0
    works: bool | None = True
    fps: float = FPS


def misread(kind: Kind) -> tuple[float, str]:
    """Return the mean error of the pictures in steps of 8 bits, the worst frame's, and in words what is wrong."""
    if kind.shown is None:
        return 0.0, ""
    with Clip.open(kind.path, fps=None) as clip:
        if abs(clip.fps - kind.fps) > 0.01 * kind.fps:
            return np.inf, f"{clip.fps:g} frames a second, not {kind.fps:g}"
        found = linear_to_srgb(np.stack(list(clip)))
    if found.shape != kind.shown.shape:
        return np.inf, f"shape {found.shape}, not {kind.shown.shape}"
    error = float(np.abs(found - kind.shown).mean((1, 2, 3)).max()) * 255
    return error, f"pictures differ by {error:.1f}" if error > kind.slack else ""
