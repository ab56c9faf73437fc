"""Whether a clip stands before one color or a picture: hypotheses, of which the likeliest is taken.

A block of the picture is clear, and shows its background within the noise, or it is smoke, and shows anything. Smoke
goes on as it was, or jumps to any value. The cost of a background is the negative logarithm of the blocks' probability
in their likeliest states (Viterbi, "Error bounds for convolutional codes", 1967). One color stands behind all blocks
but a few objects. A picture has its own color in each block, which costs as much as a jump: all colors are equally
likely in either.

A frame that is black everywhere says nothing against a picture, since clips fade. All frames of the file up to the next
cut decide, whatever part of it is used.
"""

from dataclasses import dataclass

import numpy as np

from smokelift.checks import Mask
from smokelift.extraction.clear_picture import spread_out
from smokelift.extraction.proxy import Proxy
from smokelift.footage.images import (
    Picture,
    area_average,
    blurred,
    channel_mean,
    linear_to_srgb,
    reduced_size,
    srgb_to_linear,
)
from smokelift.footage.inpainting import DETAIL
from smokelift.footage.noise import EIGHT_BIT_STEP, block_means, median_of_seen, spread_about

BLOCKS = 64
"""Blocks along the longer side: means over so many pixels that white noise is gone."""

MAX_DEVIATION = 3.0
"""Standard deviations of noise up to which a block shows its background."""

MAX_LASTING_NOISE = np.float32(2 / 255)
"""Largest lasting noise of blocks, in sRGB values: H.264 at crf 45 has less than half of it
(docs/experiments/background.md)."""

STAY_PROBABILITY, SWITCH_PROBABILITY = 0.98, 0.03
"""Probabilities, from one examined frame to the next, that smoke stays as it is, and that a block becomes clear or
smoke. Jumps rank the backgrounds; these only break ties."""

OBJECT = 0.1
"""Probability that a block is an object before one color (a nozzle, a floor, a logo), and largest fraction of such
blocks. Public clips before one color have up to .02 (docs/clips.md)."""

MIN_SHOWN_FRACTION = 0.25
"""Smallest fraction of the blocks that must show the one color at some time."""

MIN_STILL_FRACTION = 0.9
"""Smallest fraction of the frames in which an object is within half of the limit of its median: smoke wavers more."""

MIN_SEEN_FRACTION = 0.99
"""Smallest fraction of a block that no mask hides."""

CANDIDATES = 4
"""Number of the commonest colors that are tried."""

MIN_BLACK_FRACTION = 0.98
"""Fraction of black blocks from which on a frame counts as black everywhere."""

CLEAR_FRAMES = 8
"""Frames that the clearest view of each pixel is taken from."""

DETAIL_QUANTILE, MAX_MIST_DETAIL = 0.99, np.float32(15 / 255)
"""Quantile of the detail before black, and the most that mist has there, in sRGB values. 26 clips of smoke have 1 to 13
of 255, walls and stages in the dark 17 to 40 (docs/experiments/background.md)."""

MAX_SIDE_DIFFERENCE, MIN_SIDE_FRACTION = np.float32(2 / 255), 0.5
"""Difference in sRGB values up to which a block has the color around a single picture, and fraction of such blocks
needed along each of three sides. 18 frames of public clips before one color have 0.56 to 1, others 0.2 at most, but for
stages in the dark (docs/experiments/background.md)."""


@dataclass(frozen=True, eq=False)
class Hypothesis:
    """A background: one linear color (3,), or a picture if ``color`` is None.

    ``cost`` is the negative logarithm of the frames' probability before it, on the mean over blocks. ``objects`` (rows,
    columns) are the proxy's pixels where something hides the color all the time. ``clear`` is the fraction of all
    blocks and frames that show the color.
    """

    cost: float
    color: Picture | None
    objects: Mask
    clear: float


def likeliest_background(proxy: Proxy, white: Picture) -> Hypothesis:
    """Return the likeliest background of frames of one exposure; ``white`` (3,) is their pixels' noise."""
    values, visible = _blocks(proxy)
    rows, columns = proxy.seen.shape[1:]
    limit = _limit(values, white * np.float32(np.sqrt(visible.size / (rows * columns)) / proxy.scale))
    jump = -float(np.log(2 * limit.mean()))
    goes_on = _goes_on(values, limit, jump)
    empty = within(values, limit)
    empty = empty & (empty.mean(1) > MIN_BLACK_FRACTION)[:, None]
    picture = np.full(values.shape[1], np.inf)
    for value in values:
        picture = np.minimum(picture, _cost(within(values - value, limit) | empty, goes_on, jump))
    table = [Hypothesis(float(picture.mean()) + jump, None, np.zeros((rows, columns), np.bool_), 0.0)]
    still = within(values - median_of_seen(values), limit / 2).mean(0) >= MIN_STILL_FRACTION
    for candidate in _candidates(values, limit):
        clear = within(values - candidate, limit)
        shows = clear.any(0)
        cost, own = _cost(clear, goes_on, jump), picture + jump
        stands = ~shows & (own < cost)
        if candidate.max() <= EIGHT_BIT_STEP and not _sharp(proxy, white):
            stands[:] = False
        if stands.mean() > OBJECT or shows.mean() < MIN_SHOWN_FRACTION:
            continue
        cost = np.where(stands, np.minimum(own - np.log(OBJECT), cost), cost)
        # smoke of one brightness moves a color to one side only
        brighter = float((values[~clear].mean(-1) > candidate.mean()).mean()) if not clear.all() else 0.0
        sides = -sum(part * np.log(max(part, 1e-6)) for part in (brighter, 1 - brighter))
        color = srgb_to_linear(values[clear].mean(0, dtype=np.float64))
        color[linear_to_srgb(color) < EIGHT_BIT_STEP / 2] = 0
        objects = np.zeros_like(visible)
        objects[visible] = stands & still
        total = float(cost.mean()) + sides * float((~clear).sum(0).mean())
        table.append(Hypothesis(total, color, spread_out(objects, (columns, rows)), float(clear.mean())))
    return min(table, key=lambda each: each.cost)


