"""What is found of the background of a clip: how it was found, and why the result may be wrong."""

from contextlib import suppress
from functools import partial

import numpy as np

from smokelift.checks import Finding
from smokelift.extraction.find_background import FoundBackground, find_background
from smokelift.footage.clip import Clip
from smokelift.footage.images import area_average
from smokelift.footage.video import median_quantizer
from smokelift.setup.first_estimate import SAMPLE_FRAMES, FirstEstimate, SmokeSamples, sample_smoke, unknown_part

MAX_BLACK = 0.001
"""Linear radiance below which a background is black: less than a third of the first step of 8 bit video."""

MAJORITY = 0.5
"""Fraction that is a majority: of the smoke's pixels, those whose background is unknown; of what bars enclose, the
smoke of a frame."""

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

MIN_COARSE_QUANTIZER = 42.0
"""Quantizer from which faint smoke is taken for background, if that has more than one color. Before a brick wall crf
32 has 37 at most, crf 36 has 41, and crf 45, which costs mass there, 44 to 50 (docs/experiments/background.md)."""


def first_findings(estimate: FirstEstimate, given: bool) -> list[Finding]:
    """Return what was assumed or noticed of a clip and its background, which may be ``given``; with the doubts."""
    found, samples, hot = estimate.found, estimate.samples, estimate.hot
    said = background_findings(found, not given and _between_bars(samples))
    if found.source == "alpha" and given:
        said.append(Finding("background unused"))
    said += doubts(found, samples, given)
    if found.source == "picture" and samples.clearest is not None and samples.unknown.any():
        said.append(Finding("clearest frame", {"frame": found.clip.numbers[samples.clearest]}))
    if samples.exposure:
        said.append(Finding("exposure", {"change": samples.exposure}, about="exposure", source="measured"))
    if estimate.fire is None and hot.may_burn:
        said.append(Finding("possible fire", {"fraction": hot.fraction, "bright": hot.bright}, doubt=True))
    return said


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
    if found.source == "alpha":
        return [background("alpha channel", {"behind": "white" if clip.alpha_background else "black"})]
    if found.source == "given":
        return []
    if found.source == "picture":
        unknown = float(unknown_part(plate, clip, 0).mean())
        return [
            background("background partly seen", {"unknown": unknown}) if unknown else background("background seen")
        ]
    image = plate.at(0).image
    color = np.median(image.reshape(-1, 3), axis=0)
    red, green, blue = map(float, color)
    figures = {"color": (red, green, blue)}
    if bars or found.source == "black for want of a picture":
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
        said.append(what_helps(clip, given))
    if found.source == "color around one frame":
        said.append(doubt("background of one frame"))
    if found.source == "black for want of a picture":
        said.append(doubt("background never seen"))
    covered = _covered_at_a_time(samples) / samples.covered.size
    if found.source == "color" and samples.covered.mean() >= MIN_EVERYWHERE_FRACTION and covered > MAJORITY:
        said.append(doubt("smoke everywhere", {"fraction": covered}))
    if found.source == "picture" and 1 < found.frames < MIN_SAME_FRAMES:
        said.append(doubt("background of few frames", {"frames": found.frames}))
    quantizer = median_quantizer(clip.path) if found.source == "picture" else None
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


def what_helps(clip: Clip, given: bool) -> Finding:
    """Return what may help where no smoke is found; ``given`` as in `doubts`."""
    if clip.mask is not None and clip.mask.files:
        with suppress(ValueError):  # the camera moves
            found = find_background(clip.as_filmed(), None, None)
            if sample_smoke(found.clip, found.plate).smoky:
                return Finding("smoke behind the mask", doubt=True)
    if given:
        return Finding("no smoke before the given background", doubt=True)
    if len(clip) == 1 and clip.alpha_background is None:
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
