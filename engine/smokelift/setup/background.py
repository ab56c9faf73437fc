"""What stands behind the smoke: as the scene gives it, or estimated from the clip."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from smokelift.footage.background import given_plates
from smokelift.footage.clip import Clip
from smokelift.footage.plate import Plates, known_plate
from smokelift.footage.plate_estimation import estimate_plate, one_colour
from smokelift.scene import Background, Camera


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
    plate = estimate_plate(clip)
    if not moves:
        unseen = float(np.mean(plate.confidence < 0.5))
        note = f"Background estimated from the clip; {unseen:.0%} of the picture is hardly ever free of smoke."
        return FoundPlates(plate, None, (note,))
    colour = one_colour(plate)
    if colour is None:
        raise ValueError(
            "The camera moves, so what is behind the smoke cannot be found from the clip; give a clean plate with "
            "a picture for every frame (a video or plate_####.png), or a color, in [background]."
        )
    note = f"Background not given: one colour, {', '.join(f'{v:.2g}' for v in colour)} (linear)."
    return FoundPlates(known_plate(colour, clip), Background(color=colour), (note,))
