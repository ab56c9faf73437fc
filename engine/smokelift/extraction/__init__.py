"""Extraction: smoke apart from what is behind it, I = S + T B + n; before anything is fitted."""

from smokelift.extraction.element import Element, extract_element, usual_source

__all__ = ["Element", "extract_element", "usual_source"]
