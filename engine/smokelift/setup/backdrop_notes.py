"""What is to be said of what stands behind the smoke: how it was found, and why it may be wrong."""

from __future__ import annotations

import numpy as np

from smokelift.footage.backdrop import Backdrop
from smokelift.footage.clip import Clip
from smokelift.footage.exposure import largest_change, small
from smokelift.footage.lens import FILM_WIDTH
from smokelift.footage.plate import Plate, Plates
from smokelift.footage.quantiser import COARSE
from smokelift.footage.steady import exposures
from smokelift.setup.smoke import SAMPLES, SmokeSamples, unknown_part

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

FEW = 4
"""Frames from which on smoke hardly looks the same in all by chance: half of its pairs of successive samples do."""

FROM_ONE = (
    "One frame alone does not show what moves: the colour around it counts as background, and all that has another as "
    "smoke. If that is wrong, hide what is no smoke by a mask in [clip], or give a clean plate, or a colour, in "
    "[background]."
)
"""What is to be said of a background of one colour that a single frame shows."""

LARGE_NOISE = 6 / 255
"""Noise in sRGB values from which on the background may be what moves (docs/experiments/background.md)."""

_WHERE = "([background] in a scene file, Clean Plate in Blender)"
_GIVE = f"give a clean plate, or a colour {_WHERE}"


def backdrop_notes(found: Backdrop) -> tuple[str, ...]:
    """How a background was found, a sentence each."""
    clip, plates = found.clip, found.plates
    if found.source == "alpha":
        name = "white" if clip.backdrop else "black"
        return (f"The clip has an alpha channel, which is the matte: the smoke is shown before {name}.",)
    if found.source == "given":
        return ()
    if found.turns is None:
        assert isinstance(plates, Plate)
        return (_found(plates, clip),)
    unknown = [unknown_part(plates, clip, number) for number in clip.spread(EXPOSURE_SAMPLES)]
    moved = (
        f"The camera moves, by up to {found.turns.farthest:.0f} pixels: it is steadied against the background, as a "
        "camera that turns in its place, and has a matrix for every frame."
    )
    return (moved, *_focal(found), _how(float(np.mean(unknown))))


def backdrop_doubts(found: Backdrop) -> tuple[str, ...]:
    """Why a background may be wrong, a sentence each."""
    if found.source == "colour around one frame":
        return (FROM_ONE,)
    few = found.source == "picture" and 1 < found.frames < FEW
    return (*((_from_few(found.frames),) if few else ()), *_compressed(found.quantiser))


def cut_notes(found: Backdrop) -> tuple[str, ...]:
    """What is to be said of a clip with a cut, a sentence; nothing of others."""
    if found.cut is None:
        return ()
    (last, first), clip = found.cut, found.clip
    return (
        f"The picture changes at once between frames {last} and {first}, as at a cut, so that no background fits both "
        f"sides; use one of them, --frames {clip.first}:{last} or {first}:{clip.first + len(clip) - 1}.",
    )


def exposure_change(clip: Clip, plates: Plates) -> float:
    """Return by which share the exposure of a clip differs from its background's at most; 0 if it never does."""
    gains_of = exposures(plates)
    return largest_change([gains_of(number, small(clip.frame(number))) for number in clip.spread(EXPOSURE_SAMPLES)])


def exposure_notes(change: float) -> tuple[str, ...]:
    """What is to be said of a clip whose exposure changes by a share, a sentence; nothing of others."""
    if change == 0:
        return ()
    return (f"The exposure of the clip changes by up to {change:.0%}: every frame is brought to the background's.",)


def smoke_in_plate(samples: SmokeSamples) -> tuple[str, ...]:
    """What is to be said of a background that may hold most of the smoke, a sentence; nothing of others."""
    share = samples.unknown.sum() / max((samples.unknown | samples.covered).sum(), 1)
    if share < MOSTLY:
        return ()
    return (
        f"The background may hold most of the smoke: {share:.0%} of where smoke is or may be is never free of it, so "
        "what stays there all the time is missing from the result. Give a clean plate, or a colour, in [background].",
    )


def between_bars(samples: SmokeSamples) -> tuple[str, ...]:
    """What is to be said where bars beside the picture are its only background, a sentence; nothing of others."""
    at_a_time = len(samples.colours) / max(len(samples.gains), 1)
    for where, covered in (("above and below", samples.covered), ("to the left and right of", samples.covered.T)):
        rows = np.flatnonzero(covered.any(1))
        if len(rows) and rows[0] > 0 and rows[-1] < len(covered) - 1:
            picture = covered[rows[0] : rows[-1] + 1]
            if picture.mean() >= BETWEEN_BARS and at_a_time > MOSTLY * picture.size:
                return (
                    f"Only bars {where} the picture never change, so all between them is taken for smoke: crop them "
                    "off, or give a clean plate.",
                )
    return ()


