"""How thick the smoke is, where the background's texture shows through it.

Thin smoke in strong light and thick smoke in faint light look alike before one colour. But smoke lets a share T of the
texture behind it through, and adds light that hardly changes between neighbouring pixels. So their differences are the
background's times T, and the rest is what the smoke adds:

    source radiance = sum (I - T B) / sum (1 - T).

Three things say how well that is known: how far T is from 1 beside the smoke, how frames differ, and how much of the
background may be smoke. Figures: docs/experiments/smoke-thickness.md.
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
"""Pixels along a block, in which smoke is taken to let the same share of light through."""

CONTRAST = 2.0
"""Smallest texture of the background, in multiples of a frame's noise: below, the background's errors look like texture
that no frame shows."""

CONFIDENCE = 0.5
"""Smallest confidence of the background: what was hardly ever free of smoke holds some of it."""

ERROR = 0.15
"""Largest relative standard deviation of a measured source radiance: half of the 30 % that it may be off."""

FRAMES = 3
"""Smallest number of frames that a deviation is estimated from: two are left without one of them."""


def seen_texture(picture: NDArray[np.float32], plate: Plate, smoke: NDArray[np.bool_]) -> Doubles:
    """Compare the texture of a linear frame (rows, columns, 3) with its background's; return sums (8,) over blocks.

    With smoke: 0 the weighted share of light that it hides, 1 the weight, 2 the part of that whose background may be
    smoke. Without smoke: 3 the weight, 4 the weighted share of texture that is missing, though all should show. With
    smoke: 5 to 7 the weighted radiance that it adds.
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
    """Return the source radiance (3,) from the sums of `seen_texture` of frames, or None; and the thickness.

    The deviation is estimated by leaving out one frame after the other (the jackknife).
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
    # smoke in the background is missing from what the smoke before it seems to hide
    error = float(np.linalg.norm((spread, missing / clear * smoke / hidden, unsure / hidden)))
    if not error <= ERROR:
        # more than all of it says nothing more
        return None, replace(undetermined, spread=min(error, 1.0))
    known: Figures = {"hidden": hidden / smoke}
    named = f"{hidden / smoke:.3f}"
    found = replace(undetermined, kind="smoke thickness", figures=known, value=named, source="measured", spread=error)
    return np.maximum(np.array(added) / hidden, 0), found


def _texture(one: Doubles, other: Doubles) -> Doubles:
    """Mean over each block of products of differences of neighbouring pixels, down and across, summed over channels."""
    products = np.zeros(one.shape[:2])
    for axis, part in enumerate((products[:-1], products[:, :-1])):
        part += np.einsum("ijc,ijc->ij", np.diff(one, axis=axis), np.diff(other, axis=axis))
    return _blocks(products)


def _blocks(values: Doubles) -> Doubles:
    """Means over whole blocks; what is left over at the right and bottom does not count."""
    rows, columns = (n // BLOCK for n in values.shape[:2])
    whole = np.ascontiguousarray(values[: rows * BLOCK, : columns * BLOCK])
    lines = whole.reshape(rows, BLOCK, -1).sum(1)  # along memory: several times faster
    return np.asarray(lines.reshape(rows, columns, BLOCK, *values.shape[2:]).sum(2) / BLOCK**2)
