"""Backgrounds of one colour, before which most stock footage stands.

Where the pixels that never change have one colour, it is behind all that do. Where they have two, it is the one that
all pixels have at some time: the other is ink that stays. Mist that hardly moves changes as little as what it is in
front of, and has many colours; where all of it fades into black, that is behind it.

A camera that moves shows another part of the background in every frame, so a pixel has no value of its own. One colour
is known all the same.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

from smokelift.footage.behind_smoke import DETAIL, ISLAND
from smokelift.footage.images import Picture, blurred, linear_to_srgb
from smokelift.footage.matte import matte
from smokelift.footage.noise import (
    BLOCK,
    SMOKE_TO_NOISE,
    Noise,
    block_means,
    decode_samples,
    linear_samples,
    over_time,
    whole_blocks,
)
from smokelift.footage.plate import Plate
from smokelift.footage.seen import median_of_seen, quantile_of_seen

ONE_COLOUR = 0.8
"""Share of the pixels that never change which has to have one colour for it to be the backdrop's; the others are a
nozzle, a floor, a logo."""

ONE_COLOUR_NOISE = np.float32(6 / 255)
"""Most noise of a background of one colour, in sRGB values: a pixel that varies more while the camera moves sees more
than one colour."""

AT_ONCE = 0.5
"""Share of the blocks that smoke comes over between two samples, less than a fade or a cut changes at once
(docs/experiments/background.md)."""

BLACK = 0.1
"""Share of the picture that is black all the time, at least, for what fades into it to be mist. Of 43 public clips
those before something have less, but for a stage with sharp edges (docs/experiments/background.md)."""

ENOUGH = 8
"""Samples of which the clearest view of each pixel is taken."""

SHARPEST = 0.99
"""Quantile of that view's detail which is looked at: a speck is no object."""

SHARP = np.float32(15 / 255)
"""Detail of mist and smoke in front of black, in sRGB values, at most (1 to 13 of 255 in 26 clips); walls and stages in
the dark have edges (17 to 40; docs/experiments/background.md)."""

AROUND, MOST = np.float32(2 / 255), 0.5
"""Difference in sRGB values up to which a block has the colour around a single picture, and share of the blocks along
its sides that have to, on three of them: 0.56 to 1 of 18 frames of public clips before one colour, 0.2 at most of
others but for stages in the dark (docs/experiments/background.md)."""


def backdrop_plate(
    samples: npt.NDArray[np.uint16], noise: Noise, seen: npt.NDArray[np.bool_] | None = None
) -> Plate | None:
    """Return the plate of a background of one colour, or None if it has more.

    ``samples`` (frames, rows, columns, 3) are of one exposure, as of `SteadySamples`, and so is what is ``seen`` of
    them (frames, rows, columns).
    """
    backdrop = _backdrop(samples, noise, seen)
    return None if backdrop is None else Plate(backdrop, np.ones(backdrop.shape[:2], np.float32), noise)


def one_colour(plate: Plate) -> tuple[float, float, float] | None:
    """Return the linear colour of a plate that was estimated from a moving camera, or None if it has more than one."""
    known = plate.confidence > 0.5
    if known.mean() < 0.5 or plate.noise.total.max() > ONE_COLOUR_NOISE:
        return None
    red, green, blue = (float(v) for v in np.median(plate.image[known], axis=0))
    colour = np.broadcast_to(np.array([red, green, blue], np.float32), plate.image.shape)
    differs = matte(plate.image, Plate(colour, np.ones_like(plate.confidence), plate.noise)).mask
    return None if (differs & known).any() else (red, green, blue)


def colour_around(picture: Picture) -> tuple[float, float, float] | None:
    """Return the linear colour along the sides of a single picture (rows, columns, 3), or None if they have more.

    One picture does not tell what never changes, so that smoke may be all that has another colour. It may come in from
    one side, and cover more of the picture than its background does.
    """
    linear = block_means(picture[None])[0]
    blocks = linear_to_srgb(linear)
    sides = [(values[0], values[-1], values[:, 0], values[:, -1]) for values in (blocks, linear)]
    colour = np.median(np.concatenate(sides[0]), axis=0)
    alike = [(np.abs(side - colour) <= AROUND).all(-1) for side in sides[0]]
    if sum(side.mean() >= MOST for side in alike) < 3:
        return None
    red, green, blue = (float(v) for v in np.median(np.concatenate(sides[1])[np.concatenate(alike)], axis=0))
    return red, green, blue