def color_around(picture: Picture) -> tuple[float, float, float] | None:
    """Return the linear color along the sides of a single picture (rows, columns, 3), or None if they have several.

    One picture does not show what never changes, so all that has another color may be smoke. Smoke may enter from one
    side, and cover more of the picture than its background does.
    """
    linear = block_means(picture[None])[0]
    blocks = linear_to_srgb(linear)
    sides = [(values[0], values[-1], values[:, 0], values[:, -1]) for values in (blocks, linear)]
    color = np.median(np.concatenate(sides[0]), axis=0)
    alike = [(np.abs(side - color) <= MAX_SIDE_DIFFERENCE).all(-1) for side in sides[0]]
    if sum(side.mean() >= MIN_SIDE_FRACTION for side in alike) < 3:
        return None
    red, green, blue = map(float, np.median(np.concatenate(sides[1])[np.concatenate(alike)], axis=0))
    return red, green, blue


def _goes_on(values: Picture, limit: Picture, jump: float) -> Picture:
    """The cost of smoke going on from one frame to the next (frames - 1, blocks), at most that of a jump.

    Smoke stays within the noise, or its change is exponentially distributed with the clip's own mean.
    """
    changes = np.diff(values, axis=0)
    alike = within(changes, np.float32(np.sqrt(2)) * limit)
    size = np.abs(changes).mean(-1)
    usual = float(size[~alike].mean()) if not alike.all() else 1.0
    change = np.log(max(usual / float(limit.mean()), 1)) + size / usual
    return np.asarray(np.where(alike, -np.log(STAY_PROBABILITY), np.minimum(change, jump)), np.float32)


def _cost(clear: Mask, goes_on: Picture, jump: float) -> Picture:
    """The cost of blocks (n,) in their likeliest states, where ``clear`` (frames, n) says which may be clear."""
    switch, leave = -np.log(SWITCH_PROBABILITY), -np.log(1 - SWITCH_PROBABILITY)
    is_clear, is_smoke = np.where(clear[0], 0, np.inf), np.full(clear.shape[1], jump)
    for now, going in zip(clear[1:], goes_on, strict=True):
        before = is_clear
        is_clear = np.where(now, np.minimum(is_clear + leave, is_smoke + switch), np.inf)
        is_smoke = np.minimum(is_smoke + leave, before + switch) + going
    return np.asarray(np.minimum(is_clear, is_smoke), np.float32)


def _blocks(proxy: Proxy) -> tuple[Picture, Mask]:
    """The colors (frames, n, 3) of blocks, in sRGB values, and which of all (rows, columns) those n are.

    No mask hides them in any frame; if there are none, one frame at least shows them.
    """
    rows, columns = proxy.seen.shape[1:]
    size = reduced_size(columns, rows, BLOCKS)
    seen = np.stack([area_average(shown, *size) > MIN_SEEN_FRACTION for shown in proxy.seen])
    visible = seen.all(0) if seen.all(0).any() else seen.any(0)
    values = [linear_to_srgb(area_average(picture, *size))[visible] for picture in proxy.pictures]
    return np.stack(values), visible


def _limit(values: Picture, white: Picture) -> Picture:
    """Largest deviation (3,) at which a block still shows the value that most of its frames agree on."""
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
    """Black, and the commonest colors of all blocks."""
    left = values.reshape(-1, 3)
    found = [np.zeros(3, np.float32)]
    while len(left) and len(found) <= CANDIDATES:
        cells = np.floor(left / (2 * limit)).astype(np.int64) @ np.array([1, 1 << 20, 1 << 40])
        _, which, counts = np.unique(cells, return_inverse=True, return_counts=True)
        color = np.median(left[which == counts.argmax()], axis=0)
        for _ in range(3):  # mean shift settles it
            near = within(left - color, limit)
            color = left[near].mean(0) if near.any() else color
        found.append(color)
        left = left[~within(left - color, 2 * limit)]
    return found


def _sharp(proxy: Proxy, white: Picture) -> bool:
    """Whether the clearest view of the picture has edges: objects before black do, mist does not."""
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
