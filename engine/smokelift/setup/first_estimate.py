"""What a clip shows before camera, box, medium and light are known: its background, its smoke and its fire.

What is found of the background says how it was found, and why the result may be wrong.
"""

from collections.abc import Mapping
from contextlib import suppress
from dataclasses import dataclass, field, replace
from functools import partial

import numpy as np
from numpy.typing import NDArray

from smokelift.checks import Finding
from smokelift.density.observation import MAX_DARK_RADIANCE
from smokelift.extraction.element import alpha_source, shows_transmittance
from smokelift.extraction.find_background import FoundBackground, find_background
from smokelift.extraction.given_background import ALIKE, single_color
from smokelift.extraction.hidden_plate import SOURCE_FRAMES, plate_and_source
from smokelift.extraction.matte import HotPixels, fire_color, firelight, hot_pixels, matte, without_fire
from smokelift.extraction.plate import Plate, cleared
from smokelift.footage.clip import Clip
from smokelift.footage.images import Picture, area_average, linear_to_srgb, reduced_size
from smokelift.footage.video import median_quantizer
from smokelift.scene import Background, Camera, Medium
from smokelift.scene.checks import Vector

SAMPLE_FRAMES, SAMPLE_SIDE = 16, 320
"""Frames that are examined, so that smoke in a sixteenth of the clip is seen; and pixels along their longer side, five
to a voxel of a draft."""

UNKNOWN = 0.5
"""Confidence of a plate below which a background is unknown: it is as likely smoke as not."""

MAX_CLEAR_FRACTION = 0.5
"""Area of smoke before a known background in a frame, over the median of all examined ones, below which the frame has
much less smoke than most. Before an unknown background a frame without smoke differs from the plate."""

MAX_BLACK = 0.001
"""Linear radiance below which a background is black: less than a third of the first step of 8 bit video."""

MAJORITY = 0.5
"""Fraction that is a majority: of the smoke's pixels, those whose background is unknown; of what bars enclose, the
smoke of a frame; of what stands still, what is not a given background; of the light, what is not fire's."""

MIN_BARS_FRACTION = 0.95
"""Fraction of what two bars enclose, covered at some time, from which it is the picture and no smoke: smoke that
crosses a picture has no two straight edges. A generated clip with bars has .98; fog and mist have .70 and .75 over all
of their rows (docs/clips.md). Most of it has to be covered in a frame too, since a passing puff fills a strip in time.
"""

MIN_EVERYWHERE_FRACTION = 0.98
"""Fraction of a picture before one color, covered at some time, from which another color may be behind the smoke (and
most of a frame has to be covered): black ink before dark gray, which counts as gray smoke before black, covers 1.00, a
filmed plume before black .20 (measured)."""

MIN_SAME_FRAMES = 4
"""Smallest number of frames in all of which smoke hardly looks the same by chance; in half of all pairs it does."""

SOURCES, CHECKED_PIXELS = 25, 20_000
"""Numbers of source radiances, and of pixels, that are tried to explain how smoke changes its background."""

MAX_CONTRARY_FRACTION = 0.21
"""Largest part of the light that smoke adds and takes which is no smoke's before a given frame. Nine films before their
plate have .00 to .07, before 24 of their own frames .22 to .60. Real clips have .00 to .17 before seven clear frames,
.14 to .48 before six where somebody moved, .24 to .46 before nine with smoke; four with smoke are missed (measured)."""

MIN_COARSE_QUANTIZER = 42.0
"""Quantizer from which faint smoke is taken for background, if that has more than one color. Before a brick wall crf
32 has 37 at most, crf 36 has 41, and crf 45, which costs mass there, 44 to 50 (docs/experiments/background.md)."""


