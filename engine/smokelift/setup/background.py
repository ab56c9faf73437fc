"""What stands behind the smoke: as the scene gives it, or estimated from the clip."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from functools import cache
from typing import Any

import numpy as np

from smokelift.footage.alignment import Lens
from smokelift.footage.backdrop import ONE_COLOUR_NOISE, colour_around, one_colour
from smokelift.footage.background import given_plates
from smokelift.footage.clip import Clip
from smokelift.footage.cut import find_cut
from smokelift.footage.evidence import evidence
from smokelift.footage.exposure import largest_change, small
from smokelift.footage.focal_length import FocalLength, focal_length
from smokelift.footage.images import Picture
from smokelift.footage.large_plate import large_samples
from smokelift.footage.lens import FILM_WIDTH
from smokelift.footage.panorama import estimate_panorama
from smokelift.footage.plain import plain_plate
from smokelift.footage.plate import Plate, Plates, known_plate
from smokelift.footage.plate_estimation import estimate_plate, steady_samples
from smokelift.footage.quantiser import COARSE, median_quantiser
from smokelift.footage.steady import cleared, exposures, uncovered, without_noise_light
from smokelift.footage.turning import Turns, find_turns
from smokelift.scene import Background, Camera
from smokelift.setup.smoke import SmokeSamples, unknown_part

BLACK = 0.001
"""Linear radiance below which a background is called black."""

EXPOSURE_SAMPLES = 16
"""Frames whose exposure is looked at before a run."""

TELEPHOTO = 3.0
"""Focal length over the usual one that is supposed where no turn with the usual one explains the clip. The wider lens
bends a pan more than the longer one does, so that either is found from one within a factor of about two."""

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


@dataclass(frozen=True, eq=False)
class FoundPlates:
    """The plates of a clip.

    Attributes
    ----------
    clip
        Without the brightness that noise adds to it, and its background where a mask hides it.
    plates
        Of the full pictures.
    background
        What the scene says of it, with what was found out; None where it is a picture that was estimated.
    notes
        What was assumed or estimated, a sentence each.
    turns
        Of the camera, if it was found to turn.
    doubts
        Why the plates may be wrong, a sentence each.
    """

    clip: Clip
    plates: Plates
    background: Background | None
    notes: tuple[str, ...] = ()
    turns: Turns | None = None
    doubts: tuple[str, ...] = ()


def find_plates(
    clip: Clip, camera: Camera | None, background: Background | None, lens: Lens | None = None
) -> FoundPlates:
    """Find what stands behind the smoke.

    Parameters
    ----------
    clip
        The footage.
    camera
        If it is known; one that moves allows no estimate but that of one colour.
    background
        What the scene says.
    lens
        Of the clip; without it the camera is taken to stand still unless it is known to move.

    Raises
    ------
    ValueError
        If a camera moves before a background of more than one colour that is not given, or turns too far.
    """

    @cache
    def shot() -> tuple[int, int]:
        # as filmed: neither what noise adds to light nor a mask changes which frames belong together
        part = evidence(clip.as_filmed())
        return part.first, min(part.first + len(part), len(clip.whole())) - 1

    found = _find_plates(clip, camera, background, lens, shot)
    quiet = without_noise_light(clip, found.plates)
    if quiet is not clip:
        again = _find_plates(quiet, camera, background, lens, shot)
        # noise is that of the pictures as they were filmed: sRGB values of the others are too low on the mean
        plates: Any = again.plates
        found = replace(again, plates=replace(plates, noise=found.plates.noise))
    shown = uncovered(found.plates, quiet)
    return replace(found, clip=cleared(quiet, shown), plates=shown)


def _find_plates(
    clip: Clip,
    camera: Camera | None,
    background: Background | None,
    lens: Lens | None,
    shot: Callable[[], tuple[int, int]],
) -> FoundPlates:
    """The plates of a clip as it is, see `find_plates`; ``shot`` tells the frames of its file that are evidence."""
    moves = camera is not None and camera.moves
    told = camera is not None or clip.lens is not None
    if clip.backdrop is not None:
        grey = (clip.backdrop,) * 3
        name = "white" if clip.backdrop else "black"
        note = f"The clip has an alpha channel, which is the matte: the smoke is shown before {name}."
        unused = ("[background] is not used.",) if background is not None else ()
        return FoundPlates(clip, known_plate(grey, clip), Background(color=grey), (note, *unused))
    given = given_plates(background, camera, clip)
    if given is not None:
        return FoundPlates(clip, given, background)
    if not moves:
        return _estimated(clip, lambda: clip.part(*shot()), lens, told)
    plate = estimate_plate(clip)
    colour = one_colour(plate)
    if colour is None:
        raise ValueError(
            "The camera moves, so what is behind the smoke cannot be found from the clip; give a clean plate with "
            "a picture for every frame (a video or plate_####.png), or a colour ([background] in a scene file, Clean "
            "Plate in Blender)."
        )
    note = f"Background not given: one colour, {', '.join(f'{v:.2g}' for v in colour)} (linear)."
    return FoundPlates(clip, known_plate(colour, clip), Background(color=colour), (note,))


def exposure_change(clip: Clip, plates: Plates) -> float:
    """Return by which share the exposure of a clip differs from its background's at most; 0 if it never does."""
    gains_of = exposures(plates)
    return largest_change([gains_of(number, small(clip.frame(number))) for number in clip.spread(EXPOSURE_SAMPLES)])


