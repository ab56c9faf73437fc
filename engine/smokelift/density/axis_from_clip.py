"""Where in depth the smoke of a clip stands: the posterior mean of its axis.

One picture of smoke in parallel light looks the same whether the smoke is near and small or far and large, so its place
in depth has to come from something else. A box is put around its smoke; that is the prior. The picture adds the row in
which the smoke begins. The ray through it meets the floor where smoke that rises from the floor stands; smoke further
in front on the same ray begins above the floor. Where inlets are known, they say the depth instead.

docs/experiments/density-axis.md has the derivation's figures.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from smokelift.density.axis import SmokeAxis, reach
from smokelift.density.columns import follow_columns, still_there
from smokelift.density.screen import Upright, upright_screen, view_frame
from smokelift.scene import Camera, Domain, Inlet


@dataclass(frozen=True)
class BoxPrior:
    """What a box says of the smoke that somebody put it around (docs/experiments/density-axis.md).

    Attributes
    ----------
    deviation
        Standard deviation of the depth of the smoke, at any height, about the middle of the domain. In reaches of the
        domain, half its extent in depth.
    mean_deviation
        The same of the mean depth of all smoke.
    floor
        Smoke begins as likely on the floor as above it within this height. In heights of the domain.
    base
        The smoke up to this height above its lower end is all of one source. In heights of the domain.
    growth
        A row of a column that only rises holds up to so many times the smoke of its base.
    """

    deviation: float = 0.3
    mean_deviation: float = 0.1
    floor: float = 0.15
    base: float = 0.1
    growth: float = 1.5


@dataclass(frozen=True)
class FloorContact:
    """Where smoke begins on the upright screen.

    Attributes
    ----------
    height
        In metres above the domain's centre.
    amount
        Of the smoke in a row above it, as in `Upright.total`.
    """

    height: float
    amount: float


def estimate_axis(
    amounts: Sequence[NDArray[np.float32]],
    camera: Camera,
    domain: Domain,
    inlets: Sequence[Inlet] = (),
    prior: BoxPrior | None = None,
) -> SmokeAxis:
    """The axis of the smoke in some frames of a clip.

    Parameters
    ----------
    amounts : sequence of (rows, columns)
        Optical depths, 0 where there is no smoke.
    camera
        A camera that stands still.
    inlets
        Where smoke is known to enter; else its contact with the floor is looked for.
    """
    prior = prior or BoxPrior()
    screens = [
        screen for screen in (upright_screen(amount, camera, domain) for amount in amounts) if screen.values.any()
    ]
    if not screens:
        return SmokeAxis.upright()
    rows = [screen.rows() for screen in screens]
    heights, total, middle = rows[0].heights, np.mean([row.total for row in rows], 0), _middle(rows)
    _, along, up = view_frame(camera)
    deviation = prior.deviation * reach(domain, along)
    if inlets:
        depth, across, spread = _above(inlets, heights, camera, domain)
        columns = follow_columns(inlets, screens, camera, domain, deviation) if len(inlets) > 1 else ()
        follows = still_there(middle - across, deviation)
    else:
        contact = find_contact(heights, total, prior.base * 2 * reach(domain, up))
        depth = np.full(heights.shape, contact_depth(contact.height, camera, domain, prior))
        spread, columns = np.zeros(heights.shape), ()
        # a column only rises: where every frame holds much more smoke than its base, the rest has joined it
        least = np.min([row.total for row in rows], 0)
        joined = np.maximum.accumulate(np.where(heights > contact.height, least / contact.amount / prior.growth, 0))
        across = np.interp(contact.height, heights, middle)
        follows = still_there(middle - across, deviation) / np.maximum(joined, 1)
    return SmokeAxis(heights, _balanced(depth, follows, total, prior), spread, columns)


def find_contact(heights: NDArray[np.float64], total: NDArray[np.float64], base: float) -> FloorContact:
    """Where rows (n,) of a picture first hold half as much smoke as those of its base, which is so high (m)."""
    smoky = total > 0.05 * np.median(total[total > 0])
    first = int(np.argmax(smoky))
    amount = float(np.median(total[smoky & (heights <= heights[first] + base)]))
    after = int(np.argmax(total > amount / 2))
    span = slice(max(after - 1, 0), after + 1)
    return FloorContact(float(np.interp(amount / 2, total[span], heights[span])), amount)


def contact_depth(height: float, camera: Camera, domain: Domain, prior: BoxPrior) -> float:
    """Posterior mean of the depth (m behind the domain's centre) of smoke that begins at a height of the screen (m).

    Smoke at depth d on the ray through that height begins h(d) = a + s d above the floor. It begins at any height as
    likely as at any other, and on the floor as likely as within `BoxPrior.floor` above it. The height is known to about
    a pixel, with the long tails of a Cauchy distribution: sometimes it is something else that begins there.

    Returns
    -------
    float
        0 for a camera without perspective, inside the domain or above it, to which the floor is no horizontal line.
    """
    _, along, up = view_frame(camera)
    matrix, centre = np.array(camera.matrix, np.float64), np.array(domain.centre)
    distance = float((centre - matrix[:3, 3]) @ along)
    if camera.type != "perspective" or abs(up[2]) < 1 or distance <= 0:
        return 0.0
    half = reach(domain, along)
    depth = np.linspace(-half, half, 201)
    begins = height + centre[2] - domain.min[2] + (height + centre[2] - matrix[2, 3]) / distance * depth
    pixel = distance / camera.fy
    on_floor = pixel / (np.pi * (begins**2 + pixel**2))
    above = 0.5 + np.arctan(begins / pixel) / np.pi
    density = prior.floor * 2 * reach(domain, up) * on_floor + above
    density *= np.exp(-((depth / (prior.deviation * half)) ** 2) / 2)
    return float(np.average(depth, weights=density))


def _balanced(
    depth: NDArray[np.float64], follows: NDArray[np.float64], total: NDArray[np.float64], prior: BoxPrior
) -> NDArray[np.float64]:
    """Mean depth (m) by height (n,), where a share of the smoke follows the depth below it and the rest is free.

    The mean of all smoke is about in the middle of the domain, so the rest stands to the other side: its depth r has a
    normal prior of variance v, and the sum of both, each times its share of all smoke, one of variance w. The posterior
    mean is r = -(what follows) (the rest's share) / ((the rest's share)^2 + w / v).
    """
    rest = float(np.average(1 - follows, weights=total))
    there = float(np.average(depth * follows, weights=total))
    ratio = (prior.mean_deviation / prior.deviation) ** 2
    return np.asarray(depth * follows - (1 - follows) * there * rest / (rest**2 + ratio))


def _above(
    inlets: Sequence[Inlet], heights: NDArray[np.float64], camera: Camera, domain: Domain
) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
    """Mean depth, mean lateral position and spread in depth (m), at some heights, of the inlets below."""
    lateral, along, height = view_frame(camera)
    places = np.array([inlet.centre for inlet in inlets]) - np.array(domain.centre)
    places = places[np.argsort(places @ height)]
    counts = np.arange(1, len(places) + 1)
    depths = places @ along
    means = np.cumsum(depths) / counts
    variances = np.cumsum(depths**2) / counts - means**2
    quantities = means, np.cumsum(places @ lateral) / counts, np.sqrt(np.maximum(variances, 0))
    depth, across, spread = (np.interp(heights, places @ height, quantity) for quantity in quantities)
    return depth, across, spread


def _middle(rows: Sequence[Upright]) -> NDArray[np.float64]:
    """Mean lateral position (m) of the smoke at each height, over all frames."""
    total = np.sum([row.total for row in rows], 0)
    known = total > 0.02 * total.max()
    mean = np.sum([row.total * row.mean for row in rows], 0)[known] / total[known]
    return np.asarray(np.interp(rows[0].heights, rows[0].heights[known], mean))
