"""Remarks on the background of a clip: how it was found, and why the result may be wrong."""

from __future__ import annotations

import numpy as np

from smokelift.checks import Doubt, Remark
from smokelift.footage.backdrop import Backdrop, find_backdrop
from smokelift.footage.clip import Clip
from smokelift.footage.images import area_average
from smokelift.setup.first_estimate import SAMPLE_FRAMES, FirstEstimate, SmokeSamples, sample_smoke, unknown_part

BLACK = 0.001
"""Linear radiance below which a background is black: less than a third of the first step of 8 bit video."""

MOSTLY = 0.5
"""Share that is a majority: of the smoke's pixels, those whose background is unknown; of what bars enclose, the smoke
of a frame."""

BETWEEN_BARS = 0.95
"""Share of what two bars enclose, covered at some time, from which it is the picture and no smoke: smoke that crosses a
picture has no two straight edges. A generated clip with bars has .98; fog and mist have .70 and .75 over all of their
rows (docs/clips.md). Most of it has to be covered in a frame too, since a passing puff fills a strip in time."""

MIN_SAME_FRAMES = 4
"""Smallest number of frames in all of which smoke hardly looks the same by chance; in half of all pairs it does."""

COARSE_QUANTISER = 42.0
"""Quantiser from which faint smoke is taken for background, if that has more than one colour. Before a brick wall crf
32 has 37 at most, crf 36 has 41, and crf 45, which costs mass there, 44 to 50 (docs/experiments/background.md)."""


def first_remarks(estimate: FirstEstimate, given: bool) -> tuple[Remark, ...]:
    """Return what was assumed or noticed of a clip and its background, which may be ``given``; with the doubts."""
    found, samples, change = estimate.found, estimate.samples, estimate.samples.exposure
    return (
        *backdrop_remarks(found, not given and _between_bars(samples)),
        *((Remark("background unused"),) if found.source == "alpha" and given else ()),
        *doubts(found, samples, given),
        *_clearest(found, samples),
        *(() if change == 0 else (Remark("exposure", {"change": change}),)),
        *_possible_fire(estimate),
    )


def _clearest(found: Backdrop, samples: SmokeSamples) -> tuple[Remark, ...]:
    """The frame that shows most of a background of which a part is unknown, by its number in the file."""
    if found.source != "picture" or samples.clearest is None or not samples.unknown.any():
        return ()
    return (Remark("clearest frame", {"frame": found.clip.first + samples.clearest}),)


def _possible_fire(estimate: FirstEstimate) -> tuple[Doubt, ...]:
    """That some of what counts as smoke may be fire."""
    hot = estimate.hot
    if estimate.fire is not None or not hot.may_burn:
        return ()
    return (Doubt("possible fire", {"share": hot.share, "bright": hot.bright}),)


def backdrop_remarks(found: Backdrop, bars: bool = False) -> tuple[Remark, ...]:
    """Return how a background was found, and what stands before it if it has one colour, not that of ``bars``."""
    clip, plates = found.clip, found.plates
    painted = (*_registered(found), *_painted(found))
    if found.source == "alpha":
        return (Remark("alpha channel", {"behind": "white" if clip.backdrop else "black"}),)
    if found.source == "given":
        return painted
    if found.source == "picture":
        unknown = float(unknown_part(plates, clip, 0).mean())
        seen = Remark("background partly seen", {"unknown": unknown}) if unknown else Remark("background seen")
        return seen, *painted
    image = plates.at(0).image
    colour = image[0, 0]
    if not (image == colour).all():
        colour = np.median(image.reshape(-1, 3), axis=0)
    red, green, blue = map(float, colour)
    if bars or found.source == "black for want of a picture":
        return Remark("background assumed", {"color": (red, green, blue)}), *painted
    other = float((image != colour).any(-1).mean())
    black = max(red, green, blue) < BLACK
    return (
        Remark("black background") if black else Remark("background of one colour", {"color": (red, green, blue)}),
        *((Remark("background with objects", {"share": other}),) if other else ()),
        *painted,
    )


