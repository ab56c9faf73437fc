"""The smoke as a medium: of the scene, or the usual one in the colour that its pixels show; and its source radiance.

A pixel shows T behind + (1 - T) source: it lies between its background and the source radiance, which is the light
times the smoke's colour. So the source lies on the line from the background through the smoke, beyond the thickest
smoke that is seen. Before black the line has one colour; before anything else it has many. Smoke has a colour of its
own if no source on that line has a colour that light may have: white, as cameras balance it, or that of what is behind
the smoke, which stands in the same light. Figures: docs/experiments/smoke-colour.md.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from smokelift.checks import Doubt, Remark
from smokelift.checks.array_types import Doubles
from smokelift.footage.fire import CLIPPED_VALUE
from smokelift.footage.images import brightest_channel
from smokelift.render import scene_optics
from smokelift.scene import Background, Camera, CompleteScene, Domain, EnvironmentLight, Light, Medium, Scene
from smokelift.scene.checks import Vector
from smokelift.setup.estimate import UNDETERMINED, Estimate
from smokelift.setup.first_estimate import FirstEstimate, SmokeSamples

OPTICAL_DEPTH_AT_ONE = 5.0
"""Optical depth of smoke of density 1 across the domain when the medium is not given: thick, not solid. A convention,
since a picture shows density times extinction."""

SOURCE_EXCESS = 0.1
"""Share by which the source radiance exceeds the 99th percentile of the smoke's. That smoke then has an optical depth
of about 2.4, not an infinite one."""

COLOURED = 12.0
"""Degrees between two colours as vectors of linear light, from which white balance does not explain their difference.
Grey world and its kin are 5 to 6 degrees wrong on the mean, and 10 in the worst quarter of pictures (Gijsenij, Gevers
and van de Weijer, "Computational color constancy: survey and experiments", 2011)."""

THICK_PERCENTILE = 90
"""Percentile of the change from which on smoke is measured: the thickest is nearest to the source."""

PIXELS = 50
"""Smallest number of smoke pixels that have a colour: five of them are the thickest tenth."""

MIN_SOURCE_VALUE = 0.01
"""Linear value of the brightest channel at least: a darker source has no colour that 8 bits show."""

WHITE: Vector = (1.0, 1.0, 1.0)
"""Colour of grey smoke."""


def find_medium(
    scene: Scene, estimate: FirstEstimate, camera: Camera, domain: Domain
) -> tuple[Medium, tuple[Estimate[Any], ...], tuple[Remark, ...]]:
    """Complete the medium, with the colour of its flame where fire burns; with what was measured and assumed for it.

    Smoke has the colour of the lights in the middle of the box times its own.
    """
    medium, samples, fire = scene.medium, estimate.samples, estimate.fire
    estimates: list[Estimate[Any]] = []
    remarks: list[Remark] = []
    if medium is None:
        medium = Medium(extinction=OPTICAL_DEPTH_AT_ONE / min(domain.size))
        remarks.append(Remark("assumed medium", {"extinction": medium.extinction, "albedo": medium.albedo}))
        color, coloured = smoke_colour(samples, _light_colour(scene.lights, camera, domain, medium))
        medium = replace(medium, color=color)
        estimates.append(coloured)
    remarks += several_colours(samples)
    if fire is not None:
        red, green, blue = color = medium.flame_color or fire.color
        figures = {"share": fire.share, "red": red, "green": green, "blue": blue}
        estimates.append(Estimate("fire", figures, what="fire", value=f"{fire.share:.3f}", source="measured"))
        medium = replace(medium, flame_color=color)
    return medium, tuple(estimates), tuple(remarks)


def _light_colour(lights: tuple[Light, ...], camera: Camera, domain: Domain, grey: Medium) -> Doubles:
    """Colour (3,) of the light in the middle of a box, the largest 1; ones where no light is known."""
    # only the sum of an environment's directions counts, so one stands for all
    few = tuple(replace(each, directions=1) if isinstance(each, EnvironmentLight) else each for each in lights)
    source = scene_optics(CompleteScene(camera, domain, grey, few, Background(), "single")).unshadowed_source()
    return source / source.max() if source.max() > 0 else np.ones(3)


def source_radiance(samples: SmokeSamples, measured: Doubles | None = None) -> Doubles:
    """Return the source radiance (3,) of the smoke; white where the clip shows none.

    Thick smoke shows it: the brightest smoke where smoke brightens its background, the darkest where it darkens it. If
    a texture behind the smoke shows that of its mean, ``measured`` (3,), smoke that is brighter, or darker where it
    darkens, is still fitted.
    """
    if len(samples.colours) == 0:
        return np.ones(3)
    brightens = samples.brightens
    if measured is not None:
        changes = np.sum(samples.colours - samples.behind, -1) >= 0
        bound = np.percentile(samples.colours[changes == brightens], 99 if brightens else 1, axis=0)
        return np.maximum(measured, bound) if brightens else np.minimum(measured, bound)
    if not brightens:
        return np.asarray((1 - SOURCE_EXCESS) * np.percentile(samples.colours, 1, axis=0))
    # on the line of colours: the brightest of each channel may be other smoke, and together a colour that none shows
    colours, behind = samples.colours.astype(np.float64), samples.behind.astype(np.float64)
    axis, start = _line_of_colours(colours, behind), behind.mean(0)
    farthest = start + (np.percentile(colours @ axis, 99) - start @ axis) * axis
    return np.asarray(np.maximum(farthest + SOURCE_EXCESS * np.linalg.norm(farthest) * axis, 0))


def smoke_colour(samples: SmokeSamples, light: Doubles) -> tuple[Vector, Estimate[str]]:
    """Return the smoke's own colour, and what decided it, in light of a colour (3,), ones where that is unknown.

    The largest of red, green and blue is 1; the colour is white where nothing says that the smoke is not grey.
    """
    undetermined = Estimate(
        "smoke colour near the light's",
        what="smoke colour",
        value=UNDETERMINED,
        source="assumed",
        tolerance=COLOURED,
    )
    line = _thickest(samples)
    if line is None:
        return WHITE, replace(undetermined, kind="smoke colour unseen")
    behind, seen = line
    sources = _sources(behind, seen)
    white = _degrees(sources, light)
    least = np.minimum(white, _degrees(sources, behind)) if behind.max() > MIN_SOURCE_VALUE else white
    if least.min() < COLOURED:
        return WHITE, replace(undetermined, figures={"degrees": float(least.min())})
    # the palest that explains the clip
    own = sources[white.argmin()] / np.maximum(light, 1e-6)
    red, green, blue = (float(round(v, 3)) for v in own / own.max())
    named = f"{red:.2f}, {green:.2f}, {blue:.2f}"
    figures = {"degrees": float(white.min())}
    found = replace(undetermined, kind="smoke colour", figures=figures, value=named, source="measured")
    return (red, green, blue), found


def several_colours(samples: SmokeSamples) -> tuple[Doubt, ...]:
    """Return a doubt about smoke of more than one colour before black, at a time or one after the other.

    Before black all light of smoke of one colour has that colour, however thick it is. What is off the one colour that
    explains the most of the light is another colour's. White that is clipped has none.
    """
    usable = samples.colours.min(-1, initial=1.0) < CLIPPED_VALUE
    shown = samples.colours[usable].astype(np.float64)
    if len(shown) < PIXELS or np.percentile(samples.behind.max(-1), THICK_PERCENTILE) >= MIN_SOURCE_VALUE:
        return ()
    if np.percentile(shown.max(-1), THICK_PERCENTILE) < MIN_SOURCE_VALUE:
        return ()
    off = _off_one_colour(shown)
    if off < COLOURED:
        return ()
    ends = np.cumsum(samples.amounts, dtype=np.intp)[:-1]
    frames = [
        part[used] for part, used in zip(*(np.split(each, ends) for each in (samples.colours, usable)), strict=True)
    ]
    apart = [_off_one_colour(frame.astype(np.float64)) for frame in frames if len(frame) >= PIXELS]
    kind = "smoke that changes its colour" if apart and np.median(apart) < COLOURED else "smoke of several colours"
    return (Doubt(kind, {"degrees": off}),)


def _off_one_colour(colours: Doubles) -> float:
    """Degrees by which light (n, 3) is off the one colour that explains the most of it, as root mean square."""
    along = np.linalg.eigvalsh(colours.T @ colours)
    return float(np.degrees(np.arcsin(np.sqrt(along[:-1].sum().clip(0) / along.sum()))))


def _line_of_colours(colours: Doubles, behind: Doubles) -> Doubles:
    """Direction (3,), of length 1, that explains most of what smoke (n, 3) changes of what is behind it."""
    change = colours - behind
    axis = np.linalg.eigh(change.T @ change)[1][:, -1]
    return np.asarray(axis if np.sum(change @ axis) >= 0 else -axis)


def _thickest(samples: SmokeSamples) -> tuple[Doubles, Doubles] | None:
    """Background and colour of the thickest smoke that is not clipped; None if there is too little of it."""
    clear = brightest_channel(samples.colours) < CLIPPED_VALUE
    if clear.sum() < max(PIXELS, 0.1 * len(clear)):
        return None
    colours, behind = (values[clear].astype(np.float64) for values in (samples.colours, samples.behind))
    change, axis = colours - behind, _line_of_colours(colours, behind)
    # a small error of the line is all of a dark colour: only the thickest pixels show that
    amount = change @ axis if samples.brightens else np.linalg.norm(change, axis=-1)
    thick = amount >= np.percentile(amount, THICK_PERCENTILE)
    start = np.maximum(behind[thick].mean(0), 0)
    seen = start + amount[thick].mean() * axis if samples.brightens else colours[thick].mean(0)
    return (start, np.maximum(seen, 0)) if seen.max() >= MIN_SOURCE_VALUE else None


def _sources(behind: Doubles, seen: Doubles) -> Doubles:
    """Source radiances (n, 3) that the line allows: from the smoke that is seen to where a channel is negative."""
    change = seen - behind
    falling = change < 0
    most = min((behind[falling] / -change[falling]).min(), 1e3) if falling.any() else 1e3
    return np.asarray(np.maximum(behind + np.geomspace(1, max(most, 1), 256)[:, None] * change, 0))


def _degrees(colours: Doubles, other: Doubles) -> Doubles:
    """Angle of colours (n, 3) from another."""
    length = np.linalg.norm(colours, axis=-1) * np.linalg.norm(other)
    return np.asarray(np.degrees(np.arccos(np.clip(colours @ other / np.maximum(length, 1e-12), -1, 1))))
