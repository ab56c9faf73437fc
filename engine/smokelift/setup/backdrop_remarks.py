"""What a user should know of what stands behind the smoke: how it was found, and why it may be wrong."""

from __future__ import annotations

import numpy as np

from smokelift.checks import Doubt, Remark
from smokelift.footage.backdrop import Backdrop
from smokelift.footage.clip import Clip
from smokelift.footage.exposure import largest_change, small
from smokelift.footage.plate import Plate, Plates
from smokelift.footage.steady import exposures
from smokelift.setup.smoke import SAMPLE_FRAMES, SmokeSamples, unknown_part

BLACK = 0.001
"""Linear radiance below which a background is called black."""

EXPOSURE_SAMPLES = 16
"""Frames whose exposure is measured before a run."""

MOSTLY = 0.5
"""Share from which on it is most of a whole: of the smoke's pixels, those without a known background; of a picture,
those that differ from one colour; of what lies between bars, the smoke of a frame."""

BETWEEN_BARS = 0.95
"""Share of the picture between two bars which smoke covers at some time there, if it is not the picture itself: smoke
that crosses all of a picture has no two straight edges. A generated clip with bars has .98, fog and mist .70 and .75
over all of their rows (docs/clips.md). Each frame shows most of that picture, while a puff that passes fills a strip in
the course of time."""

MIN_SAME_FRAMES = 4
"""Frames from which on smoke hardly looks the same in all by chance: half of its pairs of successive samples do."""

COARSE_QUANTISER = 42.0
"""Quantiser from which on faint smoke is taken for background, in front of one of more than one colour. Before a brick
wall crf 32 has 37 at most, crf 36 has 41, and crf 45, which costs mass there, 44 to 50
(docs/experiments/disturbed-clips.md)."""

LARGE_NOISE = 6 / 255
"""Noise in sRGB values from which on the background may be what moves (docs/experiments/background.md)."""


def backdrop_remarks(found: Backdrop) -> tuple[Remark, ...]:
    """How a background was found."""
    clip, plates = found.clip, found.plates
    if found.source == "alpha":
        return (Remark("alpha channel", {"behind": "white" if clip.backdrop else "black"}),)
    if found.source == "given":
        return ()
    assert isinstance(plates, Plate)
    return _still(plates, clip)


def backdrop_doubts(found: Backdrop) -> tuple[Doubt, ...]:
    """Why a background may be wrong."""
    if found.source == "colour around one frame":
        return (Doubt("background of one frame"),)
    if found.source == "black for want of a picture":
        return (Doubt("background never seen"),)
    few = found.source == "picture" and 1 < found.frames < MIN_SAME_FRAMES
    compressed = found.quantiser is not None and found.quantiser >= COARSE_QUANTISER
    return (
        *((Doubt("background of few frames", {"frames": found.frames}),) if few else ()),
        *((Doubt("strong compression", {"quantiser": found.quantiser or 0.0}),) if compressed else ()),
    )


def cut_doubts(found: Backdrop) -> tuple[Doubt, ...]:
    """A doubt about a clip with a cut."""
    if found.cut is None:
        return ()
    (last, first), clip = found.cut, found.clip
    return (Doubt("cut", {"before": last, "after": first, "first": clip.first, "last": clip.first + len(clip) - 1}),)


def exposure_change(clip: Clip, plates: Plates) -> float:
    """Return by which share the exposure of a clip differs from its background's at most; 0 if it never does."""
    gains_of = exposures(plates)
    return largest_change([gains_of(number, small(clip.frame(number))) for number in clip.spread(EXPOSURE_SAMPLES)])


def exposure_remarks(change: float) -> tuple[Remark, ...]:
    """A remark on a clip whose exposure changes by a share."""
    return () if change == 0 else (Remark("exposure", {"change": change}),)


def smoke_in_plate(samples: SmokeSamples) -> tuple[Doubt, ...]:
    """A doubt about a background that may hold most of the smoke."""
    share = samples.unknown.sum() / max((samples.unknown | samples.covered).sum(), 1)
    return () if share < MOSTLY else (Doubt("smoke in the background", {"share": float(share)}),)


def between_bars(samples: SmokeSamples) -> tuple[Doubt, ...]:
    """A doubt about a clip of which only bars beside the picture are background."""
    at_a_time = len(samples.colours) / max(len(samples.gains), 1)
    for covered in (samples.covered, samples.covered.T):
        rows = np.flatnonzero(covered.any(1))
        if len(rows) and rows[0] > 0 and rows[-1] < len(covered) - 1:
            picture = covered[rows[0] : rows[-1] + 1]
            if picture.mean() >= BETWEEN_BARS and at_a_time > MOSTLY * picture.size:
                return (Doubt("bars"),)
    return ()


def nothing_seen(
    clip: Clip, plates: Plates, samples: SmokeSamples, given: bool, cuts: tuple[Doubt, ...]
) -> tuple[Doubt, ...]:
    """Two doubts, before a run, about a clip whose samples show no smoke: that there is any, and what may show it.

    Parameters
    ----------
    clip
        The footage.
    plates, given
        What is behind the smoke, and whether the scene says so.
    samples
        The frames that were examined.
    cuts
        The `cut_doubts` of the clip.
    """
    if samples.smoky:
        return ()
    nothing = Doubt("no smoke examined", {"frames": len(clip.spread(SAMPLE_FRAMES))})
    return (nothing, *(cuts or (what_helps(clip, plates, given),)))


def what_helps(clip: Clip, plates: Plates, given: bool) -> Doubt:
    """What may show the smoke of a clip in which none is found; see `nothing_seen`."""
    if given:
        return Doubt("no smoke before the given background")
    if len(clip) == 1 and clip.backdrop is None:
        return Doubt("no smoke in one frame")
    change = float(plates.noise.total.max())
    if change > LARGE_NOISE:
        return Doubt("no smoke before a changing background", {"codes": 255 * change})
    return Doubt("no smoke before an estimated background")


def _still(plate: Plate, clip: Clip) -> tuple[Remark, ...]:
    """How the background of a camera that stands still was estimated, and what is before it if it has one colour."""
    unknown = float(np.mean(unknown_part(plate, clip, 0)))
    colour = plate.image[0, 0]
    other = 0.0
    if not (plate.image == colour).all():
        colour = np.median(plate.image.reshape(-1, 3), axis=0)
        other = float((plate.image != colour).any(-1).mean())
    if unknown > 0 or other >= MOSTLY:
        return (_picture(unknown),)
    red, green, blue = map(float, colour)
    found = Remark("background of one colour", {"color": (red, green, blue)})
    if colour.max() < BLACK:
        found = Remark("black background")
    return (found, Remark("background with objects", {"share": other})) if other else (found,)


def _picture(unknown: float) -> Remark:
    """How well a background of more than one colour is known, from the share of the pictures where it is not."""
    return Remark("background partly seen", {"unknown": unknown}) if unknown else Remark("background seen")
