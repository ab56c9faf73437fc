"""What all charts of the benchmarks share: matplotlib."""

from __future__ import annotations

from typing import Any


def require_matplotlib() -> None:
    """Check that charts can be drawn, before hours are spent on figures for them.

    Raises
    ------
    ValueError
        If matplotlib is not installed.
    """
    try:
        import matplotlib  # noqa: F401
    except ImportError:
        raise ValueError("charts need matplotlib: pip install matplotlib.") from None


def save(figure: Any, path: Any, dpi: int = 130) -> None:
    """Write a figure as PNG."""
    figure.savefig(path, dpi=dpi, format="png")