def exposure_notes(change: float, flickers: bool = False) -> tuple[str, ...]:
    """What is to be said of a clip whose exposure changes by a share, a sentence; nothing of others.

    ``flickers`` says that the smoke alone shows it (`smokelift.footage.flicker`).
    """
    if change == 0:
        return ()
    if flickers:
        return (
            f"The exposure of the clip flickers by up to {change:.0%}, which only the smoke shows: every frame is "
            "brought to that of those around it.",
        )
    return (f"The exposure of the clip changes by up to {change:.0%}: every frame is brought to the background's.",)


def cut_notes(clip: Clip, pictures: Mapping[int, Picture]) -> tuple[str, ...]:
    """What is to be said of a clip with a cut, a sentence; nothing of others. ``pictures`` are its `small_pictures`."""
    after = find_cut([*pictures], [*pictures.values()], lambda number: small(clip.reduced(number)))
    if after is None:
        return ()
    last, first = clip.first + after - 1, clip.first + after
    return (
        f"The picture changes at once between frames {last} and {first}, as at a cut, so that no background fits both "
        f"sides; use one of them, --frames {clip.first}:{last} or {first}:{clip.first + len(clip) - 1}.",
    )


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


def _estimated(clip: Clip, evidence_of: Callable[[], Clip], lens: Lens | None, told: bool) -> FoundPlates:
    """The background of a clip whose camera stands still or, with a lens that is told or only supposed, turns."""
    plain_everywhere = plain_plate(clip, clip)
    # of one colour, no other frame of the file would tell more
    shot = clip if plain_everywhere is not None else evidence_of()
    if len(shot) > len(clip):
        plain_everywhere = plain_plate(clip, shot)
    if plain_everywhere is not None and plain_everywhere.noise.total.max() <= ONE_COLOUR_NOISE:
        return FoundPlates(clip, plain_everywhere, None, (_found(plain_everywhere, clip),))
    shot = evidence_of()
    alone = colour_around(shot.frame(0)) if len(shot) == 1 else None
    if alone is not None:
        plate = known_plate(alone, clip)
        return FoundPlates(clip, plate, None, (_found(plate, clip),), doubts=(FROM_ONE,))
    samples = large_samples(shot) or steady_samples(shot)
    backdrop, noise = samples.backdrop(), samples.noise
    # one colour has nothing to hold on to, and is the same wherever the camera looks; in noise, texture may pass by
    plain = backdrop is not None and noise.total.max() <= ONE_COLOUR_NOISE
    turns, focal = (None, None) if plain or lens is None else _turned(clip, lens, told)
    if turns is None:
        plate = backdrop or samples.plate()
        few = (_from_few(len(shot)),) if backdrop is None and 1 < len(shot) < FEW else ()
        coarse = _compressed(clip) if backdrop is None else ()
        return FoundPlates(clip, plate, None, (_found(plate, clip),), doubts=(*few, *coarse))
    panorama = estimate_panorama(clip, turns)
    parts = [unknown_part(panorama, clip, number) for number in clip.spread(EXPOSURE_SAMPLES)]
    unknown = float(np.mean(parts))
    moved = (
        f"The camera moves, by up to {turns.farthest:.0f} pixels: it is steadied against the background, as a camera "
        "that turns in its place, and has a matrix for every frame."
    )
    notes = (moved, *focal_notes(turns.lens, told, focal), _how(unknown))
    return FoundPlates(clip, panorama, None, notes, turns, _compressed(clip))


def _turned(clip: Clip, lens: Lens, told: bool) -> tuple[Turns | None, FocalLength | None]:
    """How the camera turned, and the focal length where it is measured since it is not told."""
    if told:
        return find_turns(clip, lens), None
    turns = find_turns(clip, lens, FocalLength(TELEPHOTO, 0.0).of(lens))
    focal = None if turns is None else focal_length(clip, turns)
    if turns is None or focal is None or not focal.determined:
        return turns, None
    return find_turns(clip, focal.of(turns.lens)) or turns, focal


def focal_notes(lens: Lens, told: bool, focal: FocalLength | None) -> tuple[str, ...]:
    """What is to be said of the focal length of a camera that turns, a sentence; nothing if it is told."""
    if told:
        return ()
    if focal is None:
        return ("Focal length undetermined: the camera turns too little, or too little stands still, to show it.",)
    millimetres = FILM_WIDTH * lens.focal[0] / max(lens.size)
    return (
        f"Focal length measured on how the picture turns: {millimetres:.0f} mm on {FILM_WIDTH:g} mm film, "
        f"{focal.deviation:.0%} more or less.",
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


def _compressed(clip: Clip) -> tuple[str, ...]:
    """What is to be said of a background of more than one colour in so strongly compressed a clip, if it is that."""
    quantiser = median_quantiser(clip.path)
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
