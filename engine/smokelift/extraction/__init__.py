"""Extraction: smoke apart from what is behind it, I = S + T B + n; before anything is fitted."""

from smokelift.extraction.element import Element, extract_element, usual_source
from smokelift.extraction.source import brightest_smoke, clip_source, shows_transmittance, tells_source

__all__ = [
    "Element",
    "brightest_smoke",
    "clip_source",
    "extract_element",
    "shows_transmittance",
    "tells_source",
    "usual_source",
]
