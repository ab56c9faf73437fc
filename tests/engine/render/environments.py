"""Environment pictures that the tests light smoke with."""

import numpy as np


def texels(rows: int, columns: int) -> tuple[np.ndarray, np.ndarray]:
    """Unit vectors (rows, columns, 3) towards texel centers by the convention's formula, and solid angles (rows, 1)."""
    u = (np.arange(columns) + 0.5) / columns
    elevation = np.pi * (0.5 - (np.arange(rows)[:, None] + 0.5) / rows)
    azimuth = 2 * np.pi * (0.5 - u)
    level = np.cos(elevation)
    towards = np.broadcast_arrays(level * np.cos(azimuth), level * np.sin(azimuth), np.sin(elevation))
    band = np.cos(np.pi * np.arange(rows + 1) / rows)
    return np.stack(towards, -1), 2 * np.pi / columns * (band[:-1] - band[1:])[:, None]


def sky(rows: int = 64, columns: int = 128) -> np.ndarray:
    """Bright above the horizon, dark below, brighter to one side; blue above, brown below."""
    towards, _ = texels(rows, columns)
    z = towards[..., 2:]
    above = (0.4 + (1 - z) ** 3) * np.array([0.6, 0.8, 1.2])
    return np.where(z > 0, above, [0.2, 0.15, 0.1]) * (1 + 0.5 * towards[..., :1])


def soft_lamps(rows: int = 64, columns: int = 128) -> np.ndarray:
    """Three wide lamps in random places."""
    rng = np.random.default_rng(0)
    towards, _ = texels(rows, columns)
    places = rng.standard_normal((3, 3))
    places /= np.linalg.norm(places, axis=1, keepdims=True)
    return np.exp(2 * towards @ places.T) @ rng.uniform(0.2, 1, (3, 3))
