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
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from smokelift.checks import Figures
from smokelift.checks.array_types import Doubles
from smokelift.footage.plate import Plate, noise_at
from smokelift.setup.estimate import UNDETERMINED, Estimate

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

FRAMES = 3
"""Smallest number of frames that their deviation is estimated from: without one of them two are left."""


def seen_texture(picture: NDArray[np.float32], plate: Plate, smoke: NDArray[np.bool_]) -> Doubles:
    """Compare the texture of a linear frame (rows, columns, 3) with that of its background, where it shows smoke.

    Returns
    -------
    (8,)
        Sums over blocks. Of those with smoke: the share of light that it takes away, their weight, how much of that has
        a background that may be smoke itself. Of those without: their weight, how much of the texture is missing from
        them, where all should be seen. Of those with smoke again: the radiance (3) that it adds.
    """
    seen, behind = np.asarray(picture, np.float64), np.asarray(plate.image, np.float64)
    confidence, covered = _blocks(plate.confidence.astype(np.float64)), _blocks(smoke.astype(np.float64))
    power = _texture(behind, behind)
    # the noise of two neighbours, down and across
    noise = 4 * _blocks(np.sum(np.square(noise_at(plate.image, plate), dtype=np.float64), -1))
    known = (power > CONTRAST**2 * noise) & (confidence > CONFIDENCE)
    smoky, clear = known & (covered > 0.5), known & (covered == 0)
    # one sharp edge would outweigh all else
    usual = float(np.median(power[smoky])) if smoky.any() else 0.0
    weight = power / (power + max(usual, 1e-12))
    passed = np.divide(_texture(seen, behind), power, out=np.ones_like(power), where=power > 0)
    hidden, unsure = weight * (1 - passed), weight * (1 - confidence)
    added = weight[..., None] * (_blocks(seen) - passed[..., None] * _blocks(behind))
    sums = [part[smoky].sum() for part in (hidden, weight, unsure)] + [part[clear].sum() for part in (weight, hidden)]
    return np.array([*sums, *added[smoky].sum(0)])


def smoke_thickness(frames: Sequence[Doubles]) -> tuple[Doubles | None, Estimate[str]]:
    """Return the source radiance (3,) that the sums of `seen_texture` of frames show, None if none; and the thickness.

    The deviation is estimated by leaving one frame out after the other (the jackknife).
    """
    undetermined = Estimate(
        "uncertain smoke thickness",
        what="smoke thickness",
        value=UNDETERMINED,
        source="assumed",
        spread=1.0,
        tolerance=ERROR,
    )
    seen = np.array([frame for frame in frames if frame[1] > 0]).reshape(-1, 8)
    hidden, smoke, unsure, clear, missing, *added = (float(total) for total in seen.sum(0))
    if len(seen) < FRAMES or not (hidden > 0 and clear > 0):
        return None, undetermined
    rest = seen.sum(0) - seen
    others = rest[:, 5:].sum(1) / np.maximum(rest[:, 0], 1e-12)
    spread = np.sqrt((len(seen) - 1) * np.var(others)) / max(sum(added) / hidden, 1e-12)
    # what a background of smoke hides is missing from what the smoke before it seems to hide
    error = float(np.linalg.norm((spread, missing / clear * smoke / hidden, unsure / hidden)))
    if not error <= ERROR:
        # more than all of it says nothing more
        return None, replace(undetermined, spread=min(error, 1.0))
    known: Figures = {"hidden": hidden / smoke}
    named = f"{hidden / smoke:.3f}"
    found = replace(undetermined, kind="smoke thickness", figures=known, value=named, source="measured", spread=error)
    return np.maximum(np.array(added) / hidden, 0), found


def _texture(one: Doubles, other: Doubles) -> Doubles:
    """Products of differences of neighbouring pixels, down and across, the mean over each block and all channels."""
    products = np.zeros(one.shape[:2])
    for axis, part in enumerate((products[:-1], products[:, :-1])):
        part += np.einsum("ijc,ijc->ij", np.diff(one, axis=axis), np.diff(other, axis=axis))
    return _blocks(products)


def _blocks(values: Doubles) -> Doubles:
    """Means over whole blocks; what is left at the right and at the bottom does not count."""
    rows, columns = (n // BLOCK for n in values.shape[:2])
    whole = np.ascontiguousarray(values[: rows * BLOCK, : columns * BLOCK])
    lines = whole.reshape(rows, BLOCK, -1).sum(1)  # along memory: several times faster
    return np.asarray(lines.reshape(rows, columns, BLOCK, *values.shape[2:]).sum(2) / BLOCK**2)
