"""The medium that a shot's smoke is, what color it has, the light, and how the smoke scatters it.

    what the scene gives, or the color of the smoke's pixels -> the medium                              find_medium
    what the scene gives, or the smoke's source radiance -> a light, the richest scattering it allows   find_light
    coarse densities in it -> the cheapest scattering that is as good                                   find_scattering

The last is judged by `coarse.held_out`. Figures: docs/selection.md, docs/experiments/unknown-light.md.

A pixel shows T behind + (1 - T) source, where the source radiance is the light times the smoke's color. So the source
lies on the line from the background through the smoke, beyond the thickest smoke that is seen. Before black that line
has one color, else many. Smoke has a color of its own if no source on the line has one that light may have: white, as
cameras balance it, or the background's, which stands in the same light.
"""

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np

from smokelift.checks import UNDETERMINED, Doubles, Figures, Finding
from smokelift.extraction.element import SOURCE_SIDE, clip_element
from smokelift.extraction.matte import CLIPPED_VALUE, MIN_COLORED_VALUE
from smokelift.footage.images import Picture, brightest_channel, channel_mean, reduced_size
from smokelift.footage.noise import Noise
from smokelift.render import scene_optics
from smokelift.render.environment import environment_count
from smokelift.scene import (
    SCATTERINGS,
    SHADOWED,
    Background,
    Camera,
    CompleteScene,
    DirectionalLight,
    Domain,
    EnvironmentLight,
    Light,
    Medium,
    Scattering,
    Scene,
)
from smokelift.scene.checks import Vector
from smokelift.setup.coarse import SCATTERING_TOLERANCE, CoarseFrame, held_out
from smokelift.setup.first_estimate import FirstEstimate, SmokeSamples
from smokelift.setup.geometry import Geometry
from smokelift.setup.settings import Settings

OPTICAL_DEPTH_AT_ONE = 5.0
"""Optical depth across the domain of smoke of density 1 if no medium is given: thick, not solid. It is a convention,
since a picture shows density times extinction only."""

SOURCE_EXCESS = 0.1
"""Fraction by which the source exceeds the smoke's 99th percentile, whose optical depth is then about 2.4."""

MIN_COLOR_DEGREES = 12.0
"""Degrees between two colors, as vectors of linear light, from which white balance does not explain their difference.
Gray world and its kin are wrong by 5 to 6 degrees on the mean and by 10 in the worst quarter of pictures (Gijsenij,
Gevers and van de Weijer, "Computational color constancy: survey and experiments", 2011)."""

THICK_PERCENTILE = 90
"""Percentile of the change from which smoke is measured: the thickest is nearest to the source."""

MIN_COLOR_PIXELS = 50
"""Smallest number of smoke pixels that show a color: their thickest tenth are five."""

WHITE: Vector = (1.0, 1.0, 1.0)
"""Color of gray smoke (by definition)."""

MAX_ERROR_RATIO = 0.75
"""Error of multiple over single scattering, below which multiple is taken. It is 0.01 to 0.63 for traced paths, unless
either model fits, and from 0.82 for light scattered once (docs/experiments/scattering.md)."""

MIN_DESCENT_STEPS = 64
"""Steps of descent of a fit where models differ little: enough for every fit to end by itself. One that is cut off has
the error of the steps that it lacks (docs/experiments/scattering.md)."""

MAX_LIGHT_ERROR = 0.12
"""Error of held-out pixels, as a fraction of the smoke's contrast, from which an assumed light before one color is
likely wrong: from there the mass was off by 1.5 and more in 38 of 42 clips, below in 34 of 86
(docs/experiments/unknown-light.md)."""

MAX_COLOR_SPREAD = 0.1
"""Largest spread of a background of one color, as a fraction of its brightness."""

MAX_QUIET_NOISE = 2 / 255
"""Largest noise, in sRGB values, that does not explain the error itself (docs/experiments/unknown-light.md)."""

LIT_PERCENTILE = 90
"""Percentile of what thick smoke sends that an assumed light has to reach: with 99 T of three composed clips is off by
.02 to .04 more, with 75 the picture of a real one loses 2 dB (measured)."""


