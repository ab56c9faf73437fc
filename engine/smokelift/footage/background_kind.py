"""Whether a clip stands before one colour or a picture: one cost ranks them.

A block of the picture is in one of two states: clear, when it shows its background within the noise, and smoke, when it
shows anything. Smoke goes on as it was, or jumps to any other value. So each background explains the blocks at a cost,
the negative logarithm of their probability with the likeliest states (Viterbi, "Error bounds for convolutional codes",
1967). One colour is behind all blocks, but for a few objects before it. A picture has a colour for each block. All
colours are taken to be equally likely there, as they are after a jump, so each block's costs as much as a jump.

A frame that is black everywhere says nothing against a picture, for clips fade. What is black, or another colour, at
some time of the file counts for all of its frames up to the next cut, whatever part of it is used.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from smokelift.checks.array_types import Mask
from smokelift.footage.behind_smoke import DETAIL
from smokelift.footage.images import (
    Picture,
    area_average,
    blurred,
    channel_mean,
    linear_to_srgb,
    reduced_size,
    srgb_to_linear,
)
from smokelift.footage.noise import EIGHT_BIT_STEP, block_means, median_of_seen, spread_about
from smokelift.footage.proxy import Proxy

BLOCKS = 64
"""Blocks along the longer side: means over some pixels, of which white noise is gone."""

MAX_DEVIATION = 3.0
"""Standard deviations of noise up to which a block is as its background."""

MAX_LASTING_NOISE = np.float32(2 / 255)
"""Noise of such means that is not white, in sRGB values, at most: of H.264 at crf 45 it is less than half of that
(docs/experiments/background.md)."""

STAY_PROBABILITY, SWITCH_PROBABILITY = 0.98, 0.03
"""Probability that smoke stays as it is from one frame to the next of those that are examined, and that a block
becomes clear or smoke. What ranks the backgrounds are jumps; these only break ties."""

OBJECT = 0.1
"""Probability of a block to be an object before one colour, a nozzle, a floor or a logo, and share of all blocks that
are at most. Of public clips those on one colour have up to .02 (docs/clips.md)."""

MIN_SHOWN_SHARE = 0.25
"""Share of the blocks that show the one colour at some time, at least."""

MIN_STILL_SHARE = 0.9
"""Share of the frames in which an object is as it mostly is, within half of the limit: smoke wavers more."""

MIN_SEEN_SHARE = 0.99
"""Share of a block that is seen, at least."""

CANDIDATES = 4
"""Colours that are tried: those that most of all blocks have."""

MIN_BLACK_SHARE = 0.98
"""Share of the blocks that are black in a frame that is black everywhere."""

CLEAR_FRAMES = 8
"""Frames of which the clearest view of each pixel is taken."""

DETAIL_QUANTILE, MAX_MIST_DETAIL = 0.99, np.float32(15 / 255)
"""Quantile of the detail of what stands still before black, in sRGB values, and how much of it mist has at most: 1 to
13 of 255 in 26 clips of smoke; walls and stages in the dark have 17 to 40 (docs/experiments/background.md)."""

MAX_SIDE_DIFFERENCE, MIN_SIDE_SHARE = np.float32(2 / 255), 0.5
"""Difference in sRGB values up to which a block has the colour around a single picture, and share of the blocks along
its sides that have to, on three of them: 0.56 to 1 of 18 frames of public clips before one colour, 0.2 at most of
others but for stages in the dark (docs/experiments/background.md)."""


@dataclass(frozen=True, eq=False)
class Ranking:
    """What the frames of a clip say of its background.

    Attributes
    ----------
    colour : (3,), optional
        Linear, if it has one; None of a picture.
    objects : (rows, columns) bool
        Pixels of the proxy that show something else before the colour all the time.
    clear
        Share of all blocks and frames that show the colour.
    """

    colour: Picture | None
    objects: Mask
    clear: float


def rank(proxy: Proxy, white: Picture) -> Ranking:
    """Rank the kinds of background that frames of one exposure may have, whose pixels have white noise (3,)."""
    every, shape = _blocks(proxy)
    visible = _visible(proxy, shape)
    values = every[:, visible]

    def on_picture(blocks: Mask) -> Mask:
        whole = np.zeros(len(visible), np.bool_)
        whole[visible] = blocks
        return _at_pixels(whole.reshape(shape), proxy)

    limit = _limit(values, white * np.float32(np.sqrt(np.prod(shape) / np.prod(proxy.seen.shape[1:])) / proxy.scale))
    jump = -float(np.log(2 * limit.mean()))
    goes_on = _goes_on(values, limit, jump)
    empty = within(values, limit)
    empty = empty & (empty.mean(1) > MIN_BLACK_SHARE)[:, None]
    picture = np.full(values.shape[1], np.inf)
    for value in values:
        picture = np.minimum(picture, _cost(within(values - value, limit) | empty, goes_on, jump))
    best = float(picture.mean()) + jump
    colour, found, share = None, np.zeros(values.shape[1], np.bool_), 0.0
    still = within(values - median_of_seen(values), limit / 2).mean(0) >= MIN_STILL_SHARE
    for candidate in _candidates(values, limit):
        clear = within(values - candidate, limit)
        shows = clear.any(0)
        cost, own = _cost(clear, goes_on, jump), picture + jump
        stands = ~shows & (own < cost)
        if candidate.max() <= EIGHT_BIT_STEP and not _sharp(proxy, white):
            stands[:] = False
        cost = np.where(stands, np.minimum(own - np.log(OBJECT), cost), cost)
        # smoke of one brightness draws a colour to one side only
        brighter = float((values[~clear].mean(-1) > candidate.mean()).mean()) if not clear.all() else 0.0
        sides = -sum(part * np.log(max(part, 1e-6)) for part in (brighter, 1 - brighter))
        total = float(cost.mean()) + sides * float((~clear).sum(0).mean())
        if total < best and stands.mean() <= OBJECT and shows.mean() >= MIN_SHOWN_SHARE:
            best, found, share = total, stands & still, float(clear.mean())
            colour = srgb_to_linear(values[clear].mean(0, dtype=np.float64))
            colour[linear_to_srgb(colour) < EIGHT_BIT_STEP / 2] = 0
    return Ranking(colour, on_picture(found), share)


def colour_around(picture: Picture) -> tuple[float, float, float] | None:
    """Return the linear colour along the sides of a single picture (rows, columns, 3), or None if they have more.

    One picture does not tell what never changes, so that smoke may be all that has another colour. It may come in from
    one side, and cover more of the picture than its background does.
    """
    linear = block_means(picture[None])[0]
    blocks = linear_to_srgb(linear)
    sides = [(values[0], values[-1], values[:, 0], values[:, -1]) for values in (blocks, linear)]
    colour = np.median(np.concatenate(sides[0]), axis=0)
    alike = [(np.abs(side - colour) <= MAX_SIDE_DIFFERENCE).all(-1) for side in sides[0]]
    if sum(side.mean() >= MIN_SIDE_SHARE for side in alike) < 3:
        return None
    red, green, blue = (float(v) for v in np.median(np.concatenate(sides[1])[np.concatenate(alike)], axis=0))
    return red, green, blue


def _goes_on(values: Picture, limit: Picture, jump: float) -> Picture:
    """What it costs smoke to go on from one frame to the next (frames - 1, blocks), at most a jump.

    It stays as it is within the noise, or changes as often by so much as smoke of the clip does: exponentially.
    """
    changes = np.diff(values, axis=0)
    alike = within(changes, np.float32(np.sqrt(2)) * limit)
    size = np.abs(changes).mean(-1)
    usual = float(size[~alike].mean()) if not alike.all() else 1.0
    change = np.log(max(usual / float(limit.mean()), 1)) + size / usual
    return np.asarray(np.where(alike, -np.log(STAY_PROBABILITY), np.minimum(change, jump)), np.float32)


def _cost(clear: Mask, goes_on: Picture, jump: float) -> Picture:
    """What blocks (n,) cost that may be clear in some frames (frames, n), with the likeliest states."""
    switch, leave = -np.log(SWITCH_PROBABILITY), -np.log(1 - SWITCH_PROBABILITY)
    is_clear, is_smoke = np.where(clear[0], 0, np.inf), np.full(clear.shape[1], jump)
    for now, going in zip(clear[1:], goes_on, strict=True):
        before = is_clear
        is_clear = np.where(now, np.minimum(is_clear + leave, is_smoke + switch), np.inf)
        is_smoke = np.minimum(is_smoke + leave, before + switch) + going
    return np.asarray(np.minimum(is_clear, is_smoke), np.float32)


def _blocks(proxy: Proxy) -> tuple[Picture, tuple[int, int]]:
    """The colours of blocks (frames, blocks, 3), in sRGB values, and how many rows and columns of them there are."""
    rows, columns = proxy.seen.shape[1:]
    wide, high = reduced_size(columns, rows, BLOCKS)
    values = np.stack([linear_to_srgb(area_average(picture, wide, high)) for picture in proxy.pictures])
    return values.reshape(len(values), -1, 3), (high, wide)


def _limit(values: Picture, white: Picture) -> Picture:
    """Deviation (3,) up to which blocks show the background that most frames of each agree on."""
    limit = np.asarray(MAX_DEVIATION * np.hypot(white, EIGHT_BIT_STEP), np.float32)
    most, usual = np.zeros(values.shape[1]), values[0].copy()
    for value in values:
        count = within(values - value, limit).sum(0)
        more = count > most
        most[more], usual[more] = count[more], value[more]
    near = within(values - usual, limit)[..., None]
    usual = np.where(near, values, 0).sum(0) / near.sum(0)
    spread = spread_about(values - usual, np.hypot(MAX_LASTING_NOISE, white).max())
    return np.asarray(MAX_DEVIATION * np.maximum(spread, np.hypot(white, EIGHT_BIT_STEP)), np.float32)


def _candidates(values: Picture, limit: Picture) -> list[Picture]:
    """The colours that most of all blocks have, and black."""
    left = values.reshape(-1, 3)
    found = [np.zeros(3, np.float32)]
    while len(left) and len(found) <= CANDIDATES:
        cells = np.floor(left / (2 * limit)).astype(np.int64) @ np.array([1, 1 << 20, 1 << 40])
        _, which, counts = np.unique(cells, return_inverse=True, return_counts=True)
        colour = np.median(left[which == counts.argmax()], axis=0)
        for _ in range(3):  # mean shift settles it
            near = within(left - colour, limit)
            colour = left[near].mean(0) if near.any() else colour
        found.append(colour)
        left = left[~within(left - colour, 2 * limit)]
    return found


def _sharp(proxy: Proxy, white: Picture) -> bool:
    """Whether the clearest view of a picture has edges, as what stands before black has, and mist has not."""
    # smoke brightens black; one frame may be astray
    some = proxy.pictures[:: -(-len(proxy.pictures) // CLEAR_FRAMES)]
    clearest = np.sort([channel_mean(linear_to_srgb(picture)) for picture in some], axis=0)[min(1, len(some) - 1)]
    detail = np.abs(clearest - blurred(clearest, DETAIL))[proxy.seen.any(0)]
    return bool(
        np.quantile(detail, DETAIL_QUANTILE) > MAX_MIST_DETAIL + MAX_DEVIATION * float(white.max()) / proxy.scale
    )


def within(deviations: Picture, limit: Picture) -> Mask:
    """Return where deviations (..., 3) are within a limit (3,)."""
    red, green, blue = (np.abs(deviations[..., channel]) <= limit[channel] for channel in range(3))
    return np.asarray(red & green & blue)


def _at_pixels(blocks: Mask, proxy: Proxy) -> Mask:
    """What holds in blocks (rows, columns) at the pixels of a proxy."""
    rows, columns = (
        np.minimum(np.arange(pixels) * count // pixels, count - 1)
        for pixels, count in zip(proxy.seen.shape[1:], blocks.shape, strict=True)
    )
    return np.asarray(blocks[rows][:, columns])


def _visible(proxy: Proxy, shape: tuple[int, int]) -> Mask:
    """Which blocks (n,) no mask hides in any frame; of masks that hide all at some time, in some frame."""
    if proxy.seen.all():
        return np.ones(shape[0] * shape[1], np.bool_)
    rows, columns = shape
    shown = np.stack(
        [area_average(seen.astype(np.float32), columns, rows).ravel() > MIN_SEEN_SHARE for seen in proxy.seen]
    )
    return np.asarray(shown.all(0) if shown.all(0).any() else shown.any(0))