def nothing_seen(
    clip: Clip, plates: Plates, samples: SmokeSamples, given: bool, cuts: tuple[str, ...]
) -> tuple[str, ...]:
    """What is to be said, before a run, of a clip whose samples show no smoke, two sentences; nothing of others.

    Parameters
    ----------
    clip
        The footage.
    plates, given
        What is behind the smoke, and whether the scene says so.
    samples
        The frames that were examined.
    cuts
        The `cut_notes` of the clip.
    """
    if samples.smoky:
        return ()
    count = len(clip.spread(SAMPLES))
    examined = f"the {count} frames that were examined" if count > 1 else "the one frame that was examined"
    return (
        f"No smoke found in {examined}, so that nothing of it could be measured.",
        *(cuts or (what_helps(clip, plates, given),)),
    )


def what_helps(clip: Clip, plates: Plates, given: bool) -> str:
    """What may show the smoke of a clip in which none is found, in a sentence; see `nothing_seen`."""
    if given:
        return f"Check the background that is given {_WHERE}: it may hold the smoke, or belong to another clip."
    if len(clip) == 1 and clip.backdrop is None:
        return f"One frame alone does not show what is behind its smoke: {_GIVE}."
    change = float(plates.noise.total.max())
    if change > LARGE_NOISE:
        return (
            f"The background changes by {255 * change:.0f} of 255 from frame to frame, and fainter smoke is not seen: "
            "if the camera moves, track it in Blender, and give its matrices in [camera] and what is behind the smoke "
            f"in [background]; if it stands still, {_GIVE}."
        )
    return f"If there is any, {_GIVE}."


def _focal(found: Backdrop) -> tuple[str, ...]:
    """What is to be said of the focal length of a camera that turns, a sentence; nothing if it is known."""
    if found.lens_is_known or found.turns is None:
        return ()
    if found.focal is None:
        return ("Focal length undetermined: the camera turns too little, or too little stands still, to show it.",)
    lens = found.turns.lens
    millimetres = FILM_WIDTH * lens.focal[0] / max(lens.size)
    return (
        f"Focal length measured on how the picture turns: {millimetres:.0f} mm on {FILM_WIDTH:g} mm film, "
        f"{found.focal.deviation:.0%} more or less.",
    )


def _found(plate: Plate, clip: Clip) -> str:
    """How the background of a clip was estimated."""
    unknown = float(np.mean(unknown_part(plate, clip, 0)))
    if unknown > 0:
        return _how(unknown)
    colour = plate.image[0, 0]
    other = 0.0
    if not (plate.image == colour).all():
        colour = np.median(plate.image.reshape(-1, 3), axis=0)
        other = float((plate.image != colour).any(-1).mean())
    if other < MOSTLY:
        said = ", ".join(f"{v:.2g}" for v in colour)
        found = f"Background not given: it is {'black' if colour.max() < BLACK else f'of one colour, {said} (linear)'}"
        if other == 0:
            return f"{found}."
        return (
            f"{found}, but for {other:.1%} of the picture that has other colours and never changes, as a nozzle, a "
            "floor or a logo does. If that is smoke, give the colour in [background]."
        )
    return _how(unknown)


def _from_few(frames: int) -> str:
    """What is to be said of a background of more than one colour that so few frames show, two at least."""
    return (
        f"Only {frames} frames show what is behind the smoke: what is the same in all that there are counts as "
        "background, smoke too. Give a clean plate, or a colour, in [background]."
    )


def _compressed(quantiser: float | None) -> tuple[str, ...]:
    """What is to be said of a background of more than one colour in so strongly compressed a clip, if it is that."""
    if quantiser is None or quantiser < COARSE:
        return ()
    return (
        f"The clip is strongly compressed (quantiser {quantiser:.0f} of 51): faint smoke may be missing from the "
        "result, because the codec lets it stand still as the background does. Use a copy that is compressed less, or "
        "give a clean plate in [background].",
    )


def _how(unknown: float) -> str:
    """How well a background of more than one colour is known, from the share of the pictures where it is not."""
    if unknown == 0:
        return "Background estimated from the clip, which shows every part of it free of smoke."
    return (
        f"Background estimated from the clip; {unknown:.0%} of the picture is hardly ever free of smoke, and what is "
        "behind it there is continued from around it, so how thick the smoke is there is undetermined. A clean "
        "plate in [background] would show it."
    )