def find_medium(scene: Scene, estimate: FirstEstimate, camera: Camera, domain: Domain) -> tuple[Medium, list[Finding]]:
    """Complete the medium, with its flame's color if fire burns; return what was found of it too."""
    medium, samples, fire = scene.medium, estimate.samples, estimate.fire
    flame_color = None if medium is None else medium.flame_color
    found: list[Finding] = []
    if medium is None or (flame_color is not None and medium == Medium(flame_color=flame_color)):
        medium = Medium(OPTICAL_DEPTH_AT_ONE / min(domain.size), flame_color=flame_color)
        figures = {"extinction": medium.extinction, "albedo": medium.albedo}
        found.append(Finding("assumed medium", figures, about="medium", source="assumed"))
        color, colored = smoke_color(samples, _light_color(scene.lights, camera, domain, medium))
        medium = replace(medium, color=color)
        found.append(colored)
    found += several_colors(samples)
    if fire is not None:
        (red, green, blue), fraction = fire.color, estimate.hot.fraction
        figures = {"fraction": fraction, "red": red, "green": green, "blue": blue}
        found.append(Finding("fire", figures, about="fire", value=fraction, source="measured"))
        medium = replace(medium, flame_color=fire.color)
    elif estimate.hot.may_burn:
        # without pixels of fire's own colors a flame's color that is given finds none
        kind = "possible fire" if estimate.hot.fraction else "possible faint fire"
        found.append(Finding(kind, {"fraction": estimate.hot.possible}, doubt=True))
    return medium, found


def _light_color(lights: tuple[Light, ...], camera: Camera, domain: Domain, gray: Medium) -> Doubles:
    """Color (3,) of the light in the middle of a box, the largest 1; ones where no light is known."""
    # only the sum of an environment's directions counts, so one stands for all
    few = tuple(replace(each, directions=1) if isinstance(each, EnvironmentLight) else each for each in lights)
    scene = CompleteScene(
        camera=camera, domain=domain, medium=gray, lights=few, background=Background(), scattering="single"
    )
    source = scene_optics(scene).unshadowed_source()
    return source / source.max() if source.max() > 0 else np.ones(3)


def source_radiance(samples: SmokeSamples) -> Doubles:
    """Return the source radiance (3,) of the smoke by its brightness; white if the clip shows none.

    Thick smoke shows it: the brightest if smoke brightens its background, the darkest if it darkens it.
    """
    if len(samples.colors) == 0:
        return np.ones(3)
    if not samples.brightens:
        return np.asarray((1 - SOURCE_EXCESS) * np.percentile(samples.colors, 1, axis=0))
    # on the line of colors: the channels' maxima may be of different smoke, and together a color that none shows
    colors, behind = samples.colors.astype(np.float64), samples.behind.astype(np.float64)
    axis, start = _line_of_colors(colors, behind), behind.mean(0)
    farthest = start + (np.percentile(colors @ axis, 99) - start @ axis) * axis
    return np.asarray(np.maximum(farthest + SOURCE_EXCESS * np.linalg.norm(farthest) * axis, 0))


def smoke_color(samples: SmokeSamples, light: Doubles) -> tuple[Vector, Finding]:
    """Return the smoke's own color in a light (3,), and what decided it.

    An unknown light is ones. The color's largest channel is 1; it is white unless the clip shows that it is not gray.
    """
    figures = {"tolerance": MIN_COLOR_DEGREES}
    undetermined = Finding("smoke color unseen", figures, about="smoke color", value=UNDETERMINED, source="assumed")
    line = _thickest_smoke(samples)
    if line is None:
        return WHITE, undetermined
    behind, seen = line
    sources = _sources(behind, seen)
    white = _degrees(sources, light)
    least = np.minimum(white, _degrees(sources, behind)) if behind.max() > MIN_COLORED_VALUE else white
    if least.min() < MIN_COLOR_DEGREES:
        figures["degrees"] = float(least.min())
        return WHITE, replace(undetermined, kind="smoke color near the light's", figures=figures)
    # the palest that explains the clip
    own = sources[white.argmin()] / np.maximum(light, 1e-6)
    red, green, blue = (float(round(v, 3)) for v in own / own.max())
    figures["degrees"] = float(white.min())
    color = red, green, blue
    return color, Finding("measured smoke color", figures, about="smoke color", value=color, source="measured")


def several_colors(samples: SmokeSamples) -> list[Finding]:
    """Return a doubt if smoke before black has more than one color, at a time or one after the other.

    Smoke of one color has that color before black, however thick it is. So what is off the color that explains most
    of the light is another color's. Clipped white shows none.
    """
    shown = samples.colors[samples.colors.min(-1, initial=1.0) < CLIPPED_VALUE].astype(np.float64)
    if len(shown) < MIN_COLOR_PIXELS or np.percentile(samples.behind.max(-1), THICK_PERCENTILE) >= MIN_COLORED_VALUE:
        return []
    if np.percentile(shown.max(-1), THICK_PERCENTILE) < MIN_COLORED_VALUE:
        return []
    off = _degrees_off_one_color(shown)
    if off < MIN_COLOR_DEGREES:
        return []
    ends = np.cumsum(samples.counts, dtype=np.intp)[:-1]
    frames = [part[part.min(-1, initial=1.0) < CLIPPED_VALUE] for part in np.split(samples.colors, ends)]
    apart = [_degrees_off_one_color(frame.astype(np.float64)) for frame in frames if len(frame) >= MIN_COLOR_PIXELS]
    changes = apart and np.median(apart) < MIN_COLOR_DEGREES
    kind = "smoke that changes its color" if changes else "smoke of several colors"
    return [Finding(kind, {"degrees": off}, doubt=True)]


