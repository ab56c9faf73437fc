"""Figures of a plate and of the mattes before it."""

import numpy as np

from smokelift import Clip
from smokelift.footage.images import Picture, linear_to_srgb
from smokelift.footage.matte import matte
from smokelift.footage.plate import Plates, evened

VISIBLE, CLEAR = 6.0, 0.5
"""8 bit codes of contrast from which smoke should be found, and up to which a pixel is clear."""

LOOKED_AT = 8
"""Frames of a clip."""


def score(clip: Clip, plates: Plates, background: Picture, clean: Picture) -> dict[str, float]:
    """Judge the plates that were found for a clip.

    Parameters
    ----------
    clip, plates
        What was filmed, and what was found behind it.
    background : (rows, columns, 3)
        The true background, linear.
    clean : (frames, rows, columns, 3)
        The true pictures, linear.

    Returns
    -------
    ``plate``: 95th percentile of the error where smoke passes (8 bit codes); ``lost``: fraction of the smoke's light
    that the plate holds; ``missed``: visible smoke outside the matte; ``false``: clear pixels inside it; ``unknown``:
    fraction of the picture.
    """
    clip = evened(clip, plates)
    truth = linear_to_srgb(background)
    missed, false, errors, lost, smoke = [], [], [], 0.0, 0.0
    touched = np.zeros(clean.shape[1:3], np.bool_)
    unknown = 0.0
    for number in clip.spread(LOOKED_AT):
        plate = plates.at(number)
        contrast = np.abs(linear_to_srgb(clean[number]) - truth).max(-1) * 255
        found = matte(clip.frame(number), plate).mask
        visible = contrast > VISIBLE
        touched |= visible
        if visible.any():
            missed.append(float((visible & ~found).sum() / visible.sum()))
        false.append(float(found[contrast < CLEAR].mean()) if (contrast < CLEAR).any() else 0.0)
        lost += float(np.abs(plate.image - background)[visible].sum())
        smoke += float(np.abs(clean[number] - background)[visible].sum())
        errors.append(np.abs(linear_to_srgb(plate.image) - truth).max(-1) * 255)
        unknown = float((plate.confidence < 0.5).mean())
    return {
        "plate": float(np.percentile(np.stack(errors)[:, touched], 95)),
        "lost": lost / smoke,
        "missed": float(np.mean(missed)),
        "false": float(np.mean(false)),
        "unknown": unknown,
    }