def _backdrop(
    samples: npt.NDArray[np.uint16], noise: Noise, seen_pixels: npt.NDArray[np.bool_] | None
) -> Picture | None:
    """The linear picture (rows, columns, 3) of a background of one colour, or None if it has more.

    Whatever never changes and has another colour stands before the backdrop, and is part of the picture.
    """
    linear = np.concatenate([block_means(linear_samples(sample[None])) for sample in samples])
    shown_blocks = np.ones(linear.shape[:3], np.bool_) if seen_pixels is None else whole_blocks(seen_pixels)
    linear[~shown_blocks] = np.nan
    visible = shown_blocks.any(0)
    blocks = linear_to_srgb(linear)
    middle, limit = median_of_seen(blocks), SMOKE_TO_NOISE * noise.averaged(BLOCK**2).total
    still = (over_time(blocks - middle) <= limit).all(-1)
    if not still.any():
        return None
    # the median of many samples has less noise than they have, by pi / 2 more variance than their mean
    settled = SMOKE_TO_NOISE * noise.averaged(BLOCK**2 * max(1.0, len(samples) / (np.pi / 2))).total
    colours: list[Picture] = []
    kinds: list[npt.NDArray[np.bool_]] = []
    left = still
    while left.any() and len(kinds) < 2:  # the backdrop, and what stays before it
        colours.append(np.median(middle[left], axis=0))
        kinds.append((np.abs(middle - colours[-1]) <= settled).all(-1))
        left = left & ~kinds[-1]
    if left.sum() > (1 - ONE_COLOUR) * still.sum():
        return _black(samples, noise, blocks, visible)
    seen = [(np.abs(blocks - colour) <= limit).all(-1) for colour in colours]
    covered = next(
        (n for n, shown in enumerate(seen) if (still & kinds[n]).any() and _comes_over(shown[:, visible])), None
    )
    if covered is None and kinds[0][still].mean() < ONE_COLOUR:
        return _black(samples, noise, blocks, visible)
    alike = kinds[covered or 0]
    bare = alike if covered is None else seen[covered].any(0)
    clear = median_of_seen(linear)
    low, high = (quantile_of_seen(blocks, share) for share in (0.05, 0.95))
    fixed = still & ~alike & ~bare & ((high - low) <= limit).all(-1)
    picture = np.where(fixed[..., None], clear, clear[still & alike].mean(0))
    whole: Picture = _pixels(picture, samples.shape[1:3]).astype(np.float32)
    own = _pixels(fixed, samples.shape[1:3])
    if own.any():
        whole[own] = np.median(linear_samples(samples[:, own]), axis=0)
    return whole


def _black(
    samples: npt.NDArray[np.uint16], noise: Noise, blocks: Picture, visible: npt.NDArray[np.bool_]
) -> Picture | None:
    """A black picture if much of the samples is black all the time and the rest fades into that, else None.

    ``blocks`` (frames, rows, columns, 3) are their block means in sRGB values, of which some are ``visible``.
    """
    limit = SMOKE_TO_NOISE * noise.averaged(BLOCK**2).total
    if (over_time(blocks) <= limit).all(-1)[visible].mean() < BLACK:
        return None
    some = samples[:: -(-len(samples) // ENOUGH)]
    # smoke brightens black; one sample may be astray
    clearest = np.sort([decode_samples(sample).mean(-1) for sample in some], axis=0)[min(1, len(some) - 1)]
    detail = np.abs(clearest - blurred(clearest, DETAIL))[_pixels(visible, samples.shape[1:3])]
    if np.quantile(detail, SHARPEST) > SHARP + SMOKE_TO_NOISE * noise.white.max():
        return None
    return np.zeros((*samples.shape[1:3], 3), np.float32)


def _pixels(blocks: npt.NDArray[Any], shape: tuple[int, ...]) -> npt.NDArray[Any]:
    """Values of blocks (rows, columns, ...) at the pixels of a picture (height, width)."""
    size = min(BLOCK, *shape)
    rows, columns = (np.minimum(np.arange(n) // size, m - 1) for n, m in zip(shape, blocks.shape, strict=False))
    return np.asarray(blocks[rows][:, columns])


def _comes_over(shown: npt.NDArray[np.bool_]) -> bool:
    """Whether what has a colour in samples (frames, blocks) is what smoke comes over.

    Ink that spreads and stays is as still as what it hides. But its own colour is never seen where it has not come to,
    and what it hides is seen everywhere. A clip that fades in from black is black everywhere at a time, too: that
    leaves all of the picture at once, and smoke comes over one part after the other.
    """
    changes = shown[:, ~shown.all(0)]
    at_once = np.abs(np.diff(changes.mean(-1))).max(initial=0.0) if changes.size else 0.0
    return bool(shown.any(0).mean() >= 1 - ISLAND and at_once < AT_ONCE)