def _degrees_off_one_color(colors: Doubles) -> float:
    """Root mean square of the degrees by which light (n, 3) is off the one color that explains most of it."""
    along = np.linalg.eigvalsh(colors.T @ colors)
    return float(np.degrees(np.arcsin(np.sqrt(along[:-1].sum().clip(0) / along.sum()))))


def _line_of_colors(colors: Doubles, behind: Doubles) -> Doubles:
    """Unit vector (3,) that explains most of how smoke (n, 3) changes its background."""
    change = colors - behind
    axis = np.linalg.eigh(change.T @ change)[1][:, -1]
    return np.asarray(axis if np.sum(change @ axis) >= 0 else -axis)


def _thickest_smoke(samples: SmokeSamples) -> tuple[Doubles, Doubles] | None:
    """Background (3,) and color (3,) of the thickest smoke that is not clipped; None if there is too little."""
    clear = brightest_channel(samples.colors) < CLIPPED_VALUE
    if clear.sum() < max(MIN_COLOR_PIXELS, 0.1 * len(clear)):
        return None
    colors, behind = (values[clear].astype(np.float64) for values in (samples.colors, samples.behind))
    change, axis = colors - behind, _line_of_colors(colors, behind)
    # a small error of the line is all of a dark color, so that comes from the thickest pixels themselves
    amount = change @ axis if samples.brightens else np.linalg.norm(change, axis=-1)
    thick = amount >= np.percentile(amount, THICK_PERCENTILE)
    start = np.maximum(behind[thick].mean(0), 0)
    seen = start + amount[thick].mean() * axis if samples.brightens else colors[thick].mean(0)
    return (start, np.maximum(seen, 0)) if seen.max() >= MIN_COLORED_VALUE else None


def _sources(behind: Doubles, seen: Doubles) -> Doubles:
    """Source radiances (n, 3) on the line: from the smoke that is seen to where a channel gets negative."""
    change = seen - behind
    falling = change < 0
    most = min((behind[falling] / -change[falling]).min(), 1e3) if falling.any() else 1e3
    return np.asarray(np.maximum(behind + np.geomspace(1, max(most, 1), 256)[:, None] * change, 0))


def _degrees(colors: Doubles, other: Doubles) -> Doubles:
    """Degrees (n,) between colors (n, 3) and another (3,)."""
    length = np.linalg.norm(colors, axis=-1) * np.linalg.norm(other)
    return np.asarray(np.degrees(np.arccos(np.clip(colors @ other / np.maximum(length, 1e-12), -1, 1))))


def find_light(
    lights: tuple[Light, ...],
    scattering: Scattering | None,
    geometry: Geometry,
    medium: Medium,
    estimate: FirstEstimate,
) -> tuple[tuple[Light, ...], Scattering, list[Finding]]:
    """Return the lights of a scene, or one from everywhere without shadows, as strong as the clip shows.

    An environment gets the number of directions that stand for it. Returned next is the given model of scattering, or
    the richest that the lights allow. Where light is needed but not given, the findings say how bright it is.
    Shadows without a light to cast them are a ValueError.
    """
    if scattering in SHADOWED and not lights:
        raise ValueError(
            f'Scattering "{scattering}" needs a light that casts the shadows; give one, or leave scattering to "auto".'
        )
    richest = scattering or ("absorption" if medium.albedo == 0 else "single" if lights else "unshadowed")
    if lights or richest == "absorption":
        camera, whole = geometry.camera.at(0), list(lights)
        for number, each in enumerate(lights):
            if isinstance(each, EnvironmentLight) and each.directions is None:
                count = environment_count(each, camera, geometry.domain, medium)
                whole[number] = replace(each, directions=count)
        return tuple(whole), richest, []
    found, about = estimate.source, "source radiance"
    if found is None:
        source = source_radiance(estimate.samples)
        shown = Finding(f"undetermined {about}", about=about, value=UNDETERMINED, source="assumed")
    else:
        source = found * max(1.0, brightest_smoke(estimate, found) / float(found.mean()))
        red, green, blue = map(float, found)
        figures: Figures = {"red": red, "green": green, "blue": blue}
        shown = Finding(about, figures, about=about, value=(red, green, blue), source="measured")
    shown = replace(shown, figures={"taken": tuple(source.tolist()), **shown.figures})
    scattered = np.array(medium.albedos) / (4 * np.pi)
    red, green, blue = np.divide(source, scattered, out=np.zeros(3), where=scattered > 0).tolist()
    light = DirectionalLight((0.0, 0.0, -1.0), (red, green, blue))
    assumed = Finding("assumed light", {"irradiance": light.irradiance}, source="assumed")
    return (light,), richest, [assumed, shown]


