"""A page of pictures and of what is known about them."""

import re

import numpy as np
from PIL import Image

from smokelift.checks import Finding
from smokelift.report.inspection import COLUMNS, Page, Panel, write_page

RED = np.zeros((50, 80, 3), np.uint8) + np.uint8([200, 10, 10])
PAGE = Page(
    "clip <1>.mp4",
    [Finding("closed sides", {"sides": "< nothing"}, doubt=True)],
    [Panel(f"panel {n}", RED) for n in range(COLUMNS + 1)],
    [
        Finding("closed sides", {"sides": "x & all is well. " * 40}, about="light", value="all", source="assumed"),
        Finding("given", about="resolution", value=(8, 8), source="given"),
    ],
    [Finding("open box")],
)


def test_a_page_as_html_needs_no_other_file(tmp_path) -> None:
    write_page(tmp_path / "page.html", PAGE)
    text = (tmp_path / "page.html").read_text(encoding="utf-8")
    assert "clip &lt;1&gt;.mp4" in text and "&amp; all is well" in text
    assert '<td class="undetermined">' in text
    assert text.index('<p class="warning">Closed sides of the box: &lt; nothing') < text.index("<img")
    pictures = re.findall(r'src="([^"]*)"', text)
    assert len(pictures) == len(PAGE.panels)
    assert all(picture.startswith("data:image/png;base64,iVBOR") for picture in pictures)


def test_a_page_as_a_picture_shows_every_panel(tmp_path) -> None:
    write_page(tmp_path / "page.png", PAGE)
    with Image.open(tmp_path / "page.png") as picture:
        page = np.asarray(picture).astype(int)
    red = (page[..., 0] > 150) & (page[..., 1] < 50)
    assert red.sum() == len(PAGE.panels) * RED.shape[0] * RED.shape[1]
