"""How thick the smoke is, where the background's texture shows through it.

Thin smoke in strong light and thick smoke in faint light look alike before one colour. Smoke lets the share T of the
texture behind it through, and adds light that hardly changes from one pixel to the next. So the differences of
neighbouring pixels are those of the background times T, and the rest of the smoke's radiance is what it adds:

    source radiance = sum (I - T B) / sum (1 - T).

What smoke-free parts of the same pictures show in place of T = 1, what single frames differ by, and how much of the
background may be smoke, says how well that is known. Figures: docs/experiments/smoke-thickness.md.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import lru_cache
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from smokelift.checks.array_types import Doubles
from smokelift.footage.plate import Plate, noise_at
from smokelift.setup.estimate import Estimate, measured, undetermined

BLOCK = 8
"""Pixels along a block, inside which smoke is taken to let the same share of all light through."""

CONTRAST = 2.0
"""Texture of the background at least, in multiples of the noise of a frame: the background's own errors are textures
that no frame shows."""

CONFIDENCE = 0.5
"""Confidence of the background at least: what was hardly ever free of smoke holds some of it."""

ERROR = 0.15
"""Largest relative error (standard deviation) of the source radiance that counts as measured: half of the 30 % within
which it has to be right."""

LARGEST_ERROR = 9.99
"""Largest error that is said: further figures say nothing more."""

FRAMES = 3
"""Smallest number of frames that their deviation is estimated from."""


def seen_texture(picture: NDArray[np.float32], plate: Plate, smoke: NDArray[np.bool_]) -> Doubles:
    """Compare the texture of a frame with that of its background.

    Parameters
    ----------
    picture : (rows, columns, 3)
        Linear radiance.
    plate
        The background, of the same size.
    smoke : (rows, columns) bool
        Pixels that show smoke.

    Returns
    -------
    (8,)
        Sums over blocks. Of those with smoke: the share of light that it takes away, their weight, how much of that has
        a background that may be smoke itself. Of those without: their weight, how much of the texture is missing from
        them, where all should be seen. Of those with smoke again: the radiance (3) that it adds.
    """
    behind = _behind(plate)
    covered, before = _blocks(smoke.astype(np.float64)), np.asarray(picture, np.float64)
    smoky, clear = behind.known & (covered > 0.5), behind.known & (covered == 0)
    # one sharp edge would outweigh all else
    usual = float(np.median(behind.power[smoky])) if smoky.any() else 0.0
    weight = behind.power / (behind.power + max(usual, 1e-12))
    shared = _texture(_differences(before), behind.differences)
    passed = np.divide(shared, behind.power, out=np.ones_like(shared), where=behind.power > 0)
    hidden, unsure = weight * (1 - passed), weight * (1 - behind.confidence)
    added = weight[..., None] * (_blocks(before) - passed[..., None] * behind.light)
    sums = [part[smoky].sum() for part in (hidden, weight, unsure)] + [part[clear].sum() for part in (weight, hidden)]
    return np.array([*sums, *added[smoky].sum(0)])


def smoke_thickness(frames: Sequence[Doubles]) -> tuple[Doubles | None, Estimate[str]]:
    """Return the source radiance (3,) that the sums of `seen_texture` of frames show, None if none; and the thickness.

    The deviation is estimated by leaving one frame out after the other (the jackknife).
    """
    seen = np.array([frame for frame in frames if frame[1] > 0]).reshape(-1, 8)
    hidden, smoke, unsure, clear, missing, *added = (float(total) for total in seen.sum(0))
    if len(seen) < FRAMES or not (hidden > 0 and clear > 0):
        return None, undetermined("smoke thickness without texture", "smoke thickness", tolerance=ERROR)
    rest = seen.sum(0) - seen
    others = rest[:, 5:].sum(1) / np.maximum(rest[:, 0], 1e-12)
    spread = np.sqrt((len(seen) - 1) * np.var(others)) / max(sum(added) / hidden, 1e-12)
    # what a background of smoke hides is missing from what the smoke before it seems to hide
    error = float(np.linalg.norm((spread, missing / clear * smoke / hidden, unsure / hidden)))
    if not error <= ERROR:
        known = min(error, LARGEST_ERROR)
        kind = "uncertain smoke thickness"
        return None, undetermined(kind, "smoke thickness", spread=known, tolerance=ERROR)
    share = hidden / smoke
    thickness = measured("smoke thickness", f"{share:.3f}", {"hidden": share}, spread=error, tolerance=ERROR)
    return np.maximum(np.array(added) / hidden, 0), thickness


class _Behind(NamedTuple):
    """What is needed of a background: differences of its pixels, down and across; and of its blocks the mean radiance,
    the power of the texture, the mean confidence, and whether the texture is its own and stands out from noise.
    """

    differences: tuple[Doubles, Doubles]
    light: Doubles
    power: Doubles
    confidence: Doubles
    known: NDArray[np.bool_]


@lru_cache(maxsize=1)
def _behind(plate: Plate) -> _Behind:
    """The background of a plate, which is that of all frames while the camera stands still."""
    behind, confidence = np.asarray(plate.image, np.float64), _blocks(plate.confidence.astype(np.float64))
    differences = _differences(behind)
    power = _texture(differences, differences)
    # the noise of two neighbours, down and across
    noise = 4 * _blocks(np.sum(np.square(noise_at(plate.image, plate), dtype=np.float64), -1))
    known = (power > CONTRAST**2 * noise) & (confidence > CONFIDENCE)
    return _Behind(differences, _blocks(behind), power, confidence, known)


def _differences(picture: Doubles) -> tuple[Doubles, Doubles]:
    """Differences of neighbouring pixels, down and across."""
    return np.diff(picture, axis=0), np.diff(picture, axis=1)


def _texture(one: tuple[Doubles, Doubles], other: tuple[Doubles, Doubles]) -> Doubles:
    """Products of the differences of neighbouring pixels, the mean over each block and the channels."""
    (down, across), (other_down, other_across) = one, other
    products = np.zeros((len(across), down.shape[1]))
    products[:-1] += np.einsum("ijc,ijc->ij", down, other_down)
    products[:, :-1] += np.einsum("ijc,ijc->ij", across, other_across)
    return _blocks(products)


def _blocks(values: Doubles) -> Doubles:
    """Means over whole blocks; what is left at the right and at the bottom does not count."""
    rows, columns = (n // BLOCK for n in values.shape[:2])
    whole = np.ascontiguousarray(values[: rows * BLOCK, : columns * BLOCK])
    lines = whole.reshape(rows, BLOCK, -1).sum(1)  # along memory: several times faster
    return np.asarray(lines.reshape(rows, columns, BLOCK, *values.shape[2:]).sum(2) / BLOCK**2)