def brightest_smoke(estimate: FirstEstimate, source: Picture) -> float:
    """Return the radiance that the brightest thick smoke of a frame sends, S of its element; 0 without any.

    ``source`` (3,) is the usual one. Without shadows no smoke is brighter than the light makes all of it.
    """
    clip, frame = estimate.clip, estimate.samples.smoky[0]
    element = clip_element(clip, frame, estimate.plate, source, reduced_size(*clip.size, SOURCE_SIDE))
    sent = channel_mean(element.radiance)[element.transmittance < 0.5]
    return float(np.percentile(sent, LIT_PERCENTILE)) if sent.size else 0.0


def light_doubts(scattering: Finding, samples: SmokeSamples, noise: Noise, *, burns: bool) -> list[Finding]:
    """A doubt if an assumed light leaves much unexplained; ``burns`` if there is fire.

    It is said only before one color that is not black, nor of a hue that shows how much passes. What moves there is
    smoke, and its brightness shows its light, so the light itself is at fault.
    """
    error = scattering.figures.get(f"error_{scattering.value}", 0.0)
    assert isinstance(error, float)
    if error < MAX_LIGHT_ERROR or not len(samples.behind) or noise.total.max() > MAX_QUIET_NOISE:
        return []
    low, high = np.percentile(samples.behind.max(-1), (5, 95))
    if high < MIN_COLORED_VALUE or high - low > MAX_COLOR_SPREAD * high:
        return []
    return [Finding("light of fire" if burns else "likely wrong light", {"error": error}, doubt=True)]


def find_scattering(
    frames: Sequence[CoarseFrame], finer: Callable[[], CoarseFrame | None], settings: Settings
) -> tuple[Scattering, Finding]:
    """Return the cheapest model of scattering that finds as good a density as the richest, which judges all.

    Single scattering is no special case of multiple scattering, which makes the same smoke brighter. Where both fit a
    picture, one is twice as dense as the other (docs/experiments/scattering.md). So multiple scattering is the
    richest only if it fits its own picture clearly better. Neither is the cheaper answer, so the tolerance of cheaper
    models does not apply. Errors are compared as a ratio, in which what no model fits counts for both.

    ``frames`` (one at least) have the richest model that their light allows. ``finer`` returns one of them on twice the
    voxels, or None; it is asked if the models are nearly alike on these.
    """
    fit, tolerance = settings.density, SCATTERING_TOLERANCE
    richest, isotropic = frames[0].scene.scattering, frames[0].scene.medium.anisotropy == 0.0
    candidates: tuple[Scattering, ...] = ("single", "multiple") if richest == "single" and isotropic else (richest,)
    errors = {each: held_out(frames, each, each, fit).error for each in candidates}
    if len(candidates) > 1:
        alike = errors["multiple"] >= MAX_ERROR_RATIO * errors["single"]
        # the errors may be the coarse grid's: either model seems to fit, or neither
        if alike and (larger := finer()) is not None and larger.scene.domain != frames[0].scene.domain:
            frames = [larger]
            fit = replace(fit, descent_iterations=max(MIN_DESCENT_STEPS, fit.descent_iterations))
            errors = {each: held_out(frames, each, each, fit).error for each in candidates}
        if errors["multiple"] < MAX_ERROR_RATIO * errors["single"]:
            richest = "multiple"
    chosen = richest
    cheaper = SCATTERINGS[SCATTERINGS.index(richest) + 1 :]
    for model in reversed(cheaper):
        errors[model] = min(held_out(frames, model, richest, fit).error, 1.0)  # which no smoke at all leaves
        if errors[model] <= errors[richest] + tolerance:
            chosen = model
            break
    figures: Figures = {**{f"error_{name}": value for name, value in errors.items()}, "tolerance": tolerance}
    found = Finding("scattering", figures, about="scattering", value=chosen, source="measured")
    if len(errors) == 1:
        return chosen, found
    # the one that it is compared with is the richest, or the next cheaper one if it is the richest itself
    other = cheaper[0] if chosen == richest else richest
    figures = {**figures, "error": errors[chosen], "other": other, "other_error": errors[other]}
    return chosen, replace(found, kind="compared scattering", figures=figures)
