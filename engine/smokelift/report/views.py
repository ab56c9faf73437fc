"""Findings as others take them: a sentence, a line of a table, and JSON."""

from collections.abc import Iterable, Mapping
from string import Formatter
from typing import Any

from smokelift.checks import UNDETERMINED, Finding, counted
from smokelift.report.sentences import SENTENCES, SHORT, VALUES

MODELS: Mapping[object, str] = {
    "absorption": "absorption only",
    "unshadowed": "scattering without shadows",
    "single": "single scattering with shadows",
    "multiple": "multiple scattering",
}
"""Models of scattering in words."""

MIN_DEPTH = 0.005
"""Smallest distance (m) from the middle of the box that is said: less would look exact."""


def sentence(finding: Finding) -> str:
    """Return a finding in words."""
    words = _filled(SENTENCES[finding.kind], finding)
    return f"View {finding.figures['view']}: {words}" if "view" in finding.figures else words


def message(finding: Finding) -> dict[str, Any]:
    """Return what an event says: the words, with kind and figures, of which programs make their own."""
    return {"text": sentence(finding), "kind": finding.kind, "figures": _figures(finding)}


def fact(finding: Finding) -> dict[str, str]:
    """Return a line of a table as JSON holds it; ``short`` is its value in a few words, for a sidebar.

    What is given needs no sentence.
    """
    said = finding.source != "given" and finding.kind in SENTENCES
    value = VALUES.get(finding.kind, "{value}")
    return {
        "what": finding.about,
        "value": _filled(value, finding),
        "short": _filled(SHORT.get(finding.kind, value), finding),
        "origin": UNDETERMINED if finding.source == "assumed" else finding.source or "",
        "how": sentence(finding) if said else "",
    }


def choices(findings: Iterable[Finding]) -> list[dict[str, Any]]:
    """Return those of the findings that chose something, as JSON holds them."""
    return [_choice(finding) for finding in findings if finding.value is not None]


def _choice(finding: Finding) -> dict[str, Any]:
    """A choice as JSON holds it, with four digits, since further ones decide nothing."""
    known = {name: figure for name, figure in finding.figures.items() if name != "tolerance"}
    if finding.spread is not None:
        known["spread"] = finding.spread
    return {
        "what": finding.about,
        "chosen": list(map(_rounded, finding.value)) if isinstance(finding.value, tuple) else _rounded(finding.value),
        "kind": finding.kind,
        "reason": sentence(finding),
        "measured": {name: _rounded(figure) for name, figure in known.items() if isinstance(figure, float | int)},
        "tolerance": finding.figures.get("tolerance"),
        "by_hand": finding.source == "given",
    }


def part(finding: Finding) -> dict[str, Any]:
    """Return where a part of a result comes from as JSON holds it; ``settings`` are those that chose it."""
    settings = dict(finding.figures) if finding.source == "made up" else {}
    return {"what": finding.about, "origin": finding.source, "how": sentence(finding), "settings": settings}


def _rounded(figure: Any) -> Any:
    return float(f"{figure:.4g}") if isinstance(figure, float) else figure


def _figures(finding: Finding) -> dict[str, Any]:
    """What words fill in."""
    known = {"what": finding.about.capitalize(), "value": finding.value, "spread": finding.spread}
    return {**finding.figures, **{name: figure for name, figure in known.items() if figure not in ("", None)}}


def _filled(words: str, finding: Finding) -> str:
    return _Words().vformat(words, (), _figures(finding))


class _Words(Formatter):
    """Fills figures in, by the formats of `smokelift.report.sentences`."""

    def format_field(self, value: Any, format_spec: str) -> str:
        """Return a figure in words."""
        if isinstance(value, tuple):
            lengths = format_spec.endswith(" x") or all(isinstance(one, int) for one in value)
            return (" x " if lengths else ", ").join(format(one, format_spec.removesuffix(" x")) for one in value)
        if format_spec == "place":  # of a depth (m) behind the middle
            way = "behind" if value > 0 else "before"
            return f"{abs(value):.2g} m {way} the middle" if abs(value) >= MIN_DEPTH else "in the middle"
        if isinstance(value, int) and len(format_spec) > 1 and format_spec.replace(" ", "").isalpha():
            return counted(value, format_spec)
        return format(MODELS.get(value, value), format_spec)
