"""The zips that there are."""

from __future__ import annotations

from engine_wheels import PYTHONS
from extension_libraries import PINS
from extension_products import PLATFORMS, Product


def test_an_artist_finds_the_zip_by_its_blender() -> None:
    """Every zip has a name of its own."""
    products = [
        Product(name, "1.0.0", platform, python) for name in PINS for platform in PLATFORMS for python in PYTHONS
    ]
    assert len({product.file for product in products}) == len(products)
    assert products[0].file == "smokelift-1.0.0-blender4.2-5.0-linux_x64.zip"
    assert products[1].file == "smokelift-1.0.0-blender5.1-linux_x64.zip"