def _registered(found: Backdrop) -> tuple[Remark, ...]:
    """That the frames are registered, to which of them or to what is given, and by how much at most."""
    if found.motion is None:
        return ()
    pixels, frame = found.motion.reach(*found.clip.size), found.motion.reference
    if frame is None:
        return (Remark("frames registered to the plate", {"pixels": pixels}),)
    return (Remark("frames registered", {"pixels": pixels, "frame": frame}),)


def _painted(found: Backdrop) -> tuple[Remark, ...]:
    """That strokes were used, and how much of the picture each covers."""
    if found.strokes is None:
        return ()
    strokes = {"smoke": found.strokes.smoke, "other": found.strokes.other, "behind": found.strokes.behind}
    return (Remark("strokes", {name: float(painted.mean()) for name, painted in strokes.items()}),)


def doubts(found: Backdrop, samples: SmokeSamples, given: bool) -> tuple[Doubt, ...]:
    """Return why the result may be empty or wrong; ``given`` if the scene says the background."""
    clip, said = found.clip, []
    if not samples.smoky:
        said.append(Doubt("no smoke examined", {"frames": len(clip.spread(SAMPLE_FRAMES))}))
    if found.cut is not None:
        (before, after), last = found.cut, clip.first + len(clip) - 1
        said.append(Doubt("cut", {"before": before, "after": after, "first": clip.first, "last": last}))
    elif not samples.smoky:
        said.append(what_helps(clip, given))
    if found.source == "colour around one frame":
        said.append(Doubt("background of one frame"))
    if found.source == "black for want of a picture":
        said.append(Doubt("background never seen"))
    if found.source == "picture" and 1 < found.frames < MIN_SAME_FRAMES:
        said.append(Doubt("background of few frames", {"frames": found.frames}))
    if found.quantiser is not None and found.quantiser >= COARSE_QUANTISER:
        said.append(Doubt("strong compression", {"quantiser": found.quantiser}))
    unknown = samples.unknown
    if found.strokes is not None:  # what is painted as smoke is none of the background
        unknown = unknown & (area_average(found.strokes.smoke, *unknown.shape[::-1]) < MOSTLY)
    in_plate = unknown.sum() / max((unknown | samples.covered).sum(), 1)
    if in_plate >= MOSTLY:
        said.append(Doubt("smoke in the background", {"share": float(in_plate)}))
    if not given and _between_bars(samples):
        said.append(Doubt("bars"))
    return tuple(said)


def what_helps(clip: Clip, given: bool) -> Doubt:
    """Return what may help where no smoke is found; ``given`` as in `doubts`."""
    if clip.mask is not None and clip.mask.files and _shows_smoke(clip.as_filmed()):
        return Doubt("smoke behind the mask")
    if given:
        return Doubt("no smoke before the given background")
    if len(clip) == 1 and clip.backdrop is None:
        return Doubt("no smoke in one frame")
    return Doubt("no smoke before an estimated background")


def _shows_smoke(clip: Clip) -> bool:
    """Whether smoke is found in a clip of which nothing is given; not if its camera moves."""
    try:
        found = find_backdrop(clip, None, None)
    except ValueError:
        return False
    return bool(sample_smoke(found.clip, found.plates).smoky)


def _between_bars(samples: SmokeSamples) -> bool:
    """Whether bars beside the picture are all that is background."""
    at_a_time = len(samples.colours) / max(len(samples.gains), 1)
    for covered in (samples.covered, samples.covered.T):
        rows = np.flatnonzero(covered.any(1))
        if len(rows) and rows[0] > 0 and rows[-1] < len(covered) - 1:
            picture = covered[rows[0] : rows[-1] + 1]
            if picture.mean() >= BETWEEN_BARS and at_a_time > MOSTLY * picture.size:
                return True
    return False
