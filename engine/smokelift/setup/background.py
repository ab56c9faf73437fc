"""What stands behind the smoke: as the scene gives it, or estimated from the clip."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from smokelift.footage.background import given_plates
from smokelift.footage.clip import Clip
from smokelift.footage.evidence import evidence
from smokelift.footage.exposure import gain_of, small
from smokelift.footage.plate import Plate, Plates, known_plate
from smokelift.footage.plate_estimation import estimate_plate, one_colour
from smokelift.scene import Background, Camera

BLACK = 0.001
"""Linear radiance below which a background is called black."""

EXPOSURE_SAMPLES = 16
"""Frames whose exposure is looked at before a run."""


@dataclass(frozen=True, eq=False)
class FoundPlates:
    """The plates of a clip.

    Attributes
    ----------
    plates
        Of the full pictures.
    background
        What the scene says of it, with what was found out; None where it is a picture that was estimated.
    notes
        What was assumed or estimated, a sentence each.
    """

    plates: Plates
    background: Background | None
    notes: tuple[str, ...] = ()


def find_plates(clip: Clip, camera: Camera | None, background: Background | None) -> FoundPlates:
    """Find what stands behind the smoke.

    Parameters
    ----------
    clip
        The footage.
    camera
        If it is known; one that moves allows no estimate but that of one colour.
    background
        What the scene says.

    Raises
    ------
    ValueError
        If a camera moves before a background of more than one colour that is not given.
    """
    moves = camera is not None and camera.moves
    given = given_plates(background, camera, clip)
    if given is not None:
        return FoundPlates(given, background)
    plate = estimate_plate(clip if moves else evidence(clip))
    if not moves:
        return FoundPlates(plate, None, (_estimated(plate),))
    colour = one_colour(plate)
    if colour is None:
        raise ValueError(
            "The camera moves, so what is behind the smoke cannot be found from the clip; give a clean plate with "
            "a picture for every frame (a video or plate_####.png), or a color, in [background]."
        )
    note = f"Background not given: one colour, {', '.join(f'{v:.2g}' for v in colour)} (linear)."
    return FoundPlates(known_plate(colour, clip), Background(color=colour), (note,))


def exposure_notes(clip: Clip, plates: Plates) -> tuple[str, ...]:
    """What is to be said of a clip whose exposure changes, a sentence; nothing of others."""
    gains = [gain_of(small(clip.frame(n)), small(plates.at(n).image)) for n in clip.spread(EXPOSURE_SAMPLES)]
    most = float(np.abs(np.log(gains)).max())
    if most == 0:
        return ()
    return (
        f"The exposure of the clip changes by up to {np.expm1(most):.0%}: every frame is brought to the background's.",
    )


def _estimated(plate: Plate) -> str:
    """How a background was estimated."""
    unknown = float(np.mean(plate.confidence < 0.5))
    if unknown == 0 and np.ptp(plate.image.reshape(-1, 3), axis=0).max() == 0:
        colour = ", ".join(f"{v:.2g}" for v in plate.image[0, 0])
        black = plate.image[0, 0].max() < BLACK
        return f"Background not given: it is {'black' if black else f'of one colour, {colour} (linear)'}."
    if unknown == 0:
        return "Background estimated from the clip, which shows every part of it free of smoke."
    return (
        f"Background estimated from the clip; {unknown:.0%} of the picture is hardly ever free of smoke, and what is "
        "behind it there is continued from around it. A clean plate in [background] would show it."
    )