@dataclass(frozen=True, eq=False)
class SmokeSamples:
    """Where and how bright smoke is in some frames, at reduced size."""

    scale: float
    """Full pixels along a reduced one."""
    covered: NDArray[np.bool_]
    unknown: NDArray[np.bool_]
    """(rows, columns) bool: pixels with smoke, and pixels with an unknown background, in at least one sample."""
    colors: NDArray[np.float32]
    behind: NDArray[np.float32]
    """(n, 3): radiance of all smoke pixels, and of their background."""
    smoky: tuple[int, ...]
    """Numbers of the frames with smoke, those with the most first."""
    counts: tuple[int, ...] = ()
    """Numbers of smoke pixels of the samples with smoke, in the order of ``colors``."""
    over_known: Mapping[int, int] = field(default_factory=dict)
    """Numbers of smoke pixels before a known background in each sample, by frame number."""
    standing: float = 0.0
    """Of what stands still, or of half of the picture if that is more, the fraction that is smoke in every sample."""
    exposure: float = 0.0
    """Largest fraction by which the exposure of a sample was changed."""

    @property
    def typical(self) -> tuple[int, ...]:
        """Numbers of the frames that models are tried on: those with the most smoke and with the median amount."""
        return tuple(dict.fromkeys((*self.smoky[:1], *self.smoky[len(self.smoky) // 2 :][:1])))

    @property
    def clearest(self) -> int | None:
        """Number of the frame with the least smoke before a known background; None if none is much clearer."""
        if not self.over_known:
            return None
        number, least = min(self.over_known.items(), key=lambda pair: pair[1])
        return number if least < MAX_CLEAR_FRACTION * np.median(list(self.over_known.values())) else None

    @property
    def brightens(self) -> bool:
        """Whether smoke adds more light to what is behind it than it takes away."""
        change = np.sum(self.colors - self.behind, -1)
        return bool(np.sum(np.maximum(change, 0)) >= np.sum(np.maximum(-change, 0)))

    @property
    def change(self) -> float:
        """Radiance by which smoke changes its background, summed over its pixels and channels."""
        return float(np.abs(self.colors - self.behind).sum(dtype=np.float64))

    @property
    def contrary(self) -> float:
        """Part of the light by which smoke changes its background that leads away from its source radiance, or past it.

        Smoke moves every color towards that: one that explains most, gray or of the hue that changes most. If the
        background holds smoke, what the smoke leaves of it changes the other way, as far as it had changed that.
        """
        step = 1 + len(self.colors) // CHECKED_PIXELS
        behind, change = self.behind[::step], (self.colors - self.behind)[::step]
        fits, brightest = [], 1.5 * self.colors.max(initial=0)
        own = np.maximum(np.abs(change).sum(-1) @ self.colors[::step], 1e-9)
        hues = np.ones(3, np.float32), own / own.max()
        for source in (brightness * hue for hue in hues for brightness in np.linspace(0, brightest, SOURCES)):
            distance = np.linalg.norm(source - behind, axis=-1)
            along = np.sum(change * (source - behind), -1) / np.maximum(distance, 1e-9)
            wrong = np.abs(along - along.clip(0, distance))
            left = np.sqrt(np.maximum(np.sum(change**2, -1) - along**2 + wrong**2, 0))
            fits.append((float(left.sum()), float(wrong.sum() / max(np.abs(along).sum(), 1e-9))))
        return min(fits)[1]


@dataclass(frozen=True, eq=False)
class Fire:
    """What shines by itself.

    ``light`` is a clip of the added light in the place of smoke; ``color`` is its color in the clip.
    """

    light: Clip
    color: Vector


@dataclass(frozen=True, eq=False)
class FirstEstimate:
    """What a clip shows: its background, its smoke, and its fire if any burns.

    ``plate`` is ``found.plate``, refined where smoke hides it; ``clip`` is ``found.clip`` without fire. ``hot`` are the
    pixels that are fire, or may be. ``source`` (3,) is the usual source radiance of the smoke; None where the
    clip does not show its transmittance (`with_source`), and without smoke.
    """

    clip: Clip
    found: FoundBackground
    plate: Plate
    samples: SmokeSamples
    fire: Fire | None
    hot: HotPixels
    source: Picture | None


def first_estimate(
    clip: Clip,
    camera: Camera | None,
    background: Background | None,
    medium: Medium | None = None,
    *,
    by_hue: bool = False,
    with_fire: bool = False,
) -> FirstEstimate:
    """Estimate what a clip shows; other parameters and errors as of `find_background` and `with_source`.

    Where the ``medium`` that is given has a color of its flame there is fire, however little of it is certain. Its
    light is taken out, unless the smoke is asked for ``with_fire``.
    """
    flame_color = None if medium is None else medium.flame_color
    found = find_background(clip, camera, background)
    clip, plate = found.clip, found.plate
    samples = sample_smoke(clip, plate)
    fire, hot = None, hot_pixels(samples.colors, samples.behind)
    given = flame_color is not None and hot.fraction > 0
    if not given:
        # what shines through smoke and is part of the plate does not burn
        plate, source, samples = with_source(found, clip, samples, by_hue=by_hue)
    burning = hot_pixels(samples.colors, samples.behind)
    if (given or burning.burn) and not with_fire:
        doused = without_fire(clip, plate)
        light = firelight(clip, doused)
        fire, hot, clip = Fire(light, flame_color or fire_color(clip, light)), burning, doused
        plate, source, samples = with_source(found, clip, sample_smoke(clip, found.plate), by_hue=by_hue)
    if plate is not found.plate:
        clip = cleared(clip, plate)  # what a mask hides showed the plate as it was, and would be smoke before this one
    return FirstEstimate(clip, found, plate, samples, fire, hot, source)


def with_source(
    found: FoundBackground, clip: Clip, samples: SmokeSamples, *, by_hue: bool = False
) -> tuple[Plate, Picture | None, SmokeSamples]:
    """Return the plate of a clip, found in turn with its smoke, the usual source radiance (3,) of that, and samples.

    There is none before what does not show T: black, one color, or a given picture as good as one; of alpha that is a
    mask; and without smoke.
    Before one color a fit in a given light does as well with the picture itself. In an assumed one that makes holes of
    shaded sides; ``by_hue`` asks whether the color's hue shows T, unless it is dark or dark smoke seems to have it
    (docs/experiments/extraction.md).
    ``samples`` are those before the plate as it was found.
    """
    if not samples.smoky:
        return found.plate, None, samples
    if found.kind == "alpha":
        return found.plate, alpha_source(clip, found.plate, samples.smoky[:SOURCE_FRAMES], SAMPLE_SIDE), samples
    # a wall that was found is no even color, however little its light changes
    shown = visible_plate(found.plate, clip, samples.smoky[0])
    color = None if found.kind == "picture" else single_color(shown)
    if color is not None and not by_hue:
        return found.plate, None, samples
    plate, source = plate_and_source(clip, found.uncut_clip(clip), found.plate, samples.smoky)
    if color is not None and (color.max() <= MAX_DARK_RADIANCE * source.mean() or _of_hue(source, color)):
        return found.plate, None, samples
    if not shows_transmittance(visible_plate(plate, clip, samples.smoky[0]), source):
        return found.plate, None, samples
    if plate is not found.plate:
        # what no frame shows clear is unknown, although turns say what is behind it
        found_again = sample_smoke(cleared(clip, plate), plate)
        samples = replace(found_again, unknown=samples.unknown, over_known=samples.over_known)
    return plate, source, samples


def _of_hue(source: Picture, color: Picture) -> bool:
    """Whether a source radiance (3,) is nearer to a color's hue than to gray: it may be what smoke leaves of that."""
    own, behind = source / source.mean(), color / color.mean()
    return bool(np.linalg.norm(own - behind) < np.linalg.norm(own - 1))


def visible_plate(plate: Plate, clip: Clip, frame: int) -> Picture:
    """Return the plate (rows, columns, 3) of a frame; where a mask hides it, and no smoke is, the mean of the rest."""
    image, seen = plate.at(frame).image, clip.seen(frame, *clip.size)
    return image if seen is None else np.where(seen[..., None], image, image[seen].mean(0))


def unknown_part(plate: Plate, clip: Clip, number: int) -> NDArray[np.bool_]:
    """Return the pixels (rows, columns) whose background is unknown in a frame and not hidden by a mask."""
    unknown = plate.at(number).confidence < UNKNOWN
    seen = clip.seen(number, *unknown.shape[::-1])
    return unknown if seen is None else unknown & seen


def sample_smoke(clip: Clip, plate: Plate) -> SmokeSamples:
    """Find the smoke in frames spread over a clip at its plate's exposure."""
    width, height = clip.size
    scale = max(1.0, max(width, height) / SAMPLE_SIDE)
    columns, rows = reduced_size(width, height, SAMPLE_SIDE)
    covered, unknown = np.zeros((2, rows, columns), np.bool_)
    always, values = np.ones((rows, columns), np.bool_), []
    colors, behind = [], []
    over_known: dict[int, int] = {}
    counts: dict[int, int] = {}
    exposure = 0.0
    reduced = plate.through(lambda whole: area_average(whole, columns, rows), scale**2)
    for number in clip.spread(SAMPLE_FRAMES):
        picture, clear = clip.stored(number).averaged(columns, rows), reduced.at(number)
        exposure = max(exposure, float(np.expm1(np.abs(np.log(clip.gain(number))).max())))
        mask = matte(picture, clear).mask
        covered |= mask
        always &= mask
        values.append(linear_to_srgb(picture))
        hidden = unknown_part(reduced, clip, number)
        unknown |= hidden
        over_known[number] = int((mask & ~hidden).sum())
        colors.append(picture[mask])
        behind.append(clear.image[mask])
        if mask.any():
            counts[number] = int(mask.sum())
    smoky = tuple(sorted(counts, key=lambda number: -counts[number]))
    radiance = np.concatenate(colors), np.concatenate(behind)
    still = (np.ptp(values, axis=0) <= ALIKE).all(-1)
    standing = float((always & still).sum() / max(still.sum(), MAJORITY * still.size))
    of_frames = tuple(counts.values()), over_known
    return SmokeSamples(scale, covered, unknown, *radiance, smoky, *of_frames, standing, exposure)


def first_findings(estimate: FirstEstimate, given: bool) -> list[Finding]:
    """Return what was assumed or noticed of a clip and its background, which may be ``given``; with the doubts."""
    found, samples = estimate.found, estimate.samples
    said = background_findings(found, not given and _between_bars(samples))
    if found.kind == "alpha" and given:
        said.append(Finding("background unused"))
    said += doubts(found, samples, given)
    if found.kind == "picture" and samples.clearest is not None and samples.unknown.any():
        said.append(Finding("clearest frame", {"frame": found.clip.numbers[samples.clearest]}))
    if found.kind == "alpha" and samples.smoky and estimate.source is None:
        said.append(Finding("alpha is a mask", about="alpha", source="estimated"))
    if samples.exposure:
        said.append(Finding("exposure", {"change": samples.exposure}, about="exposure", source="measured"))
    return said


def is_given(background: Background | None, found: FoundBackground) -> bool:
    """Whether a scene says what is behind the smoke: an alpha channel leaves only strokes to be given in vain."""
    # with an alpha channel, which leaves no background to estimate, strokes alone count as a given one
    return background is not None and (not background.estimated or found.kind == "alpha")


def background_findings(found: FoundBackground, bars: bool = False) -> list[Finding]:
    """Return how a background was found, and what stands before it if it has one color, not that of ``bars``."""
    said = _how_found(found, bars)
    if found.motion is not None:
        figures: dict[str, float] = {"pixels": found.motion.reach(*found.clip.size)}
        if found.motion.reference is None:
            said.append(Finding("frames registered to the plate", figures))
        else:
            said.append(Finding("frames registered", {**figures, "frame": found.motion.reference}))
    if found.strokes is not None:
        strokes = {"smoke": found.strokes.smoke, "other": found.strokes.other, "behind": found.strokes.behind}
        said.append(Finding("strokes", {name: float(painted.mean()) for name, painted in strokes.items()}))
    return said


def _how_found(found: FoundBackground, bars: bool) -> list[Finding]:
    """What is behind the smoke; nothing if it is given."""
    clip, plate = found.clip, found.plate
    background = partial(Finding, about="background", source="estimated")
    if found.kind == "alpha":
        return [background("alpha channel", {"behind": "white" if clip.alpha_background else "black"})]
    if found.kind == "given":
        return []
    if found.kind == "picture":
        unknown = float(unknown_part(plate, clip, 0).mean())
        return [
            background("background partly seen", {"unknown": unknown}) if unknown else background("background seen")
        ]
    image = plate.at(0).image
    color = np.median(image.reshape(-1, 3), axis=0)
    red, green, blue = map(float, color)
    figures = {"color": (red, green, blue)}
    if bars or found.kind == "black for want of a picture":
        return [background("background assumed", figures, source="assumed")]
    other = float((image != color).any(-1).mean())
    objects = [Finding("background with objects", {"fraction": other})] if other else []
    if max(red, green, blue) < MAX_BLACK:
        return [background("black background"), *objects]
    return [background("background of one color", figures), *objects]


def doubts(found: FoundBackground, samples: SmokeSamples, given: bool) -> list[Finding]:
    """Return why the result may be empty or wrong; ``given`` if the scene says the background."""
    clip, doubt = found.clip, partial(Finding, doubt=True)
    said = []
    if not samples.smoky:
        said.append(doubt("no smoke examined", {"frames": len(clip.spread(SAMPLE_FRAMES))}))
    if found.cut is not None:
        before, after = found.cut
        first, last = clip.numbers[0], clip.numbers[-1]
        said.append(doubt("cut", {"before": before, "after": after, "first": first, "last": last}))
    elif not samples.smoky:
        painted = found.strokes is not None and bool((found.strokes.other | found.strokes.behind).any())
        said.append(what_helps(clip, given, painted))
    if found.kind == "color around one frame":
        said.append(doubt("background of one frame"))
    if found.kind == "black for want of a picture":
        green = found.strokes is not None and found.strokes.smoke.any()
        said.append(doubt("background never seen beside strokes" if green else "background never seen"))
    enough = len(samples.over_known) >= MIN_SAME_FRAMES
    if found.kind == "given" and enough and samples.standing > MAJORITY:
        said.append(doubt("given background never seen", {"fraction": samples.standing}))
    elif (
        found.background is not None
        and found.background.frame
        and not hot_pixels(samples.colors, samples.behind).burn
        and samples.contrary > MAX_CONTRARY_FRACTION
    ):
        said.append(doubt("smoke in the given frame", {"fraction": samples.contrary}))
    covered = _covered_at_a_time(samples) / samples.covered.size
    if found.kind == "color" and samples.covered.mean() >= MIN_EVERYWHERE_FRACTION and covered > MAJORITY:
        said.append(doubt("smoke everywhere", {"fraction": covered}))
    if found.kind == "picture" and 1 < found.frames < MIN_SAME_FRAMES:
        said.append(doubt("background of few frames", {"frames": found.frames}))
    quantizer = median_quantizer(clip.path) if found.kind == "picture" else None
    if quantizer is not None and quantizer >= MIN_COARSE_QUANTIZER:
        said.append(doubt("strong compression", {"quantizer": quantizer}))
    unknown = samples.unknown
    if found.strokes is not None:  # what is painted as smoke is none of the background
        unknown = unknown & (area_average(found.strokes.smoke, *unknown.shape[::-1]) < MAJORITY)
    in_plate = unknown.sum() / max((unknown | samples.covered).sum(), 1)
    if in_plate >= MAJORITY:
        said.append(doubt("smoke in the background", {"fraction": float(in_plate)}))
    if not given and _between_bars(samples):
        said.append(doubt("bars"))
    return said


def what_helps(clip: Clip, given: bool, painted: bool) -> Finding:
    """Return what may help where no smoke is found; ``given`` as in `doubts`, ``painted`` if strokes hide anything."""
    if clip.mask is not None and clip.mask.files:
        with suppress(ValueError):  # the camera moves
            found = find_background(clip.as_filmed(), None, None)
            if sample_smoke(found.clip, found.plate).smoky:
                return Finding("smoke behind the mask", doubt=True)
    if clip.alpha_background is not None:
        return Finding("no smoke in alpha", doubt=True)
    if painted:
        return Finding("no smoke beside strokes", doubt=True)
    if given:
        return Finding("no smoke before the given background", doubt=True)
    if len(clip) == 1:
        return Finding("no smoke in one frame", doubt=True)
    return Finding("no smoke before an estimated background", doubt=True)


def _between_bars(samples: SmokeSamples) -> bool:
    """Whether bars beside the picture are all that is background."""
    at_a_time = _covered_at_a_time(samples)
    for covered in (samples.covered, samples.covered.T):
        rows = np.flatnonzero(covered.any(1))
        if len(rows) and rows[0] > 0 and rows[-1] < len(covered) - 1:
            picture = covered[rows[0] : rows[-1] + 1]
            if picture.mean() >= MIN_BARS_FRACTION and at_a_time > MAJORITY * picture.size:
                return True
    return False


def _covered_at_a_time(samples: SmokeSamples) -> float:
    """Pixels that smoke covers in a frame, on the mean."""
    return len(samples.colors) / max(len(samples.over_known), 1)
