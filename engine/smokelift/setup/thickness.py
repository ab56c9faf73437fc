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
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from smokelift.footage.plate import Plate, noise_at
from smokelift.setup.choice import UNDETERMINED, Choice

Array = NDArray[np.float64]

BLOCK = 8
"""Pixels along a block, inside which smoke is taken to let the same share of all light through."""

CONTRAST = 2.0
"""Texture of the background at least, in multiples of the noise of a frame: the background's own errors are textures
that no frame shows."""

CONFIDENCE = 0.5
"""Confidence of the background at least."""

ERROR = 0.15
"""Largest relative error (standard deviation) of the source radiance that counts as told: half of the 30 % within which
it has to be right."""

FEWEST = 3
"""Frames at least that their deviation is estimated from."""


@dataclass(frozen=True, eq=False)
class Texture:
    """What a frame shows of the texture behind its smoke, sums over blocks.

    Attributes
    ----------
    hidden, added
        Share of light that the smoke takes away, and radiance (3,) that it adds, over its blocks.
    smoke, unsure
        Weight of its blocks, and how much of that has a background that may be smoke itself.
    clear, missing
        Weight of the blocks without smoke, and how much of the texture is missing from them, where all should be seen.
    """

    hidden: float
    added: Array
    smoke: float
    unsure: float
    clear: float
    missing: float


@dataclass(frozen=True, eq=False)
class Thickness:
    """The source radiance that the texture tells.

    Attributes
    ----------
    source : (3,), optional
        None where nothing tells it.
    choice
        The same in words.
    """

    source: Array | None
    choice: Choice[str]


def seen_texture(picture: NDArray[np.float32], plate: Plate, smoke: NDArray[np.bool_]) -> Texture:
    """Compare the texture of a frame with that of its background.

    Parameters
    ----------
    picture : (rows, columns, 3)
        Linear radiance.
    plate
        The background, of the same size.
    smoke : (rows, columns) bool
        Pixels that show smoke.
    """
    behind = _behind(plate)
    known, power, confidence = behind.known, behind.power, behind.confidence
    covered = _blocks(smoke.astype(np.float64))
    if not known.any():
        return Texture(0.0, np.zeros(3), 0.0, 0.0, 0.0, 0.0)
    before = np.asarray(picture, np.float64)
    shared = _texture(_differences(before), behind.differences)
    smoky, clear = known & (covered > 0.5), known & (covered == 0)
    # one sharp edge would outweigh all else
    usual = float(np.median(power[smoky])) if smoky.any() else 0.0
    weight = power / (power + max(usual, 1e-12))
    passed = np.divide(shared, power, out=np.ones_like(power), where=power > 0)
    added = _blocks(before) - passed[..., None] * behind.light
    return Texture(
        hidden=float(np.sum((weight * (1 - passed))[smoky])),
        added=np.asarray(np.sum((weight[..., None] * added)[smoky], axis=0)),
        smoke=float(np.sum(weight[smoky])),
        unsure=float(np.sum((weight * (1 - confidence))[smoky])),
        clear=float(np.sum(weight[clear])),
        missing=float(np.sum((weight * (1 - passed))[clear])),
    )


def smoke_thickness(frames: Sequence[Texture]) -> Thickness:
    """Say what frames together tell of the smoke's thickness."""
    frames = [frame for frame in frames if frame.smoke > 0]
    sums = ("hidden", "smoke", "unsure", "clear", "missing")
    hidden, smoke, unsure, clear, missing = (float(sum(getattr(f, name) for f in frames)) for name in sums)
    if len(frames) < FEWEST or not hidden > 0 or not clear > 0:
        return _undetermined("too little texture shows through it")
    added = np.sum([frame.added for frame in frames], axis=0)
    others = np.array([(added - frame.added).sum() / max(hidden - frame.hidden, 1e-12) for frame in frames])
    whole = max(float(added.sum() / hidden), 1e-12)
    spread = np.sqrt((len(frames) - 1) * np.mean((others - others.mean()) ** 2)) / whole
    # what a background of smoke hides is missing from what the smoke before it seems to hide
    error = float(np.linalg.norm((spread, missing / clear * smoke / hidden, unsure / hidden)))
    if not error <= ERROR:
        return _undetermined("the texture behind it tells it no better than that", error)
    share = hidden / smoke
    return Thickness(
        np.maximum(added / hidden, 0),
        Choice(
            "smoke thickness",
            f"{share:.3f}",
            f"Smoke thickness: by the texture behind it the smoke hides {share:.0%} of what it covers, right to "
            f"{error:.0%}; its light is as strong as that asks for.",
            {"hidden": share, "error": error},
            ERROR,
        ),
    )


def _undetermined(why: str, error: float | None = None) -> Thickness:
    known = "" if error is None else f" (error {min(error, 9.99):.0%}, {ERROR:.0%} at most would do)"
    reason = (
        f"Smoke thickness: undetermined, {why}{known}; thinner smoke in stronger light looks the same. "
        "Give [[lights]] if you know the light."
    )
    measured = {} if error is None else {"error": error}
    return Thickness(None, Choice("smoke thickness", UNDETERMINED, reason, measured, ERROR))


@dataclass(frozen=True, eq=False)
class _Behind:
    """What is needed of a background, of blocks but for the first.

    Attributes
    ----------
    differences
        Of neighbouring pixels, down and across.
    light : (rows, columns, 3)
        Mean radiance.
    power, confidence : (rows, columns)
        Of its texture, and the mean of its pixels'.
    known : (rows, columns) bool
        Where its texture can be told from noise and is its own.
    """

    differences: tuple[Array, Array]
    light: Array
    power: Array
    confidence: Array
    known: NDArray[np.bool_]


@lru_cache(maxsize=1)
def _behind(plate: Plate) -> _Behind:
    """The background of a plate, which is that of all frames while the camera stands still."""
    behind, confidence = np.asarray(plate.image, np.float64), _blocks(plate.confidence.astype(np.float64))
    differences = _differences(behind)
    power = _texture(differences, differences)
    # the noise of two neighbours, down and across
    noise = 4 * _blocks(np.sum(np.square(noise_at(plate.image, plate), dtype=np.float64), -1))
    # what was hardly ever free of smoke holds some of it
    known = (power > CONTRAST**2 * noise) & (confidence > CONFIDENCE)
    return _Behind(differences, _blocks(behind), power, confidence, known)


def _differences(picture: Array) -> tuple[Array, Array]:
    """Those of neighbouring pixels, down and across."""
    return np.diff(picture, axis=0), np.diff(picture, axis=1)


def _texture(one: tuple[Array, Array], other: tuple[Array, Array]) -> Array:
    """Products of the differences of neighbouring pixels, the mean over each block and the channels."""
    (down, across), (other_down, other_across) = one, other
    products = np.zeros((len(across), down.shape[1]))
    products[:-1] += np.einsum("ijc,ijc->ij", down, other_down)
    products[:, :-1] += np.einsum("ijc,ijc->ij", across, other_across)
    return _blocks(products)


def _blocks(values: Array) -> Array:
    """Means over whole blocks; what is left at the right and at the bottom does not count."""
    rows, columns = (n // BLOCK for n in values.shape[:2])
    whole = np.ascontiguousarray(values[: rows * BLOCK, : columns * BLOCK])
    lines = whole.reshape(rows, BLOCK, -1).sum(1)  # along memory: several times faster
    return np.asarray(lines.reshape(rows, columns, BLOCK, *values.shape[2:]).sum(2) / BLOCK**2)
