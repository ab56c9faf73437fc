"""Pictures that stand behind the smoke, linear (rows, columns, 3): painted here, photographs, or any picture file."""

import importlib.util
from collections.abc import Callable
from functools import partial
from pathlib import Path

import numpy as np
from scipy import ndimage

from smokelift.footage.image_files import read_image
from smokelift.footage.images import Picture, area_average, linear_to_srgb, srgb_to_linear

BRIGHT = 0.75
"""Linear radiance of the bright sky."""

BOARD = 18
"""Columns of a board of `planks`."""

LINE = 12
"""Rows of a line of `page`, of which five hold print."""


def planks(rows: int, columns: int) -> Picture:
    """Upright boards of uneven tone with dark joints: hard edges along one axis."""
    random = np.random.default_rng(1)
    y, x = np.mgrid[:rows, :columns]
    tone = random.uniform(0.08, 0.45, columns // BOARD + 2)[x // BOARD]
    grain = 1 + 0.15 * np.sin(y / 7 + 3 * np.sin(x / 5))
    gray = np.where(x % BOARD < 1, 0.02, tone * grain)
    return np.asarray(gray[..., None] * np.array([1.2, 0.9, 0.6]), np.float32)


def sky(rows: int, columns: int) -> Picture:
    """A clear sky that brightens downwards: no detail at all."""
    down = np.linspace(0, 1, rows)[:, None, None]
    top, rise = np.array([0.18, 0.33, 0.62]), np.array([0.3, 0.28, 0.1])
    return np.asarray(np.broadcast_to(top + rise * down, (rows, columns, 3)), np.float32)


def leaves(rows: int, columns: int) -> Picture:
    """Green noise of three sizes: soft detail everywhere."""
    random = np.random.default_rng(2)
    noise = sum(ndimage.gaussian_filter(random.standard_normal((rows, columns)), size) * size for size in (1, 2, 4))
    gray = (noise - np.min(noise)) / np.ptp(noise)
    return np.asarray(np.stack([0.25 * gray**2, 0.1 + 0.5 * gray**2, 0.15 * gray**3], -1), np.float32)


def page(rows: int, columns: int) -> Picture:
    """White paper with lines of black print: brighter than most smoke."""
    random = np.random.default_rng(3)
    gray = np.full((rows, columns), 0.85)
    for row in range(10, rows - 10, LINE):
        gray[row : row + 5] *= np.where(ndimage.uniform_filter1d(random.random(columns), 3) > 0.5, 0.15, 1)
    return np.repeat(gray[..., None], 3, 2).astype(np.float32)


def clouds(rows: int, columns: int) -> Picture:
    """A bright sky that darkens upwards, with clouds."""
    noise = ndimage.gaussian_filter(np.random.default_rng(1).standard_normal((rows, columns)), (4, 10))
    up = np.linspace(0.75, 1, rows)[:, None]
    gray = BRIGHT * np.clip(up * (1 + 0.08 * noise / noise.std()), 0, 1.3)
    return np.asarray(gray[..., None] * np.array([0.85, 0.95, 1.1]), np.float32)


def wall(rows: int, columns: int) -> Picture:
    """Bricks in uneven light, from dark to middling."""
    random = np.random.default_rng(3)
    y, x = np.mgrid[:rows, :columns]
    row = y // 16
    brick = (x + 18 * (row % 2)) // 36
    tone = random.uniform(0.6, 1.3, (row.max() + 1, brick.max() + 1))[row, brick]
    joint = (y % 16 < 2) | ((x + 18 * (row % 2)) % 36 < 2)
    grain = ndimage.gaussian_filter(random.standard_normal((rows, columns)), 1)
    light = ndimage.gaussian_filter(random.standard_normal((rows, columns)), 60)
    gray = np.where(joint, 1.6, tone) * (1 + 0.15 * grain / grain.std()) * (1 + 0.2 * light / light.std())
    return np.asarray(0.12 * np.clip(gray, 0.05, 4)[..., None] * np.array([1.2, 0.95, 0.8]), np.float32)


def of_one_color(rows: int, columns: int, color: float | tuple[float, float, float]) -> Picture:
    """One color everywhere."""
    return np.broadcast_to(np.asarray(color, np.float32), (rows, columns, 3)).copy()


COLORS: dict[str, float | tuple[float, float, float]] = {
    "black": 0.0,
    "gray": 0.18,
    "green": (0.05, 0.4, 0.08),
    "white": 0.9,
}

PAINTED: dict[str, Callable[[int, int], Picture]] = {
    "planks": planks, "sky": sky, "leaves": leaves, "page": page, "clouds": clouds, "wall": wall,
    **{name: partial(of_one_color, color=color) for name, color in COLORS.items()},
}  # fmt: skip

PHOTOGRAPHS = {"coffee": "coffee.png", "rocket": "rocket.jpg"}
"""Files of scikit-image's data: a cup on a wooden table by Rachel Michetti, and a rocket on its launch pad by SpaceX.
Both are dedicated to the public domain (CC0), as skimage/data/README.txt and the docstrings of `skimage.data` say."""


def plate(name: str, rows: int, columns: int) -> Picture:
    """Return a plate as an 8-bit picture file holds it, linear (rows, columns, 3).

    Parameters
    ----------
    name
        Key of `PAINTED` or `PHOTOGRAPHS`, or the path of a picture, which is cropped to the shape about its middle.
    rows, columns
        Of the clip.

    Raises
    ------
    ValueError
        If there is no such plate, or the picture cannot be read.
    """
    if name in PAINTED:
        linear = PAINTED[name](rows, columns)
    else:
        linear = _fitted(read_image(_photograph(name) if name in PHOTOGRAPHS else Path(name)), rows, columns)
    return srgb_to_linear(np.rint(255 * np.clip(linear_to_srgb(linear), 0, 1)).astype(np.float32) / np.float32(255))


def plate_name(name: str) -> str:
    """Return what a plate is called in tables and folders: its own name, or its file's without the suffix."""
    return name if name in PAINTED or name in PHOTOGRAPHS else Path(name).stem


def _photograph(name: str) -> Path:
    found = importlib.util.find_spec("skimage")
    if found is None or not found.submodule_search_locations:
        raise ValueError(f"The plate {name} is a file of scikit-image; install it with pip install '.[bench]'.")
    return Path(found.submodule_search_locations[0]) / "data" / PHOTOGRAPHS[name]


def _fitted(picture: Picture, rows: int, columns: int) -> Picture:
    """Return the largest part about the middle that has a shape's proportions, in that shape."""
    height, width = picture.shape[:2]
    scale = min(height / rows, width / columns)
    tall, wide = round(scale * rows), round(scale * columns)
    top, left = (height - tall) // 2, (width - wide) // 2
    return area_average(picture[top : top + tall, left : left + wide], columns, rows)
