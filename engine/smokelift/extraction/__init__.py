"""Extraction: smoke apart from what is behind it, I = S + T B + n; before anything is fitted."""

from smokelift.extraction.element import (
    Element,
    brightest_smoke,
    extract_element,
    shows_transmittance,
    tells_source,
    usual_source,
)
from smokelift.extraction.hidden_plate import plates_and_source

__all__ = [
    "Element",
    "brightest_smoke",
    "extract_element",
    "plates_and_source",
    "shows_transmittance",
    "tells_source",
    "usual_source",
]
