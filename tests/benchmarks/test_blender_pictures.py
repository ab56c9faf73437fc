"""The pictures of the add-on, in few colors."""

import numpy as np
from PIL import Image
from scipy import ndimage

from benchmarks.blender.pictures import COLORS, save


def test_few_colors_leave_shades_and_white_as_they_are(tmp_path) -> None:
    """What is even to the eye, as a mean over some pixels, has no steps."""
    rows, columns = np.mgrid[:300, :400]
    halo = np.exp(-((columns - 200) ** 2 + (rows - 150) ** 2) / 5000.0)[..., None]
    shades = np.stack([40 + 0.4 * columns, 60 + 0.4 * rows, 90 + (columns + rows) / 7], -1) * (1 - halo) + 255 * halo
    shades += np.random.default_rng(0).normal(0, 3, shades.shape)
    shades[20:40, 20:60] = 255
    picture = np.clip(shades, 0, 255).astype(np.uint8)
    save(str(tmp_path / "few.png"), Image.fromarray(picture))
    few = Image.open(tmp_path / "few.png")
    assert len(few.getcolors()) <= COLORS
    found = np.asarray(few.convert("RGB")).astype(float)
    wrong = ndimage.uniform_filter(found - picture, (7, 7, 0))
    assert np.abs(wrong).max() < 6
    assert np.sqrt(np.square(wrong).mean()) < 0.6
    assert found[20:40, 20:60].mean() > 254
