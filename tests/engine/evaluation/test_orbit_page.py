"""The page of orbits: what it shows, and where."""

from __future__ import annotations

import numpy as np
from PIL import Image

from smokelift.evaluation.orbit import Orbit
from smokelift.evaluation.orbit_page import COLOURS, DEGREES, orbit_curves, orbit_tiles, write_orbit_page
from smokelift.scene import completed


def test_rows_of_ten_azimuths_above_the_curves(plume, tmp_path):
    tiles = orbit_tiles(Orbit(completed(plume.scene)), plume.densities[2])
    assert len(tiles) == len(DEGREES) == 10
    assert np.abs(tiles[0].astype(float) - tiles[5]).max() > 20
    scores = {"reference": "front", "azimuths": [15, 90, 165], "patches_by_azimuth": [0.1, 0.2, None]}
    curves = orbit_curves(scores | {"patches_own_by_azimuth": None, "patches_own": 0.05}, "smoke")
    assert curves == {"smoke: patches": [0.1, 0.2, None], "front: patches, own": [0.05, 0.05, 0.05]}
    write_orbit_page(tmp_path / "page.png", {"one": tiles, "other": tiles}, [15, 90, 165], curves)
    page = np.asarray(Image.open(tmp_path / "page.png"))
    assert page.shape[1] == sum(tile.shape[1] + 4 for tile in tiles) + 4
    assert page.shape[0] > 2 * tiles[0].shape[0] + 100
    reach = [np.flatnonzero((page[-150:] == colour).all(-1).any(0)) for colour in COLOURS[:2]]
    assert reach[0].max() < 0.7 * page.shape[1] < reach[1].max()  # the first ends at 90 degrees
