"""Which value of each pixel over time is its background.

A pixel is a mixture of two states: clear, when it has one value within the noise, and smoke, when it has any. Two facts
tell them apart:

- A clear pixel stays; smoke goes on. Of two successive samples of smoke, some share is alike by chance, and it is
  measured on the pixel. A value at which a pixel stays for so many pairs of successive samples that smoke does so once
  in `FALSE_ALARM` only is its background, or smoke as steady as a background.
- Smoke draws every background towards its own brightness. So of several such values, the background is the one that is
  farthest from the smoke's.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
import numpy.typing as npt

from smokelift.footage.behind_smoke import DRIFT, ISLAND, push_pull
from smokelift.footage.images import Picture
from smokelift.footage.noise import linear_samples
from smokelift.footage.seen import at_rank, count_of_seen

STRIDE = 4
"""Pixels from one row or column to the next where it is measured what the smoke is like."""

MOST = 0.8
"""Share of a pixel's samples that have one value which is then its background for certain."""

LEAST_SEEN = 1 / 8
"""Share of the samples that have to show a pixel of which all of them are alike, for that to be its background: 4 of
32. While a camera turns, others show it for a moment only."""

ONE_SIDED = 0.9
"""Share of the changes by smoke to one side from which on it only brightens, or darkens, and the rest is noise."""

FALSE_ALARM = 1e-3
"""Share of the pixels always under smoke that pass for clear at times."""

PRIOR_PAIRS = 4.0
"""Pairs of samples that the clip's share of like pairs counts for beside a pixel's own."""


@dataclass(frozen=True, eq=False)
class Smoke:
    """What the smoke of a clip is like, in sRGB values.

    Attributes
    ----------
    likeness
        Share of the pairs of successive samples of smoke that are within a window.
    brightness
        Grey value that smoke draws every background towards.
    brightens : (rows, columns) bool
        Pixels whose background is darker than that, every `STRIDE`-th along both axes.
    """

    likeness: float
    brightness: float
    brightens: npt.NDArray[np.bool_]


def smoke_of(grey: Picture, window: float) -> Smoke:
    """What the smoke in samples (frames, rows, columns) is like."""
    shape = grey.shape[1:]
    values = grey.reshape(len(grey), -1)
    ordered = np.sort(values, axis=0)
    counts = _supports(ordered, window)
    number = count_of_seen(values)
    background = np.nan_to_num(at_rank(ordered, counts.argmax(0))) + np.float32(0.5 * window)
    away = values - background
    smoky = np.abs(away) > window
    pairs = smoky[1:] & smoky[:-1]
    alike = np.abs(np.diff(values, axis=0)) <= window
    likeness = float(alike[pairs].mean()) if pairs.any() else 0.5
    # what most samples agree on is the background for certain
    certain = (counts.max(0) > MOST * number) & (number >= LEAST_SEEN * len(values))
    behind = push_pull(background.reshape(*shape, 1), certain.reshape(shape).astype(np.float32)).ravel()
    # there, what a codec's drift may be says nothing of smoke
    beyond = 0.5 * window + DRIFT
    change = np.where((np.abs(away) > beyond) & certain, away, 0.0)
    turn = _turn(background, change)
    if (change != 0).any(0).mean() < ISLAND:
        # Smoke that never leaves its place shows beside it by accident only, and in its place all the time. If that is
        # no one-sided change, other things move, too, and say nothing of smoke.
        in_place = values - behind
        in_place = np.where(np.abs(in_place) > beyond, in_place, 0.0)
        if in_place.any() and np.isinf(side := _turn(behind, in_place)):
            change, turn = in_place, side
    if not change.any():
        return Smoke(likeness, 1.0, np.ones(shape, np.bool_))
    thickest = np.quantile(values[change != 0], [0.01, 0.99])
    brightness = float(np.clip(turn, *thickest))
    return Smoke(likeness, brightness, (behind <= turn).reshape(shape))


