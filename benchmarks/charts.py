"""What all charts of the benchmarks share: matplotlib, and the line that says where they were measured."""

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


def new_figure(results: dict[str, Any], width: float, height: float) -> Any:
    """Return a matplotlib figure of a size (inches) with a title that says on what machine results were measured."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(width, height), layout="constrained")
    computer = results["machine"]
    figure.suptitle(f"{computer['processor']}, {computer['cores']} cores, {results['date'][:10]}", fontsize=9)
    return figure


def save(figure: Any, path: Any, dpi: int = 130) -> None:
    """Write a figure as PNG."""
    figure.savefig(path, dpi=dpi, format="png")