def clear_values(
    samples: npt.NDArray[np.uint16],
    away: Picture,
    window: float,
    likeness: float,
    clear: npt.NDArray[np.bool_],
) -> tuple[Picture, npt.NDArray[np.bool_], npt.NDArray[np.bool_]]:
    """Return the background of each pixel, linear, whether it is certain, and whether the pixel changes like drift.

    Where it is not certain it is the least smoky value. That of a pixel that drifts is its middle one. ``away`` is the
    grey value of the samples, with its sign turned where smoke darkens: the less, the clearer. ``clear`` is filled with
    where each sample shows that background.
    """
    unseen, number = np.isnan(away), count_of_seen(away)
    some_unseen = bool(unseen.any())
    alike = _count(np.abs(np.diff(away, axis=0)) <= window)
    pairs = _count(~unseen[1:] & ~unseen[:-1])
    ordered, last = np.sort(away, axis=0), np.maximum(number - 1, 0)
    # one sample may be astray
    lowest, highest = at_rank(ordered, np.minimum(1, last)), at_rank(ordered, np.maximum(last - 1, 0))
    calm = highest - lowest <= window + DRIFT
    least = _least_stay(len(away) - 1, likeness)[pairs, alike]
    often = number >= LEAST_SEEN * len(away)
    best = np.full(away.shape[1:], np.inf, np.float32)
    for sample in away:
        inside = (away >= sample) & (away <= sample + window)
        stays = _count(inside[1:] & inside[:-1])
        certain = stays >= least
        # a pair is inside for certain if all samples are
        always = (inside | unseen).all(0) if some_unseen or len(away) == 1 else stays == len(away) - 1
        certain |= always & often
        np.copyto(best, sample, where=certain & (sample < best))
    known = np.isfinite(best)
    centre = np.where(known, best, lowest) + np.float32(0.5 * window)
    centre = np.where(calm, at_rank(ordered, np.minimum(number // 2, last)), centre)
    for _ in range(3):  # the window starts at a sample; mean shift settles it around the mean of its samples
        inside = np.abs(away - centre) <= 0.5 * window * 1.001
        within = np.maximum(_count(inside), 1)
        centre = np.where(inside, away, 0).sum(axis=0) / within
    clear[...] = inside
    value = np.einsum("tyxc,tyx->yxc", linear_samples(samples), inside.astype(np.float32)) / within[..., None]
    return value.astype(np.float32), known, calm


def _turn(background: Picture, change: Picture) -> float:
    """The grey value below which changes (frames, n) brighten backgrounds (n,) and above which they darken them."""
    brighter, darker = (np.square(np.maximum(each, 0)).sum(0) for each in (change, -change))
    one_sided = ONE_SIDED * float((brighter + darker).sum())
    if brighter.sum() >= one_sided:
        return np.inf
    if darker.sum() >= one_sided:
        return -np.inf
    order = np.argsort(background)
    # the value that explains the most of the changes
    wrong = np.cumsum(darker[order]) + np.cumsum(brighter[order][::-1])[::-1]
    return float(background[order][wrong.argmin()])


def _supports(ordered: Picture, window: float) -> npt.NDArray[np.int16]:
    """Return how many samples lie from each one up to ``window`` above it; ordered along the first axis."""
    counts = np.ones(ordered.shape, np.int16)
    for lag in range(1, len(ordered)):
        counts[:-lag] += ordered[lag:] - ordered[:-lag] <= window
    return counts


def _count(holds: npt.NDArray[np.bool_]) -> npt.NDArray[np.uint8]:
    """How often something holds along the first axis, of fewer than 256."""
    return np.asarray(holds.view(np.uint8).sum(0, np.uint8))


@lru_cache(maxsize=1)
def _least_stay(most: int, likeness: float) -> npt.NDArray[np.uint8]:
    """For how many pairs of samples a pixel has to stay at a value that is its background.

    Parameters
    ----------
    most
        Pairs that there are.
    likeness
        As of `Smoke`.

    Returns
    -------
    (pairs, alike) uint8
        By the number of a pixel's pairs, and of those that are alike; more than there are where none is enough.
    """
    pairs, alike, stays = np.ogrid[: most + 1, : most + 1, : most + 1]
    rest = np.maximum(pairs - stays, 0) + PRIOR_PAIRS
    share = (np.maximum(alike - stays, 0) + PRIOR_PAIRS * likeness) / rest
    enough = stays * np.log(np.clip(share, 1e-6, 1 - 1e-6)) < np.log(FALSE_ALARM)
    return np.where(enough.any(-1), enough.argmax(-1), most + 1).astype(np.uint8)
